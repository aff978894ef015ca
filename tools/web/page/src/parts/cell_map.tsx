// The cells of a camera's image, filled by the number of markers that were seen in them.

import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { clearedContext } from "../view/canvas_size";
import { readPalette } from "../view/palette";

// So many markers in one cell are as good as more.
const kFull = 60;

function drawCells(canvas: HTMLCanvasElement, cells: ArrayLike<number>, columns: number): void {
  const cleared = clearedContext(canvas);
  if (!cleared) return;
  const { context, width, height } = cleared;
  const palette = readPalette();
  const rows = cells.length / columns;
  Array.from(cells).forEach((count, i) => {
    const [column, row] = [i % columns, Math.floor(i / columns)];
    context.globalAlpha = count === 0 ? 0.12 : 0.35 + 0.65 * Math.min(1, count / kFull);
    context.fillStyle = count === 0 ? palette.bad : palette.used;
    const inset = count === 0 ? 0.35 : 0.04;
    context.fillRect(((column + inset) * width) / columns, ((row + inset) * height) / rows, ((1 - 2 * inset) * width) / columns, ((1 - 2 * inset) * height) / rows);
  });
}

/** `cells` row by row; `redraw` changes when they do. */
export function CellMap({ cells, columns, redraw, label, caption }: { cells: ArrayLike<number>; columns: number; redraw: unknown; label: string; caption: string }): JSX.Element {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    if (canvas.current) drawCells(canvas.current, cells, columns);
  }, [redraw]);
  return (
    <figure>
      <canvas ref={canvas} role="img" aria-label={label} />
      <figcaption>{caption}</figcaption>
    </figure>
  );
}
