// The health of the last minutes, and the events since the page was opened; both bounded.

import type { Event } from "../../gen/mocap/v1/event_pb";
import { type Health, LatencyStage } from "../../gen/mocap/v1/health_pb";
import { stage } from "./health_report";

// Health comes about once a second.
const kMaxSamples = 900;
const kMaxEvents = 500;
const kBefore_ns = 60_000_000_000n;

/** Columns for graphs; null: unknown. */
export interface Samples {
  at_s: number[];
  p50_ms: (number | null)[];
  p99_ms: (number | null)[];
  rate_hz: (number | null)[];
  p99ByStage_ms: Map<LatencyStage, (number | null)[]>;
}

export const kStages = [LatencyStage.RECEIVE, LatencyStage.DETECT, LatencyStage.FUSE, LatencyStage.SEND];

export class History {
  private kept: { at_s: number; health: Health }[] = [];
  readonly events: { at_s: number; event: Event }[] = [];

  addHealth(health: Health, at_s: number): void {
    const last = this.kept[this.kept.length - 1];
    if (last && health.atNs < last.health.atNs) this.kept = []; // the daemon restarted
    this.kept.push({ at_s, health });
    if (this.kept.length > kMaxSamples) this.kept.shift();
  }

  /** Newest first. */
  addEvent(event: Event, at_s: number): void {
    this.events.unshift({ at_s, event });
    if (this.events.length > kMaxEvents) this.events.pop();
  }

  /** About a minute before the newest; the oldest if the page is younger. */
  before(): Health | null {
    const newest = this.kept[this.kept.length - 1];
    if (!newest) return null;
    return (this.kept.find((sample) => newest.health.atNs - sample.health.atNs <= kBefore_ns) ?? newest).health;
  }

  samples(): Samples {
    const ms = (ns: bigint | undefined) => (ns === undefined ? null : Number(ns) / 1e6);
    const of = (read: (health: Health) => number | null) => this.kept.map((sample) => read(sample.health));
    return {
      at_s: this.kept.map((sample) => sample.at_s),
      p50_ms: of((health) => ms(stage(health, LatencyStage.TOTAL)?.p50Ns)),
      p99_ms: of((health) => ms(stage(health, LatencyStage.TOTAL)?.p99Ns)),
      rate_hz: of((health) => health.setRateHz),
      p99ByStage_ms: new Map(kStages.map((which) => [which, of((health) => ms(stage(health, which)?.p99Ns))])),
    };
  }
}
