// What the picture shows, in words, for those who cannot see it.

import type { Description } from "../../gen/mocap/v1/description_pb";
import { MarkerState, type Snapshot, SubjectPhase, type SubjectState } from "../../gen/mocap/v1/snapshot_pb";

const phases: Record<SubjectPhase, string> = {
  [SubjectPhase.UNSPECIFIED]: "searching", [SubjectPhase.SEARCHING]: "searching", [SubjectPhase.TRACKING]: "tracking", [SubjectPhase.LOST]: "lost",
};

export const phaseText = (phase: SubjectPhase | undefined): string => (phase === undefined ? "searching" : (phases[phase] ?? "searching"));

export function measuredMarkers(state: SubjectState | undefined): number {
  return state?.markers?.states.filter((marker) => marker === MarkerState.MEASURED).length ?? 0;
}

export function sceneSummary(description: Description | null, snapshot: Snapshot | null): string {
  if (!description || !snapshot) return "No data yet.";
  const states = snapshot.descriptionVersion === description.version ? snapshot.subjects : [];
  const subjects = description.subjects.map((subject, index) => {
    const state = states.find((candidate) => candidate.subject === index);
    const root = state?.bones?.worldPositionsM;
    const place = root && root.length >= 3 ? `, at ${root[0].toFixed(1)} m forward, ${root[1].toFixed(1)} m left` : "";
    return `${subject.name}: ${phaseText(state?.phase)}, ${measuredMarkers(state)} of ${subject.markers.length} markers measured${place}`;
  });
  const views = snapshot.views ? `${snapshot.views.cameras.length} of ${snapshot.expectedViews} cameras in this set. ` : "";
  const unlabelled = (snapshot.unlabelled?.positionsM.length ?? 0) / 3;
  return `${views}${subjects.join(". ")}. ${unlabelled} markers without a label.`;
}
