import type { JSX } from "preact";
import type { Subject } from "../../gen/mocap/v1/description_pb";
import { SubjectPhase, type SubjectState } from "../../gen/mocap/v1/snapshot_pb";
import { fixed } from "../model/format";
import type { Level } from "../model/health_report";
import { measuredMarkers, phaseText } from "../model/summary";
import { description, health, snapshot } from "../state/live";
import { addressOf } from "../state/route";
import { LevelPill } from "./level_mark";
import { Meter } from "./small";

const kFewMarkers = 0.7;

export const subjectLevel = (phase: SubjectPhase | undefined): Level => (phase === SubjectPhase.TRACKING ? "good" : phase === SubjectPhase.LOST ? "bad" : "look");

/** Undefined with a snapshot of another version of the description, too: its indices mean other subjects. */
export function stateOf(index: number): SubjectState | undefined {
  if (snapshot.value?.descriptionVersion !== description.value?.version) return undefined;
  return snapshot.value?.subjects.find((state) => state.subject === index);
}

export const searchOf = (index: number) => health.value?.searches.find((search) => search.subject === index);

/** A square in the subject's colour of the 3D view. */
export function Swatch({ index }: { index: number }): JSX.Element {
  return (
    <svg class="swatch" viewBox="0 0 12 12" aria-hidden="true">
      <rect width="12" height="12" rx="3" fill={`var(--subject-${(index % 6) + 1})`} />
    </svg>
  );
}

export function SubjectCard({ subject, index }: { subject: Subject; index: number }): JSX.Element {
  const state = stateOf(index);
  const measured = measuredMarkers(state);
  const expected = subject.markers.length;
  const search = searchOf(index);
  return (
    <article class="subject-card" aria-label={`Subject ${subject.name}`}>
      <header>
        <Swatch index={index} />
        <h3><a href={addressOf("subjects", subject.name)}>{subject.name}</a></h3>
        <LevelPill level={subjectLevel(state?.phase)} text={phaseText(state?.phase)} />
      </header>
      <Meter share={expected > 0 ? measured / expected : 0} low={kFewMarkers} label={`${measured} of ${expected} markers measured`} />
      <dl class="facts-small">
        <dt>Markers measured</dt><dd>{measured} / {expected}</dd>
        <dt>Residual</dt><dd>{fixed(state?.residualM === undefined ? null : 1000 * state.residualM, 1, "mm")}</dd>
      </dl>
      {search && <p class="soft">{search.sentence}</p>}
    </article>
  );
}
