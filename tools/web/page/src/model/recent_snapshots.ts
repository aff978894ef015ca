// The last snapshots, to find the one that was exposed with an image that came later.

import type { Snapshot } from "../../gen/mocap/v1/snapshot_pb";

// A quarter of a second at 120 Hz.
const kKept = 30;
// A browser that draws 30 times a second has a snapshot within this time of each image.
const kNear_ns = 20_000_000n;

const distance = (snapshot: Snapshot, at_ns: bigint): bigint => {
  const apart = (snapshot.instants?.exposedAtNs ?? 0n) - at_ns;
  return apart < 0n ? -apart : apart;
};

export class RecentSnapshots {
  private kept: Snapshot[] = [];

  add(snapshot: Snapshot): void {
    this.kept.push(snapshot);
    if (this.kept.length > kKept) this.kept.shift();
  }

  /** The snapshot exposed nearest to this instant, and the time between the two; null if there is none within 20 ms. */
  near(exposed_ns: bigint): { snapshot: Snapshot; apart_ms: number } | null {
    let nearest: Snapshot | null = null;
    for (const snapshot of this.kept) if (!nearest || distance(snapshot, exposed_ns) < distance(nearest, exposed_ns)) nearest = snapshot;
    if (!nearest || distance(nearest, exposed_ns) > kNear_ns) return null;
    return { snapshot: nearest, apart_ms: Number(distance(nearest, exposed_ns)) / 1e6 };
  }
}
