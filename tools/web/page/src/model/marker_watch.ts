// What a single snapshot does not say: when each labelled marker was last measured, and how often its label moved to another track.

import { MarkerState, type Snapshot } from "../../gen/mocap/v1/snapshot_pb";

export interface WatchedMarker {
  /** On the page's monotonic clock, ms; null: never since the page was opened. */
  seenAt_ms: number | null;
  labelChanges: number;
  track: number;
}

export class MarkerWatch {
  private readonly subjects = new Map<number, WatchedMarker[]>();

  add(snapshot: Snapshot, now_ms: number): void {
    for (const state of snapshot.subjects) {
      const markers = state.markers;
      if (!markers) continue;
      let watched = this.subjects.get(state.subject);
      if (!watched || watched.length !== markers.states.length) {
        watched = markers.states.map(() => ({ seenAt_ms: null, labelChanges: 0, track: 0 }));
        this.subjects.set(state.subject, watched);
      }
      markers.states.forEach((marker, i) => {
        if (marker !== MarkerState.MEASURED) return;
        const track = markers.trackIdsPlusOne[i] ?? 0;
        const entry = watched[i];
        if (track !== 0 && entry.track !== 0 && track !== entry.track) entry.labelChanges++;
        if (track !== 0) entry.track = track;
        entry.seenAt_ms = now_ms;
      });
    }
  }

  of(subject: number, marker: number): WatchedMarker | null {
    return this.subjects.get(subject)?.[marker] ?? null;
  }

  clear(): void {
    this.subjects.clear();
  }
}
