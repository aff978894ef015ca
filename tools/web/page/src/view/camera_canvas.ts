// What one camera sees, on a canvas: its preview with the blobs by their use, or, without previews, the markers of the set as it sees them.

import type { Preview } from "../../gen/mocap/v1/preview_pb";
import type { BlobUse } from "../model/blob_use";
import type { CameraView } from "../model/camera_view";
import type { SceneFrame } from "../model/scene_frame";
import { clearedContext } from "./canvas_size";
import { drawBlob, drawMark } from "./marks";
import { type Palette, readPalette } from "./palette";

export const kGreys = 64;
// The histogram needs no more pixels than this.
const kSample_px = 160;

interface Shown {
  image: ImageBitmap;
  preview: Preview;
  uses: BlobUse[];
}

export class CameraCanvas {
  private palette: Palette;
  private shown: Shown | null = null;
  private decoding = false;
  private ended = false;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly camera: CameraView) {
    this.palette = readPalette(canvas);
  }

  /** While an image is decoded, newer ones are skipped. */
  async showPreview(preview: Preview, uses: BlobUse[]): Promise<void> {
    if (this.decoding) return;
    this.decoding = true;
    try {
      const image = await createImageBitmap(new Blob([new Uint8Array(preview.jpeg)], { type: "image/jpeg" }));
      this.shown?.image.close();
      this.shown = { image, preview, uses };
      if (this.ended) this.dispose();
      else this.drawPreview();
    } catch {
      // A damaged image: the next one comes within 100 ms.
    } finally {
      this.decoding = false;
    }
  }

  /** Without previews. */
  showMarkers(frame: SceneFrame): void {
    const cleared = clearedContext(this.canvas);
    if (!cleared || !this.camera.calibrated) return;
    const { context, width, height } = cleared;
    const place = this.fitted(width, height, this.camera.width_px, this.camera.height_px);
    for (const marker of frame.markers) {
      const at = this.camera.project(marker.at_m);
      if (at) drawMark(context, place(at), marker.state, Math.max(2, width / 130), this.palette, marker.subject);
    }
  }

  recolour(): void {
    this.palette = readPalette(this.canvas);
    if (this.shown) this.drawPreview();
  }

  /** Share of the preview's pixels in each of 64 steps of grey; null without a preview. */
  greys(): Float32Array | null {
    if (!this.shown) return null;
    const { image } = this.shown;
    const small = new OffscreenCanvas(kSample_px, Math.max(1, Math.round((kSample_px * image.height) / image.width)));
    const context = small.getContext("2d");
    if (!context) return null;
    // Without smoothing: a mean of pixels would hide a small bright marker.
    context.imageSmoothingEnabled = false;
    context.drawImage(image, 0, 0, small.width, small.height);
    const { data } = context.getImageData(0, 0, small.width, small.height);
    const shares = new Float32Array(kGreys);
    for (let i = 0; i < data.length; i += 4) shares[data[i] >> 2] += 4 / data.length;
    return shares;
  }

  dispose(): void {
    this.ended = true;
    this.shown?.image.close();
    this.shown = null;
  }

  private drawPreview(): void {
    const cleared = clearedContext(this.canvas);
    if (!cleared || !this.shown) return;
    const { context, width, height } = cleared;
    const { image, preview, uses } = this.shown;
    const place = this.fitted(width, height, preview.widthPx, preview.heightPx);
    const [left, top] = place([-0.5, -0.5]);
    const [right, bottom] = place([preview.widthPx - 0.5, preview.heightPx - 0.5]);
    context.drawImage(image, left, top, right - left, bottom - top);
    uses.forEach((use, i) => drawBlob(context, place([preview.xPx[i], preview.yPx[i]]), use, Math.max(5, width / 60), this.palette));
  }

  /** From pixels of the camera to the canvas: as large as fits, in the middle. */
  private fitted(width: number, height: number, imageWidth: number, imageHeight: number): (at: [number, number]) => [number, number] {
    const scale = Math.min(width / Math.max(1, imageWidth), height / Math.max(1, imageHeight));
    const [left, top] = [(width - scale * imageWidth) / 2, (height - scale * imageHeight) / 2];
    return ([u, v]) => [left + scale * (u + 0.5), top + scale * (v + 0.5)];
  }
}
