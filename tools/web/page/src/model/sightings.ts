// Which cameras saw each marker, and how well its position is known: the topic "sightings" as things to draw.

import type { Sightings } from "../../gen/mocap/v1/sightings_pb";
import type { Vec3 } from "./camera_view";
import { fixed } from "./format";

/** Half axes of a drawn ellipsoid, in standard deviations of the position. */
export const kSigmas = 3;
/** Enlargement of the ellipsoid of a measured position: its true size, about 0.1 mm with four simulated cameras, is smaller than the mark of
 * the marker. The ellipsoid of a filled position is drawn in its true size. */
export const kEnlarged = 100;

/** The columns of a lower triangular matrix L with L L^T = covariance: they span the ellipsoid of one standard deviation. */
export type Spread = [Vec3, Vec3, Vec3];

export interface Sighting {
  at_m: Vec3;
  /** Index in the description; -1: no label. */
  subject: number;
  /** Index in the subject's markers, or the id of the 3D track. */
  index: number;
  filled: boolean;
  /** Indices of the cameras that saw the marker. */
  cameras: number[];
  /** Standard deviations in m; null: unknown. */
  spread_m: Spread | null;
}

/** Cholesky factorisation of xx xy xz yy yz zz; null if the matrix is not positive definite. */
export function spreadOf([xx, xy, xz, yy, yz, zz]: number[]): Spread | null {
  const a = Math.sqrt(xx);
  const b = xy / a;
  const c = xz / a;
  const d = Math.sqrt(yy - b * b);
  const e = (yz - b * c) / d;
  const f = Math.sqrt(zz - c * c - e * e);
  return [a, b, c, d, e, f].every(Number.isFinite) && [a, d, f].every((value) => value > 0) ? [[a, b, c], [0, d, e], [0, 0, f]] : null;
}

/** How much larger than one standard deviation the ellipsoid is drawn. */
export const enlargement = (sighting: Sighting): number => kSigmas * (sighting.filled ? 1 : kEnlarged);

function camerasIn(bits: bigint, cameras: number): number[] {
  const found: number[] = [];
  for (let i = 0; i < cameras; i++) if ((bits >> BigInt(i)) & 1n) found.push(i);
  return found;
}

/** Empty if the columns do not fit each other. `cameras`: number of cameras of the description. */
export function readSightings(from: Sightings, cameras: number): Sighting[] {
  const count = from.markers.length;
  const columns = [from.subjectsPlusOne.length, from.filled.length, from.seenBy.length, from.positionsM.length / 3, from.covariancesM2.length / 6];
  if (columns.some((length) => length !== count)) return [];
  return from.markers.map((marker, i) => {
    const subject = from.subjectsPlusOne[i] - 1;
    const [x, y, z] = from.positionsM.slice(3 * i, 3 * i + 3);
    return {
      at_m: [x, y, z], subject, index: subject < 0 ? marker - 1 : marker, filled: from.filled[i], cameras: camerasIn(from.seenBy[i], cameras),
      spread_m: spreadOf(from.covariancesM2.slice(6 * i, 6 * i + 6)),
    };
  });
}

/** The sightings of the selected marker; all if it is none of them. */
export function ofSelected(sightings: Sighting[], selected: { subject: number; marker: number } | null): Sighting[] {
  const chosen = selected && sightings.find(({ subject, index }) => subject === selected.subject && index === selected.marker);
  return chosen ? [chosen] : sightings;
}

/** The ellipse of one standard deviation in x and y on a map with x up and y left: half axes, and the angle of the long one from the right to below. */
export function ellipseFromAbove(spread: Spread): { long: number; short: number; turn_rad: number } {
  const covariance = (i: number, k: number) => spread.reduce((sum, column) => sum + column[i] * column[k], 0);
  const [xx, xy, yy] = [covariance(0, 0), covariance(0, 1), covariance(1, 1)];
  const middle = (xx + yy) / 2;
  const away = Math.hypot((xx - yy) / 2, xy);
  // To the right is -y, to below is -x: both signs change, so their product keeps its sign.
  return { long: Math.sqrt(middle + away), short: Math.sqrt(Math.max(0, middle - away)), turn_rad: Math.atan2(2 * xy, yy - xx) / 2 };
}

/** Largest standard deviation along an axis of the world, m. */
const sigmaOf = (spread: Spread): number => Math.max(...[0, 1, 2].map((axis) => Math.hypot(...spread.map((column) => column[axis]))));

export function sightingSummary(sightings: Sighting[]): string {
  const seen = sightings.filter(({ cameras }) => cameras.length > 0);
  const rays = seen.reduce((sum, { cameras }) => sum + cameras.length, 0);
  const sigmas = sightings.flatMap(({ filled, spread_m }) => (filled || !spread_m ? [] : [1000 * sigmaOf(spread_m)])).sort((a, b) => a - b);
  const known = sigmas.length > 0 ? ` Standard deviation of a measured position: ${fixed(sigmas[sigmas.length >> 1], 2, "mm")} in the median, ${fixed(sigmas[sigmas.length - 1], 2, "mm")} at most.` : "";
  return `${rays} rays to ${seen.length} markers.${known}`;
}
