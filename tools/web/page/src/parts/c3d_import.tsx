// Adds a subject from a C3D file, and says what the file has and lacks.

import type { ComponentChildren, JSX } from "preact";
import { useState } from "preact/hooks";
import { fixed } from "../model/format";
import type { Found, ImportReport } from "../model/import_report";
import { importC3d } from "../state/imports";
import { mayChange } from "../state/live";
import { OutcomeLine, Panel } from "./small";

// As the server demands it.
const kName = "[A-Za-z0-9_][A-Za-z0-9_.\\- ]{0,63}";

function Fact({ name, children }: { name: string; children: ComponentChildren }): JSX.Element {
  return <><dt>{name}</dt><dd>{children}</dd></>;
}

const listed = (names: string[]): string => (names.length === 0 ? "none" : names.join(", "));

function Report({ found, warnings }: { found: Found; warnings: string[] }): JSX.Element {
  return (
    <section aria-label="What the file has">
      <dl class="facts-words">
        <Fact name="Markers">{found.markers.length}: {listed(found.markers)}</Fact>
        <Fact name="Bones without a marker">{listed(found.bonesWithout)}</Fact>
        <Fact name="Unknown labels, left out">{listed(found.unknown)}</Fact>
        <Fact name="Labels that occur twice">{listed(found.twice)}</Fact>
        <Fact name="Known, but never seen">{found.neverSeen}</Fact>
        <Fact name="Unlabelled points, left out">{found.unlabelled}</Fact>
        <Fact name="Model outputs, left out">{found.modelOutputs}</Fact>
        <Fact name="Residual of the fitted body">{fixed(found.residual_mm, 1, "mm")}</Fact>
        <Fact name="Distinguish left from right">{listed(found.asymmetric)}</Fact>
      </dl>
      {warnings.length > 0 && <ul class="soft" aria-label="Warnings">{warnings.map((warning, i) => <li key={i}>{warning}</li>)}</ul>}
    </section>
  );
}

export function C3dImport(): JSX.Element {
  const [file, setFile] = useState<File | null>(null);
  const [name, setName] = useState("");
  const [atRest, setAtRest] = useState(true);
  const [busy, setBusy] = useState(false);
  const [report, setReport] = useState<ImportReport | null>(null);
  const send = async () => {
    if (!file) return;
    setBusy(true);
    setReport(null);
    setReport(await importC3d(file, name.trim(), atRest));
    setBusy(false);
  };
  return (
    <Panel title="Add from a C3D file">
      <form class="stack" onSubmit={(event) => { event.preventDefault(); void send(); }}>
        <p class="soft">Makes a marker set from the labels of the file, which stays on the daemon's machine. The next T-pose or A-pose measures the body.</p>
        <label class="field"><span>C3D file, at most 8 MiB</span><input type="file" accept=".c3d" required onChange={(event) => setFile(event.currentTarget.files?.[0] ?? null)} /></label>
        <label class="field"><span>Name of the subject</span><input required pattern={kName} title="letters, digits, _ - . and spaces" value={name} onInput={(event) => setName(event.currentTarget.value)} /></label>
        <label class="check"><input type="checkbox" checked={atRest} onChange={(event) => setAtRest(event.currentTarget.checked)} /> <span>Static trial: the person stands in T-pose or A-pose</span></label>
        <button class="button primary" type="submit" disabled={!mayChange.value || busy || !file || !name.trim()}>{busy ? "Importing…" : "Import and add"}</button>
        <OutcomeLine outcome={report} />
        {report?.found && <Report found={report.found} warnings={report.warnings} />}
      </form>
    </Panel>
  );
}
