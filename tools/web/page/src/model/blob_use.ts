// Which blobs of a preview are views of a 3D marker. The feed does not say; the page compares them with the projected markers.

import type { CameraView } from "./camera_view";
import type { SceneFrame } from "./scene_frame";

export type BlobUse = "used" | "unused" | "uncalibrated" | "unknown";

// A measured marker is projected within a pixel of its blob; a hand at 2 m/s, 3 m from a lens of 900 px, moves 0.6 px in a millisecond.
const kGate_px = 4;
const kMotion_px_ms = 0.6;

export interface Blobs {
  x_px: number[];
  y_px: number[];
}

/** One entry for each blob. `frame`: a set exposed `apart_ms` before or after the image, null if the page has none. */
export function blobUses(blobs: Blobs, camera: CameraView, frame: SceneFrame | null, apart_ms = 0): BlobUse[] {
  if (!camera.calibrated) return blobs.x_px.map(() => "uncalibrated");
  if (!frame) return blobs.x_px.map(() => "unknown");
  const gate_px = kGate_px + kMotion_px_ms * apart_ms;
  const views = frame.markers.filter((marker) => marker.state === "measured" || marker.state === "unlabelled").map((marker) => camera.project(marker.at_m));
  return blobs.x_px.map((x, i) => (views.some((view) => view !== null && Math.hypot(view[0] - x, view[1] - blobs.y_px[i]) < gate_px) ? "used" : "unused"));
}
