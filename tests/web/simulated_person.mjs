// A person who walks in a circle, and the cameras around: what a daemon would publish at a time. The same time gives the same numbers.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { project } from "./modules.mjs";

const kWalk_hz = 0.9;
const kRadius_m = 1.1;
const kTurn_rad_s = 0.35;

const numbers = (text) => text.split(",").map(Number);

/** Bones of a shipped skeleton: {name, parent (index or -1), offset}. */
export function readSkeleton(name) {
  const text = readFileSync(join(project, "config", "skeletons", `${name}.toml`), "utf8");
  const bones = text.split("[[bone]]").slice(1).map((part) => ({
    name: /^name = "(.+)"/m.exec(part)[1],
    parentName: /^parent = "(.+)"/m.exec(part)?.[1],
    offset: numbers(/^rest_offset_m = \[(.+)\]/m.exec(part)?.[1] ?? "0,0,0"),
  }));
  return bones.map((bone) => ({ ...bone, parent: bones.findIndex((other) => other.name === bone.parentName) }));
}

/** Markers of a shipped marker set: {name, bone (index), offset}. */
export function readMarkers(name, bones) {
  const text = readFileSync(join(project, "config", "markersets", `${name}.toml`), "utf8");
  return [...text.matchAll(/\{ name = "(.+?)", bone = "(.+?)", offset_m = \[(.+?)\]/g)].map((found) => ({
    name: found[1], bone: bones.findIndex((bone) => bone.name === found[2]), offset: numbers(found[3]),
  }));
}

const product = ([ax, ay, az, aw], [bx, by, bz, bw]) => [
  aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz,
];
const about = (axis, rad) => [0, 1, 2].map((i) => (i === axis ? Math.sin(rad / 2) : 0)).concat(Math.cos(rad / 2));
export function rotated([x, y, z, w], [a, b, c]) {
  const t = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * t[0] + y * t[2] - z * t[1], b + w * t[1] + z * t[0] - x * t[2], c + w * t[2] + x * t[1] - y * t[0]];
}
const sum = (a, b) => a.map((value, i) => value + b[i]);

/** The rotation of a bone against its parent at a phase of the step. */
function turnOf(bone, phase) {
  const swing = Math.sin(phase);
  if (bone === "LeftUpLeg") return about(1, -0.45 * swing);
  if (bone === "RightUpLeg") return about(1, 0.45 * swing);
  if (bone === "LeftLowLeg") return about(1, 0.35 + 0.35 * Math.sin(phase - 1.6));
  if (bone === "RightLowLeg") return about(1, 0.35 - 0.35 * Math.sin(phase - 1.6));
  if (bone === "LeftUpArm") return product(about(1, 0.5 * swing), about(0, -1.25));
  if (bone === "RightUpArm") return product(about(1, -0.5 * swing), about(0, 1.25));
  if (bone === "LeftLowArm") return about(2, -0.5);
  if (bone === "RightLowArm") return about(2, 0.5);
  if (bone === "Chest") return about(2, 0.12 * swing);
  return [0, 0, 0, 1];
}

/** World positions and rotations of the bones at `t` seconds. `centre`: of the circle. */
export function poseAt(bones, t, centre = [0, 0], ahead_rad = 0) {
  const heading = kTurn_rad_s * t + ahead_rad;
  const phase = 2 * Math.PI * kWalk_hz * t;
  const root = [centre[0] + kRadius_m * Math.cos(heading), centre[1] + kRadius_m * Math.sin(heading), 0.93 + 0.02 * Math.cos(2 * phase)];
  const places = [];
  const turns = [];
  bones.forEach((bone, i) => {
    const turn = turnOf(bone.name, phase);
    turns[i] = bone.parent < 0 ? about(2, heading + Math.PI / 2) : product(turns[bone.parent], turn);
    places[i] = bone.parent < 0 ? root : sum(places[bone.parent], rotated(turns[bone.parent], bone.offset));
  });
  return { places, turns };
}

/** Row-major rotation matrix to a quaternion x y z w. */
function quaternionOf(m) {
  const w = Math.sqrt(Math.max(0, 1 + m[0] + m[4] + m[8])) / 2;
  const x = Math.sqrt(Math.max(0, 1 + m[0] - m[4] - m[8])) / 2;
  const y = Math.sqrt(Math.max(0, 1 - m[0] + m[4] - m[8])) / 2;
  const z = Math.sqrt(Math.max(0, 1 - m[0] - m[4] + m[8])) / 2;
  return { x: Math.sign(m[7] - m[5]) * x, y: Math.sign(m[2] - m[6]) * y, z: Math.sign(m[3] - m[1]) * z, w };
}

/** A camera on a ring that looks at the middle of the volume. */
export function cameraOnRing(i, count) {
  const angle = (2 * Math.PI * (i + 0.5)) / count;
  const eye = [4.5 * Math.cos(angle), 4.5 * Math.sin(angle), 2.4];
  const unit = (v) => v.map((value) => value / Math.hypot(...v));
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const forward = unit([-eye[0], -eye[1], 0.9 - eye[2]]);
  const right = unit(cross(forward, [0, 0, 1]));
  const down = cross(forward, right);
  const rows = [right, down, forward];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const [x, y, z] = rows.map((row) => -dot(row, eye));
  return {
    name: `cam${i + 1}`, widthPx: 1280, heightPx: 1024, lensKind: 1, fxPx: 900, fyPx: 900, cxPx: 639.5, cyPx: 511.5, distortion: [0, 0, 0, 0, 0],
    cameraFromWorldRotation: quaternionOf(rows.flat()), cameraFromWorldTranslationM: { x, y, z },
  };
}

/** Pixels of a point of the world, for a camera without distortion. */
export function projected(camera, point) {
  const { x, y, z, w } = camera.cameraFromWorldRotation;
  const t = camera.cameraFromWorldTranslationM;
  const [a, b, c] = sum(rotated([x, y, z, w], point), [t.x, t.y, t.z]);
  return [camera.cxPx + (camera.fxPx * a) / c, camera.cyPx + (camera.fyPx * b) / c];
}
