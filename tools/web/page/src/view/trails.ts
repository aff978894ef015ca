// The last positions of each labelled marker.

import type { DrawnMarker } from "../model/scene_frame";
import type { Vec3 } from "../model/camera_view";

const kLength_ms = 1000;
const kMaxPoints = 40;
// A label that jumped to another marker is not a path.
const kJump_m = 0.3;

export interface Trail {
  subject: number;
  points_m: Vec3[];
}

interface Kept extends Trail {
  at_ms: number[];
}

export class Trails {
  private readonly kept = new Map<string, Kept>();

  add(markers: DrawnMarker[], now_ms: number): void {
    for (const marker of markers) {
      if (marker.state !== "measured" && marker.state !== "filled") continue;
      const key = `${marker.subject}/${marker.index}`;
      let trail = this.kept.get(key);
      if (!trail) this.kept.set(key, (trail = { subject: marker.subject, points_m: [], at_ms: [] }));
      const last = trail.points_m[trail.points_m.length - 1];
      if (last && Math.hypot(last[0] - marker.at_m[0], last[1] - marker.at_m[1], last[2] - marker.at_m[2]) > kJump_m) {
        trail.points_m = [];
        trail.at_ms = [];
      }
      trail.points_m.push(marker.at_m);
      trail.at_ms.push(now_ms);
    }
    for (const [key, trail] of this.kept) {
      while (trail.at_ms.length > kMaxPoints || (trail.at_ms.length > 0 && now_ms - trail.at_ms[0] > kLength_ms)) {
        trail.at_ms.shift();
        trail.points_m.shift();
      }
      if (trail.at_ms.length === 0) this.kept.delete(key);
    }
  }

  all(): Iterable<Trail> {
    return this.kept.values();
  }

  clear(): void {
    this.kept.clear();
  }
}
