// Masks of a camera as polygons in pixels of its image; the centre of the top-left pixel is 0, 0.

import type { CameraMasks, MaskPolygon } from "../../gen/mocap/v1/control_pb";

export type Corner = [number, number];
export type Polygon = Corner[];

export interface Masks {
  drawn: Polygon[];
  learnt: Polygon[];
  undoSteps: number;
}

const kLeastCorners = 3;

/** A polygon whose columns do not fit each other is left out. */
const readPolygons = (polygons: MaskPolygon[]): Polygon[] =>
  polygons.filter(({ xPx, yPx }) => xPx.length === yPx.length && xPx.length >= kLeastCorners).map(({ xPx, yPx }) => xPx.map((x, i) => [x, yPx[i]]));

export const readMasks = (from: CameraMasks): Masks => ({ drawn: readPolygons(from.drawn), learnt: readPolygons(from.learnt), undoSteps: from.undoSteps });

/** As the request wants them. */
export const writePolygons = (polygons: Polygon[]): { xPx: number[]; yPx: number[] }[] =>
  polygons.map((polygon) => ({ xPx: polygon.map(([x]) => x), yPx: polygon.map(([, y]) => y) }));

export const samePolygons = (one: Polygon[], other: Polygon[]): boolean => JSON.stringify(one) === JSON.stringify(other);

/** The rectangle of `width` x `height` pixels from column `x` and row `y` on. The borders of pixels are at halves. */
export function rectangle(x: number, y: number, width: number, height: number): Polygon {
  const [left, top] = [x - 0.5, y - 0.5];
  return [[left, top], [left + width, top], [left + width, top + height], [left, top + height]];
}

/** The pixels of the image between two corners; null: none. */
export function rectangleBetween(from: Corner, to: Corner, width_px: number, height_px: number): Polygon | null {
  const span = (a: number, b: number, size: number): [number, number] => [Math.max(0, Math.round(Math.min(a, b))), Math.min(size - 1, Math.round(Math.max(a, b)))];
  const [left, right] = span(from[0], to[0], width_px);
  const [top, bottom] = span(from[1], to[1], height_px);
  return right > left && bottom > top ? rectangle(left, top, right - left + 1, bottom - top + 1) : null;
}

/** A rectangle as x, y, width and height in pixels; null: the polygon is none. */
function asRectangle(polygon: Polygon): [number, number, number, number] | null {
  const [[left, top]] = polygon;
  const [right, bottom] = polygon[2] ?? [NaN, NaN];
  const corners: Polygon = [[left, top], [right, top], [right, bottom], [left, bottom]];
  return samePolygons([corners], [polygon]) ? [left + 0.5, top + 0.5, right - left, bottom - top] : null;
}

export function describePolygon(polygon: Polygon): string {
  const box = asRectangle(polygon);
  if (box) return `rectangle at ${box[0]}, ${box[1]}: ${box[2]} × ${box[3]} px`;
  const mean = (axis: 0 | 1) => Math.round(polygon.reduce((sum, corner) => sum + corner[axis], 0) / polygon.length);
  return `polygon of ${polygon.length} corners around ${mean(0)}, ${mean(1)}`;
}

/** What SVG wants as points. */
export const svgPoints = (polygon: Polygon): string => polygon.map(([x, y]) => `${x},${y}`).join(" ");
