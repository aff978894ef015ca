// The last snapshots, to find the one of the same exposure as an image that came later.

import type { Snapshot } from "../../gen/mocap/v1/snapshot_pb";

// A quarter of a second at 120 Hz.
const kKept = 30;
// Half the time between two exposures at 60 Hz.
const kSameExposure_ns = 8_000_000n;

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

  /** The snapshot exposed at this instant; null if it was skipped or is too old. */
  at(exposed_ns: bigint): Snapshot | null {
    let nearest: Snapshot | null = null;
    for (const snapshot of this.kept) if (!nearest || distance(snapshot, exposed_ns) < distance(nearest, exposed_ns)) nearest = snapshot;
    return nearest && distance(nearest, exposed_ns) <= kSameExposure_ns ? nearest : null;
  }
}
