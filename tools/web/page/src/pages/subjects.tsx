import type { JSX } from "preact";
import { useState } from "preact/hooks";
import type { Subject } from "../../gen/mocap/v1/description_pb";
import { type LabelledMarkers, MarkerState } from "../../gen/mocap/v1/snapshot_pb";
import { age, fixed, kUnknown } from "../model/format";
import { phaseText } from "../model/summary";
import { LevelMark, LevelPill } from "../parts/level_mark";
import { C3dImport } from "../parts/c3d_import";
import { OrderButton, OutcomeLine, Panel } from "../parts/small";
import { SubjectCard, Swatch, searchOf, stateOf, subjectLevel } from "../parts/subject_card";
import { description, markers, mayChange, now_ms } from "../state/live";
import { type Outcome, order, subjectOrder } from "../state/orders";
import { addressOf, route } from "../state/route";
import { selected } from "../state/stage_options";

function stateText(state: MarkerState | undefined): { text: string; level: "good" | "look" | "bad" } {
  if (state === MarkerState.MEASURED) return { text: "measured", level: "good" };
  return state === MarkerState.FILLED ? { text: "filled in", level: "look" } : { text: "not seen", level: "bad" };
}

function MarkerRow({ subject, index, row, columns }: { subject: Subject; index: number; row: number; columns: LabelledMarkers | undefined }): JSX.Element {
  const watched = markers.of(index, row);
  const state = stateText(columns?.states[row]);
  const measured = columns?.states[row] === MarkerState.MEASURED;
  const chosen = selected.value?.subject === index && selected.value.marker === row;
  return (
    <tr data-selected={chosen}>
      <th scope="row">
        <button class="link" type="button" aria-pressed={chosen} onClick={() => (selected.value = chosen ? null : { subject: index, marker: row })}>{subject.markers[row].name}</button>
      </th>
      <td><LevelMark level={state.level} /> {state.text}</td>
      <td class="number">{measured ? fixed((columns?.residualsMillipx[row] ?? 0) / 1000, 2, "px") : kUnknown}</td>
      <td class="number">{measured ? columns?.cameras[row] : kUnknown}</td>
      <td class="number">{measured || columns?.states[row] === MarkerState.FILLED ? `${columns?.confidencesPercent[row] ?? 0}\u2009%` : kUnknown}</td>
      <td class="number">{watched?.seenAt_ms == null ? kUnknown : measured ? "now" : age((now_ms.value - watched.seenAt_ms) / 1000)}</td>
      <td class="number">{watched ? watched.labelChanges : kUnknown}</td>
    </tr>
  );
}

function Markers({ subject, index }: { subject: Subject; index: number }): JSX.Element {
  const columns = stateOf(index)?.markers;
  return (
    <div class="table-box" tabIndex={0} role="region" aria-label={`Markers of ${subject.name}`}>
      <table>
        <caption>Label: probability that it is right. Seen: when it was last measured. Changes of the label are counted since this page was opened. A name selects the marker on the stage.</caption>
        <thead>
          <tr>
            <th>Marker</th><th>State</th><th class="number">Residual</th><th class="number">Cameras</th><th class="number">Label</th>
            <th class="number">Seen</th><th class="number">Changes</th>
          </tr>
        </thead>
        <tbody>{subject.markers.map((marker, row) => <MarkerRow key={marker.name} subject={subject} index={index} row={row} columns={columns} />)}</tbody>
      </table>
    </div>
  );
}

function Lengths({ subject }: { subject: Subject }): JSX.Element {
  const bones = subject.bones.filter((bone) => bone.parent !== undefined && bone.restOffsetM);
  const length_mm = (bone: (typeof bones)[number]) => 1000 * Math.hypot(bone.restOffsetM!.x, bone.restOffsetM!.y, bone.restOffsetM!.z);
  return (
    <details class="details">
      <summary>Lengths of the fitted body</summary>
      <dl class="facts-small">
        {bones.map((bone) => [
          <dt key={bone.name}>{subject.bones[bone.parent!].name} to {bone.name}</dt>,
          <dd key={`${bone.name}-length`}>{fixed(length_mm(bone), 0, "mm")}</dd>,
        ])}
      </dl>
    </details>
  );
}

function One({ subject, index }: { subject: Subject; index: number }): JSX.Element {
  const state = stateOf(index);
  const search = searchOf(index);
  const ask = (what: string, action: string) => subjectOrder(what, subject.name, action);
  const forget = () =>
    window.confirm(`Forget the fitted body of ${subject.name}? The next T-pose or A-pose measures it again.`) ? ask("forget fit", "ACTION_RESET") : Promise.resolve();
  return (
    <Panel title={subject.name} tools={<LevelPill level={subjectLevel(state?.phase)} text={phaseText(state?.phase)} />}>
      <div class="stack">
        <p class="soft"><Swatch index={index} /> Marker set {subject.markerSet || kUnknown}, skeleton {subject.skeleton || kUnknown}, residual {fixed(state?.residualM === undefined ? null : 1000 * state.residualM, 1, "mm")}.</p>
        {search && <p class="answer look"><span>{search.sentence}</span></p>}
        <div class="row">
          <OrderButton text="Search now" disabled={!mayChange.value} run={() => ask("search now", "ACTION_ADD")} />
          <OrderButton text="Away" disabled={!mayChange.value} run={() => ask("away", "ACTION_REMOVE")} />
          <OrderButton text="Forget fit" disabled={!mayChange.value} run={forget} />
        </div>
        <Markers subject={subject} index={index} />
        <Lengths subject={subject} />
      </div>
    </Panel>
  );
}

const kShippedFolder = "/usr/share/mocapd/markersets";
const kShipped = ["openmocap18", "baseline41", "baseline51", "pluginGait39", "rigid3", "rigid4", "rigid5"];

function Add(): JSX.Element {
  const [name, setName] = useState("");
  const [set, setSet] = useState(`${kShippedFolder}/openmocap18.toml`);
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  const add = async () => setOutcome(await order("subject", { action: "ACTION_ADD", name: name.trim(), markerSet: set.trim() }));
  return (
    <Panel title="Add a subject">
      <form class="stack" onSubmit={(event) => { event.preventDefault(); void add(); }}>
        <label class="field"><span>Name</span><input required maxLength={64} value={name} onInput={(event) => setName(event.currentTarget.value)} /></label>
        <label class="field">
          <span>Marker set: absolute path on the daemon's machine</span>
          <input required list="marker-sets" value={set} onInput={(event) => setSet(event.currentTarget.value)} />
        </label>
        <datalist id="marker-sets">{kShipped.map((shipped) => <option key={shipped} value={`${kShippedFolder}/${shipped}.toml`} />)}</datalist>
        <button class="button primary" type="submit" disabled={!mayChange.value || !name.trim() || !set.trim()}>Add</button>
        <OutcomeLine outcome={outcome} />
      </form>
    </Panel>
  );
}

export function SubjectsPage(): JSX.Element {
  const subjects = description.value?.subjects ?? [];
  const index = Math.max(0, subjects.findIndex((subject) => subject.name === route.value.argument));
  const shown = subjects[index];
  return (
    <div class="columns uneven">
      <div class="stack">
        {subjects.length > 1 && (
          <nav class="row" aria-label="Subjects">
            {subjects.map((subject, i) => <a key={subject.name} class="button" aria-current={i === index ? "true" : undefined} href={addressOf("subjects", subject.name)}><Swatch index={i} />{subject.name}</a>)}
          </nav>
        )}
        {shown ? <One key={shown.name} subject={shown} index={index} /> : <p class="panel empty">No subject is configured yet.</p>}
      </div>
      <div class="stack">
        {subjects.length > 1 && <Panel title="All subjects">{subjects.map((subject, i) => <SubjectCard key={subject.name} subject={subject} index={i} />)}</Panel>}
        <Add />
        <C3dImport />
      </div>
    </div>
  );
}
