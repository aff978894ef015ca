// The volume between the cameras that at least three of them see, as the faces of a grid of cells.

import type { CameraView, Vec3 } from "./camera_view";

export const kCamerasNeeded = 3;
const kCell_m = 0.5;
const kCeiling_m = 3;
const kMaxCells = 40000;

/** Side faces of the cells' outline: four corners each. */
export interface SeenVolume {
  faces: [Vec3, Vec3, Vec3, Vec3][];
  volume_m3: number;
}

const directions: { step: Vec3; corners: [Vec3, Vec3, Vec3, Vec3] }[] = [
  { step: [1, 0, 0], corners: [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]] },
  { step: [-1, 0, 0], corners: [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]] },
  { step: [0, 1, 0], corners: [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]] },
  { step: [0, -1, 0], corners: [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]] },
  { step: [0, 0, 1], corners: [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]] },
  { step: [0, 0, -1], corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]] },
];

export const camerasThatSee = (cameras: CameraView[], point_m: Vec3): number =>
  cameras.filter((camera) => camera.project(point_m) !== null).length;

export function seenVolume(cameras: CameraView[]): SeenVolume {
  const calibrated = cameras.filter((camera) => camera.calibrated);
  if (calibrated.length < kCamerasNeeded) return { faces: [], volume_m3: 0 };
  const range = (axis: 0 | 1) => {
    const places = calibrated.map((camera) => camera.centre_m[axis]);
    return [Math.floor(Math.min(...places) / kCell_m), Math.ceil(Math.max(...places) / kCell_m)];
  };
  const [x0, x1] = range(0);
  const [y0, y1] = range(1);
  const layers = Math.round(kCeiling_m / kCell_m);
  if ((x1 - x0) * (y1 - y0) * layers > kMaxCells) return { faces: [], volume_m3: 0 };

  const seen = new Set<string>();
  for (let x = x0; x < x1; x++) {
    for (let y = y0; y < y1; y++) {
      for (let z = 0; z < layers; z++) {
        if (camerasThatSee(calibrated, [(x + 0.5) * kCell_m, (y + 0.5) * kCell_m, (z + 0.5) * kCell_m]) >= kCamerasNeeded) seen.add(`${x},${y},${z}`);
      }
    }
  }
  const faces: SeenVolume["faces"] = [];
  for (const key of seen) {
    const cell = key.split(",").map(Number) as Vec3;
    const at = (corner: Vec3): Vec3 => [(cell[0] + corner[0]) * kCell_m, (cell[1] + corner[1]) * kCell_m, (cell[2] + corner[2]) * kCell_m];
    for (const { step, corners } of directions) {
      if (seen.has(`${cell[0] + step[0]},${cell[1] + step[1]},${cell[2] + step[2]}`)) continue;
      faces.push(corners.map(at) as [Vec3, Vec3, Vec3, Vec3]);
    }
  }
  return { faces, volume_m3: seen.size * kCell_m ** 3 };
}
