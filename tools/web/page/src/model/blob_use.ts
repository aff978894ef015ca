// Which blobs of a preview are views of a 3D marker. The feed does not say; the page compares them with the projected markers.

import type { CameraView } from "./camera_view";
import type { SceneFrame } from "./scene_frame";

export type BlobUse = "used" | "unused" | "uncalibrated" | "unknown";

// A measured marker is projected within a pixel of its blob; the rest is the motion between the two exposures.
const kGate_px = 6;

export interface Blobs {
  x_px: number[];
  y_px: number[];
}

/** One entry for each blob. `frame`: the set of the same exposure, null if the page does not have it. */
export function blobUses(blobs: Blobs, camera: CameraView, frame: SceneFrame | null): BlobUse[] {
  if (!camera.calibrated) return blobs.x_px.map(() => "uncalibrated");
  if (!frame) return blobs.x_px.map(() => "unknown");
  const views = frame.markers.filter((marker) => marker.state === "measured" || marker.state === "unlabelled").map((marker) => camera.project(marker.at_m));
  return blobs.x_px.map((x, i) => (views.some((view) => view !== null && Math.hypot(view[0] - x, view[1] - blobs.y_px[i]) < kGate_px) ? "used" : "unused"));
}
