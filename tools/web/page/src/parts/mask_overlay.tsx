// Masks over the picture of a camera, and the pointer that draws new ones. Its coordinates are pixels of the camera's image.

import type { JSX, TargetedPointerEvent } from "preact";
import { useLayoutEffect, useState } from "preact/hooks";
import { type Corner, type Polygon, rectangleBetween, svgPoints } from "../model/masks";

export type MaskTool = "rectangle" | "polygon";

// A click so near the first corner closes the polygon.
const kClose_px = 12;

interface Shown {
  width_px: number;
  height_px: number;
  drawn: Polygon[];
  learnt: Polygon[];
  /** Index in `drawn`; null: none. */
  marked: number | null;
  /** Null: nothing is drawn now. */
  tool: MaskTool | null;
  add(polygon: Polygon): void;
}

/** In pixels of the image, and how many of them one pixel of the screen is. */
function cornerAt(svg: SVGSVGElement, event: PointerEvent): { at: Corner; perScreen: number } | null {
  const matrix = svg.getScreenCTM();
  if (!matrix) return null;
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
  return { at: [Math.round(2 * point.x) / 2, Math.round(2 * point.y) / 2], perScreen: 1 / matrix.a };
}

export function MaskOverlay({ width_px, height_px, drawn, learnt, marked, tool, add }: Shown): JSX.Element {
  const [corners, setCorners] = useState<Polygon>([]);
  const [pointer, setPointer] = useState<Corner | null>(null);
  const stop = () => setCorners([]);
  const close = () => {
    if (corners.length >= 3) add(corners);
    stop();
  };
  // Effects after the next picture would end a mask that was begun before it.
  useLayoutEffect(stop, [tool]);
  // Only while a mask is begun: otherwise these keys belong to the button or the dialog that has the focus.
  useLayoutEffect(() => {
    if (corners.length === 0) return undefined;
    const press = (event: KeyboardEvent) => {
      if (event.key === "Escape") stop();
      else if (event.key === "Enter" && tool === "polygon") close();
      else return;
      event.preventDefault();
    };
    window.addEventListener("keydown", press);
    return () => window.removeEventListener("keydown", press);
  }, [tool, corners]);
  const down = (event: TargetedPointerEvent<SVGSVGElement>) => {
    const found = tool && cornerAt(event.currentTarget, event);
    if (!found) return;
    event.currentTarget.setPointerCapture(event.pointerId);
    setPointer(found.at);
    if (tool === "rectangle") setCorners([found.at]);
  };
  const up = (event: TargetedPointerEvent<SVGSVGElement>) => {
    const found = tool && cornerAt(event.currentTarget, event);
    if (!found) return;
    if (tool === "rectangle") {
      const made = corners.length > 0 && rectangleBetween(corners[0], found.at, width_px, height_px);
      if (made) add(made);
      stop();
      return;
    }
    const [first] = corners;
    const closes = first && corners.length >= 3 && Math.hypot(first[0] - found.at[0], first[1] - found.at[1]) < kClose_px * found.perScreen;
    if (closes) close();
    else setCorners([...corners, found.at]);
  };
  const move = (event: TargetedPointerEvent<SVGSVGElement>) => {
    const found = tool && corners.length > 0 && cornerAt(event.currentTarget, event);
    if (found) setPointer(found.at);
  };
  const draft = pointer && corners.length > 0 ? (tool === "rectangle" ? rectangleBetween(corners[0], pointer, width_px, height_px) : [...corners, pointer]) : null;
  return (
    <svg class={`masks ${tool ? "drawing" : ""}`} viewBox={`-0.5 -0.5 ${width_px} ${height_px}`} preserveAspectRatio="xMidYMid meet" role="img"
      aria-label={`${drawn.length} drawn and ${learnt.length} learnt masks`} onPointerDown={down} onPointerMove={move} onPointerUp={up} onPointerCancel={stop}>
      {learnt.map((polygon, i) => <polygon key={`learnt-${i}`} class="learnt" points={svgPoints(polygon)} />)}
      {drawn.map((polygon, i) => <polygon key={`drawn-${i}`} class={i === marked ? "drawn marked" : "drawn"} points={svgPoints(polygon)} />)}
      {draft && <polygon class="draft" points={svgPoints(draft)} />}
      {tool === "polygon" && corners.length > 0 && <circle class="draft" cx={corners[0][0]} cy={corners[0][1]} r={width_px / 160} />}
    </svg>
  );
}
