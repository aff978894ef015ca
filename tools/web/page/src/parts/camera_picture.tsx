import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { type Preview, PreviewSchema } from "../../gen/mocap/v1/preview_pb";
import { blobUses } from "../model/blob_use";
import type { CameraView } from "../model/camera_view";
import { sceneFrame } from "../model/scene_frame";
import { decode, description, health, onFrame, onTopic, recent } from "../state/live";
import { CameraCanvas } from "../view/camera_canvas";
import { useSeen, useTheme } from "./hooks";

const kDrawEvery_ms = 100;
const kNoImage_ms = 2000;

/** Draws previews while they come. Returns the function that ends it. */
function followPreviews(view: CameraCanvas, camera: CameraView, arrived: (preview: Preview) => void): () => void {
  return onTopic(`preview/${camera.name}`, (payload) => {
    const preview = decode(PreviewSchema, payload);
    if (!preview || preview.xPx.length !== preview.yPx.length) return;
    arrived(preview);
    const set = recent.near(preview.exposedAtNs);
    const frame = set && description.peek() ? sceneFrame(description.peek()!, set.snapshot, null) : null;
    void view.showPreview(preview, blobUses({ x_px: preview.xPx, y_px: preview.yPx }, camera, frame, set?.apart_ms));
  });
}

/** Draws the markers of the sets, ten times a second, unless `skip`. */
function followMarkers(view: CameraCanvas, skip: () => boolean): () => void {
  let drawn_ms = -Infinity;
  return onFrame((newest) => {
    const now = performance.now();
    if (now - drawn_ms < kDrawEvery_ms || skip() || !description.peek()) return;
    drawn_ms = now;
    view.showMarkers(sceneFrame(description.peek()!, newest, health.peek()));
  });
}

interface Parts {
  camera: CameraView;
  images: boolean;
  /** Called twice a second with the histogram of the preview, if there is one. */
  onGreys?(greys: Float32Array | null): void;
  /** Lies over the picture; called with the size of the camera's image once it is known. */
  over?(width_px: number, height_px: number): JSX.Element;
}

export function CameraPicture({ camera, images, onGreys, over }: Parts): JSX.Element {
  const box = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const view = useRef<CameraCanvas | null>(null);
  const seen = useSeen(box);
  const [hasImage, setHasImage] = useState(false);
  const [size, setSize] = useState<[number, number]>([camera.width_px, camera.height_px]);
  useTheme(() => view.current?.recolour());
  useEffect(() => {
    if (!seen) return undefined;
    const made = new CameraCanvas(canvas.current!, camera);
    view.current = made;
    let imageAt_ms = -Infinity;
    const fresh = () => performance.now() - imageAt_ms < kNoImage_ms;
    const watch = window.setInterval(() => {
      setHasImage(fresh());
      onGreys?.(fresh() ? made.greys() : null);
    }, kNoImage_ms / 4);
    const ends = [followMarkers(made, fresh)];
    if (images) ends.push(followPreviews(made, camera, ({ widthPx, heightPx }) => {
      imageAt_ms = performance.now();
      setSize((before) => (before[0] === widthPx && before[1] === heightPx ? before : [widthPx, heightPx]));
    }));
    return () => {
      window.clearInterval(watch);
      for (const end of ends) end();
      view.current = null;
      made.dispose();
    };
  }, [seen, camera, images]);
  const note = !camera.calibrated ? "not calibrated" : images && !hasImage ? "no image; markers as this camera sees them" : "";
  return (
    <div class="picture always-dark" ref={box}>
      <canvas ref={canvas} role="img" aria-label={`${hasImage ? "Image" : "Markers as seen"} by camera ${camera.name}`} />
      {over && size[0] > 0 && size[1] > 0 && over(...size)}
      {note && <span class="note">{note}</span>}
    </div>
  );
}
