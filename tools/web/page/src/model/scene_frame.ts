// One snapshot as things to draw: markers with their state, bones as segments, and the root of each subject.

import type { Description, Subject } from "../../gen/mocap/v1/description_pb";
import type { Health } from "../../gen/mocap/v1/health_pb";
import { BoneState, MarkerState, type Snapshot, type SubjectState } from "../../gen/mocap/v1/snapshot_pb";
import { type Vec3, rotate, rotationOf } from "./camera_view";

export type DrawnState = "measured" | "filled" | "unlabelled" | "missing";

export interface DrawnMarker {
  at_m: Vec3;
  state: DrawnState;
  /** Index in the description; -1: no label. */
  subject: number;
  /** Index in the subject's markers, or the id of the 3D track. */
  index: number;
}

export interface DrawnBone {
  subject: number;
  from_m: Vec3;
  to_m: Vec3;
  /** The body model predicts the pose; no marker of this bone was measured. */
  filled: boolean;
}

export interface SceneFrame {
  markers: DrawnMarker[];
  bones: DrawnBone[];
  /** By index in the description; null: not tracked. */
  roots_m: (Vec3 | null)[];
}

const pointAt = (columns: number[], i: number): Vec3 => [columns[3 * i], columns[3 * i + 1], columns[3 * i + 2]];

/** Mean of the markers of a bone without children, in the bone's frame: where a hand, a foot or the head ends. */
function tipOf(subject: Subject, bone: number): Vec3 | null {
  const sum: Vec3 = [0, 0, 0];
  let count = 0;
  for (const marker of subject.markers) {
    if (marker.bone !== bone || !marker.offsetM) continue;
    sum[0] += marker.offsetM.x;
    sum[1] += marker.offsetM.y;
    sum[2] += marker.offsetM.z;
    count++;
  }
  if (count === 0) return null;
  const tip: Vec3 = [sum[0] / count, sum[1] / count, sum[2] / count];
  return Math.hypot(...tip) > 0.02 ? tip : null;
}

function addMarkers(frame: SceneFrame, subject: Subject, state: SubjectState): void {
  const columns = state.markers;
  if (!columns || columns.states.length !== subject.markers.length || columns.positionsM.length < 3 * columns.states.length) return;
  columns.states.forEach((marker, index) => {
    if (marker !== MarkerState.MEASURED && marker !== MarkerState.FILLED) return;
    const drawn = marker === MarkerState.MEASURED ? "measured" : "filled";
    frame.markers.push({ at_m: pointAt(columns.positionsM, index), state: drawn, subject: state.subject, index });
  });
}

function addBones(frame: SceneFrame, subject: Subject, state: SubjectState): void {
  const columns = state.bones;
  const count = subject.bones.length;
  if (!columns || columns.states.length !== count || columns.worldPositionsM.length < 3 * count || columns.worldRotationsXyzw.length < 4 * count) return;
  const lost = (bone: number) => columns.states[bone] !== BoneState.MEASURED && columns.states[bone] !== BoneState.FILLED;
  const hasChild = new Set(subject.bones.map((bone) => bone.parent));
  subject.bones.forEach((bone, index) => {
    if (lost(index)) return;
    const at_m = pointAt(columns.worldPositionsM, index);
    if (bone.parent === undefined) frame.roots_m[state.subject] = at_m;
    else if (bone.parent < count && !lost(bone.parent)) {
      const filled = columns.states[bone.parent] === BoneState.FILLED;
      frame.bones.push({ subject: state.subject, from_m: pointAt(columns.worldPositionsM, bone.parent), to_m: at_m, filled });
    }
    const tip = hasChild.has(index) ? null : tipOf(subject, index);
    if (!tip) return;
    const q = columns.worldRotationsXyzw.slice(4 * index, 4 * index + 4);
    const [x, y, z] = rotate(rotationOf(q[0], q[1], q[2], q[3]), tip);
    const filled = columns.states[index] === BoneState.FILLED;
    frame.bones.push({ subject: state.subject, from_m: at_m, to_m: [at_m[0] + x, at_m[1] + y, at_m[2] + z], filled });
  });
}

function addUnlabelled(frame: SceneFrame, snapshot: Snapshot): void {
  const columns = snapshot.unlabelled;
  if (!columns) return;
  for (let i = 0; 3 * i + 2 < columns.positionsM.length; i++) {
    frame.markers.push({ at_m: pointAt(columns.positionsM, i), state: "unlabelled", subject: -1, index: (columns.trackIdsPlusOne[i] ?? 0) - 1 });
  }
}

function addMissing(frame: SceneFrame, health: Health): void {
  for (const search of health.searches) {
    search.missingMarkers.forEach((index, i) => {
      if (3 * i + 2 >= search.missingPositionsM.length) return;
      frame.markers.push({ at_m: pointAt(search.missingPositionsM, i), state: "missing", subject: search.subject, index });
    });
  }
}

/**
 * With a snapshot of another version of the description, whose indices mean other subjects and markers, only the unlabelled markers
 * are left: the description of this version is about to arrive. So is a subject whose columns do not fit the description left out.
 */
export function sceneFrame(description: Description, snapshot: Snapshot, health: Health | null): SceneFrame {
  const frame: SceneFrame = { markers: [], bones: [], roots_m: description.subjects.map(() => null) };
  const fits = snapshot.descriptionVersion === description.version;
  for (const state of fits ? snapshot.subjects : []) {
    const subject = description.subjects[state.subject];
    if (!subject) continue;
    addMarkers(frame, subject, state);
    addBones(frame, subject, state);
  }
  addUnlabelled(frame, snapshot);
  if (health && fits) addMissing(frame, health);
  return frame;
}
