// Marks of markers and blobs on 2D canvases: each state has a shape as well as a colour.

import type { BlobUse } from "../model/blob_use";
import type { DrawnState } from "../model/scene_frame";
import { type Palette, subjectColour } from "./palette";

type Context = CanvasRenderingContext2D;
type Place = readonly [number, number];

function disc(context: Context, [u, v]: Place, radius: number): void {
  context.beginPath();
  context.arc(u, v, radius, 0, 2 * Math.PI);
}

function polygon(context: Context, corners: Place[]): void {
  context.beginPath();
  corners.forEach(([u, v], i) => (i === 0 ? context.moveTo(u, v) : context.lineTo(u, v)));
  context.closePath();
}

function cross(context: Context, [u, v]: Place, r: number): void {
  context.beginPath();
  context.moveTo(u - r, v - r);
  context.lineTo(u + r, v + r);
  context.moveTo(u + r, v - r);
  context.lineTo(u - r, v + r);
  context.stroke();
}

/** Disc: measured; diamond outline: filled in; square: no label; ring: expected here but not seen. */
export function drawMark(context: Context, at: Place, state: DrawnState, radius: number, palette: Palette, subject: number): void {
  const [u, v] = at;
  context.lineWidth = 1.5;
  context.fillStyle = context.strokeStyle = state === "unlabelled" ? palette.unlabelled : state === "missing" ? palette.missing : subjectColour(palette, subject);
  if (state === "measured") {
    disc(context, at, radius);
    context.fill();
  } else if (state === "filled") {
    const r = radius * 1.3;
    polygon(context, [[u, v - r], [u + r, v], [u, v + r], [u - r, v]]);
    context.stroke();
  } else if (state === "unlabelled") {
    context.fillRect(u - radius * 0.8, v - radius * 0.8, 1.6 * radius, 1.6 * radius);
  } else {
    disc(context, at, radius * 1.6);
    context.stroke();
  }
}

/** Ring: view of a 3D marker; cross: used for nothing; triangle: the camera is not calibrated; dot: unknown. */
export function drawBlob(context: Context, at: Place, use: BlobUse, radius: number, palette: Palette): void {
  const [u, v] = at;
  context.lineWidth = 2;
  context.strokeStyle = context.fillStyle = use === "unknown" ? palette.unlabelled : palette[use];
  if (use === "used") {
    disc(context, at, radius);
    context.stroke();
  } else if (use === "unused") {
    cross(context, at, 0.8 * radius);
  } else if (use === "uncalibrated") {
    polygon(context, [[u, v - radius], [u + radius, v + 0.8 * radius], [u - radius, v + 0.8 * radius]]);
    context.stroke();
  } else {
    disc(context, at, 2);
    context.fill();
  }
}

/** Samples for the legend: a ray, and the ellipse of a covariance. */
export function drawRay(context: Context, palette: Palette): void {
  context.strokeStyle = subjectColour(palette, 0);
  context.beginPath();
  context.moveTo(1, 14);
  context.lineTo(15, 2);
  context.stroke();
}

export function drawSpread(context: Context, palette: Palette): void {
  context.fillStyle = subjectColour(palette, 0);
  context.globalAlpha = 0.5;
  context.beginPath();
  context.ellipse(8, 8, 7, 4, -0.5, 0, 2 * Math.PI);
  context.fill();
  context.globalAlpha = 1;
}
