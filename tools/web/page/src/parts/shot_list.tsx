// The daemon's shot list: shown, replaced and emptied.

import { fromJson, type JsonValue } from "@bufbuild/protobuf";
import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { AnswerSchema } from "../../gen/mocap/v1/control_pb";
import { duration } from "../model/format";
import { readShots, type ShotLine, writeShots } from "../model/shot_list";
import { health, mayChange, open, request } from "../state/live";
import { nextShot, orderAndSay, takeBusy } from "../state/orders";
import { OrderButton, Panel } from "./small";

/** Rejects with a RequestError. */
async function listShots(): Promise<ShotLine[]> {
  const answer = await request("shots", { action: "ACTION_LIST" });
  const { what } = fromJson(AnswerSchema, answer as JsonValue, { ignoreUnknownFields: true });
  return what.case === "shots" ? what.value.shots : [];
}

function Editor({ shots, close }: { shots: ShotLine[]; close(): void }): JSX.Element {
  const [text, setText] = useState(writeShots(shots));
  const keep = async () => {
    const read = readShots(text, shots);
    const outcome = await orderAndSay("Shot list", "shots", read.length > 0 ? { action: "ACTION_IMPORT", shots: read } : { action: "ACTION_CLEAR" });
    if (outcome.good) close();
  };
  return (
    <div class="stack">
      <label class="field">
        <span>One shot a line, as pasted from a spreadsheet: name, slate, notes, seconds.</span>
        <textarea rows={8} value={text} onInput={(event) => setText(event.currentTarget.value)} />
      </label>
      <div class="row">
        <OrderButton primary text="Keep" disabled={!mayChange.value} run={keep} />
        <button class="button" type="button" onClick={close}>Discard</button>
      </div>
    </div>
  );
}

function Table({ shots }: { shots: ShotLine[] }): JSX.Element {
  const next = shots.find((shot) => !shot.done);
  return (
    <div class="table-box" tabIndex={0} role="region" aria-label="Shot list">
      <table>
        <thead><tr><th>Shot</th><th>Slate</th><th>Notes</th><th class="number">Length</th><th>State</th></tr></thead>
        <tbody>
          {shots.map((shot) => (
            <tr key={shot.name} data-selected={shot === next}>
              <th scope="row">{shot.name}</th><td>{shot.slate}</td><td class="wide">{shot.notes}</td>
              <td class="number">{shot.seconds > 0 ? duration(shot.seconds) : "–"}</td><td>{shot.done ? "taken" : shot === next ? "next" : ""}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

export function ShotList(): JSX.Element {
  const [shots, setShots] = useState<ShotLine[]>([]);
  const [fault, setFault] = useState("");
  const [editing, setEditing] = useState(false);
  const take = health.value?.take;
  useEffect(() => {
    if (!open.value || editing) return;
    listShots().then((listed) => { setShots(listed); setFault(""); }, (error) => setFault(String(error.message)));
  }, [open.value, editing, take?.name, take?.state]);
  const left = shots.filter((shot) => !shot.done).length;
  const edit = !editing && <button class="button" type="button" disabled={!mayChange.value} onClick={() => setEditing(true)}>Edit</button>;
  return (
    <Panel title="Shot list" tools={edit}>
      {fault && <p class="answer bad"><span>{fault}</span></p>}
      {editing && <Editor shots={shots} close={() => setEditing(false)} />}
      {!editing && shots.length === 0 && !fault && <p class="soft">Empty. A shot list names the takes that “Next shot” records one after the other.</p>}
      {!editing && shots.length > 0 && (
        <div class="stack">
          <Table shots={shots} />
          <div class="row">
            <OrderButton primary text="Next shot" disabled={!mayChange.value || takeBusy.value || left === 0} run={nextShot} />
            <span class="soft">{left} of {shots.length} left</span>
          </div>
        </div>
      )}
    </Panel>
  );
}
