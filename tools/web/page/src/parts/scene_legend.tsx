import type { JSX } from "preact";
import { useRef } from "preact/hooks";
import type { BlobUse } from "../model/blob_use";
import type { DrawnState } from "../model/scene_frame";
import { kEnlarged, kSigmas } from "../model/sightings";
import { clearedContext } from "../view/canvas_size";
import { drawBlob, drawMark, drawRay, drawSpread } from "../view/marks";
import { type Palette, readPalette } from "../view/palette";
import { useTheme } from "./hooks";

/** Draws its mark as the canvases do. */
function Sample({ draw }: { draw(context: CanvasRenderingContext2D, palette: Palette): void }): JSX.Element {
  const canvas = useRef<HTMLCanvasElement>(null);
  useTheme(() => {
    const cleared = canvas.current && clearedContext(canvas.current);
    if (cleared) draw(cleared.context, readPalette());
  });
  return <canvas ref={canvas} class="mark" aria-hidden="true" />;
}

const states: { state: DrawnState; text: string }[] = [
  { state: "measured", text: "measured" }, { state: "filled", text: "filled in" }, { state: "unlabelled", text: "no label" }, { state: "missing", text: "expected, not seen" },
];

const sightings: { text: string; draw(context: CanvasRenderingContext2D, palette: Palette): void }[] = [
  { text: "ray of a camera that saw the marker", draw: drawRay },
  { text: `position within ${kSigmas} σ, ${kEnlarged} times as large; filled in: true size`, draw: drawSpread },
];

export function SceneLegend({ rays = false }: { rays?: boolean }): JSX.Element {
  return (
    <ul class="legend" aria-label="Marks of markers">
      {states.map(({ state, text }) => (
        <li key={state}><Sample draw={(context, palette) => drawMark(context, [8, 8], state, 4, palette, 0)} />{text}</li>
      ))}
      {rays && sightings.map(({ text, draw }) => <li key={text}><Sample draw={draw} />{text}</li>)}
    </ul>
  );
}

const uses: { use: BlobUse; text: string }[] = [
  { use: "used", text: "blob that is a view of a marker" }, { use: "unused", text: "blob that is used for nothing" }, { use: "uncalibrated", text: "blob of a camera that is not calibrated" },
  { use: "unknown", text: "blob, use not known at this instant" },
];

export function BlobLegend(): JSX.Element {
  return (
    <ul class="legend" aria-label="Marks of blobs">
      {uses.map(({ use, text }) => (
        <li key={use}><Sample draw={(context, palette) => drawBlob(context, [8, 8], use, 5, palette)} />{text}</li>
      ))}
    </ul>
  );
}
