// Where in each camera's image markers were seen since a moment: cells that have none show where to walk or wave next.

import type { CameraView, Vec3 } from "./camera_view";

export const kColumns = 16;
export const kRows = 12;

export class Coverage {
  private readonly cells = new Map<string, Uint32Array>();

  /** `points_m` are markers that cameras measured. */
  add(cameras: CameraView[], points_m: Vec3[]): void {
    for (const camera of cameras) {
      if (!camera.calibrated) continue;
      let cells = this.cells.get(camera.name);
      if (!cells) this.cells.set(camera.name, (cells = new Uint32Array(kColumns * kRows)));
      for (const point of points_m) {
        const at = camera.project(point);
        if (!at) continue;
        const column = Math.min(kColumns - 1, Math.floor(((at[0] + 0.5) / camera.width_px) * kColumns));
        const row = Math.min(kRows - 1, Math.floor(((at[1] + 0.5) / camera.height_px) * kRows));
        cells[row * kColumns + column]++;
      }
    }
  }

  /** Number of markers in each cell, row by row. */
  of(camera: string): Uint32Array {
    return this.cells.get(camera) ?? new Uint32Array(kColumns * kRows);
  }

  /** Share of the cells with at least one marker. */
  share(camera: string): number {
    return this.of(camera).filter((count) => count > 0).length / (kColumns * kRows);
  }

  clear(): void {
    this.cells.clear();
  }
}
