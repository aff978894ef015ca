// The age of the newest data, from its exposure until now, although the clocks of the two machines may differ.

// Two clocks that agree within this are taken as one: the age then includes the network.
const kSameClock_ms = 250;
const kWindow_ms = 60000;

export class DataAge {
  private newestUtc_ms: number | null = null;
  private leastDelay_ms = Infinity;
  private leastSince_ms = 0;

  /** Both on their machines' UTC clocks: exposure on the daemon's, receipt on this one. */
  add(exposedUtc_ms: number, receivedUtc_ms: number): void {
    this.newestUtc_ms = exposedUtc_ms;
    const delay_ms = receivedUtc_ms - exposedUtc_ms;
    if (delay_ms < this.leastDelay_ms || receivedUtc_ms - this.leastSince_ms > kWindow_ms) {
      this.leastDelay_ms = delay_ms;
      this.leastSince_ms = receivedUtc_ms;
    }
  }

  /** False: the machines' clocks differ, and the age counts from the fastest message of the last minute. */
  get clocksAgree(): boolean {
    return this.leastDelay_ms > -5 && this.leastDelay_ms < kSameClock_ms;
  }

  /** Null: no data yet. */
  age_s(nowUtc_ms: number): number | null {
    if (this.newestUtc_ms === null) return null;
    const offset_ms = this.clocksAgree ? 0 : this.leastDelay_ms;
    return Math.max(0, nowUtc_ms - this.newestUtc_ms - offset_ms) / 1000;
  }
}
