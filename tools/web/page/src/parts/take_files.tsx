// Download, export, check, rename and delete a take.

import type { JSX } from "preact";
import { useState } from "preact/hooks";
import type { Outcome } from "../state/orders";
import { changeTake, exportTake, fileOf, kFormats, mayChangeTakes, verifyTake } from "../state/recorded";
import { addressOf } from "../state/route";
import { say } from "../state/toasts";
import { OrderButton, OutcomeLine, Panel } from "./small";

/** Makes the browser save a file of the server. */
function save(address: string): void {
  const link = document.createElement("a");
  link.href = address;
  link.download = "";
  link.click();
}

export function Export({ name }: { name: string }): JSX.Element {
  const [format, setFormat] = useState<string>("c3d");
  const [share, setShare] = useState<number | null>(null);
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  const run = async () => {
    setOutcome(null);
    setShare(0);
    try {
      save(await exportTake(name, format, setShare));
      setOutcome({ good: true, message: `${name} as ${format}: the browser saves the file.` });
    } catch (error) {
      setOutcome({ good: false, message: error instanceof Error ? error.message : String(error) });
    }
    setShare(null);
  };
  return (
    <div class="stack">
      <div class="row low">
        <label class="field"><span>Format</span>
          <select class="input" value={format} disabled={share !== null} onChange={(event) => setFormat(event.currentTarget.value)}>
            {kFormats.map((each) => <option key={each} value={each}>{each}</option>)}
          </select>
        </label>
        <OrderButton primary text="Export" disabled={share !== null} run={run} />
        {share !== null && <progress value={share} max={1} aria-label="Progress of the export" />}
      </div>
      <OutcomeLine outcome={outcome} />
    </div>
  );
}

function Rename({ name }: { name: string }): JSX.Element {
  const [text, setText] = useState(name);
  const run = async () => {
    const outcome = await changeTake(name, "rename", { name: text.trim() });
    say(outcome.message, outcome.good);
    if (outcome.good) location.hash = addressOf("takes", text.trim());
  };
  return (
    <div class="row low">
      <label class="field grow"><span>Name</span><input value={text} maxLength={200} onInput={(event) => setText(event.currentTarget.value)} /></label>
      <OrderButton text="Rename" disabled={!mayChangeTakes.value || !text.trim() || text.trim() === name} run={run} />
    </div>
  );
}

export function TakeFiles({ name }: { name: string }): JSX.Element {
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  const check = async () => setOutcome(await verifyTake(name));
  const remove = async () => {
    if (!window.confirm(`Delete the take ${name} and its file? It cannot be brought back.`)) return;
    const removed = await changeTake(name, "delete", {});
    say(removed.message, removed.good);
    if (removed.good) location.hash = addressOf("takes");
  };
  return (
    <Panel title="File">
      <div class="stack">
        <Export name={name} />
        <div class="row">
          <a class="button" href={fileOf(name)} download>Download</a>
          <OrderButton text="Check" run={check} />
          <OrderButton text="Delete" disabled={!mayChangeTakes.value} run={remove} />
        </div>
        <OutcomeLine outcome={outcome} />
        <Rename key={name} name={name} />
      </div>
    </Panel>
  );
}
