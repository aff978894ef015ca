// Grey values of a camera's image on a logarithmic scale, and the threshold of the detection.

import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { kGreys } from "../view/camera_canvas";
import { clearedContext } from "../view/canvas_size";
import { readPalette } from "../view/palette";

// A marker of three pixels in a sample of 20,000 pixels is still seen.
const kLeastShare = 1e-5;

function draw(canvas: HTMLCanvasElement, greys: Float32Array, threshold_grey: number | undefined): void {
  const cleared = clearedContext(canvas);
  if (!cleared) return;
  const { context, width, height } = cleared;
  const palette = readPalette();
  context.fillStyle = palette.subjects[0];
  greys.forEach((share, i) => {
    const bar = share <= kLeastShare ? 0 : (height * Math.log(share / kLeastShare)) / Math.log(1 / kLeastShare);
    context.fillRect((i * width) / kGreys, height - bar, width / kGreys - 1, bar);
  });
  if (threshold_grey === undefined) return;
  context.fillStyle = palette.uncalibrated;
  context.fillRect((threshold_grey / 256) * width - 1, 0, 2, height);
}

export function GreyHistogram({ greys, threshold_grey }: { greys: Float32Array | null; threshold_grey: number | undefined }): JSX.Element {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    if (canvas.current && greys) draw(canvas.current, greys, threshold_grey);
  }, [greys, threshold_grey]);
  if (!greys) return <p class="soft">The histogram needs images of this camera.</p>;
  const above = threshold_grey === undefined ? null : greys.slice(Math.ceil(threshold_grey / 4)).reduce((sum, share) => sum + share, 0);
  return (
    <figure>
      <canvas ref={canvas} class="grey" role="img" aria-label={above === null ? "Histogram of grey values" : `Histogram of grey values; ${(100 * above).toFixed(2)} % of the pixels are above the threshold ${threshold_grey!.toFixed(0)}`} />
      <figcaption class="faint">Grey 0 to 255, logarithmic. Line: threshold of the detection.</figcaption>
    </figure>
  );
}
