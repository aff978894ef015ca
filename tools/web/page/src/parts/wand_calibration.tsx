// Calibrates the cameras of the running daemon with a waved wand, and goes back to earlier rigs.

import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { type Calibration, CalibrationState, type KeptRig } from "../../gen/mocap/v1/control_pb";
import { fixed } from "../model/format";
import { isRunning, listRigs, lookAtCalibration, wandMarks_m } from "../state/calibration";
import { mayChange, open } from "../state/live";
import { type Outcome, order } from "../state/orders";
import { CellMap } from "./cell_map";
import { Meter, OrderButton, OutcomeLine, Panel } from "./small";

const kCells = 8;
const kLookRunning_ms = 500;
const kLook_ms = 3000;
const kWands = [
  { text: "500 mm, middle marker at 160", marks: "0, 160, 500" },
  { text: "400 mm, middle marker at 130", marks: "0, 130, 400" },
  { text: "250 mm, middle marker at 80", marks: "0, 80, 250" },
];

type Run = (params: Record<string, unknown>) => Promise<void>;

function Start({ run }: { run: Run }): JSX.Element {
  const [marks, setMarks] = useState(kWands[0].marks);
  const [lenses, setLenses] = useState("known");
  const [fov_deg, setFov] = useState("65");
  const wand_m = wandMarks_m(marks);
  const start = () => run({ action: "ACTION_WAND", wandM: wand_m, ...(lenses === "unknown" ? { fovDeg: Number(fov_deg) || 0 } : { refineLens: lenses === "refine" }) });
  return (
    <div class="stack">
      <div class="fields">
        <label class="field">
          <span>Wand</span>
          <select value={marks} onChange={(event) => setMarks(event.currentTarget.value)}>
            {kWands.map((wand) => <option key={wand.marks} value={wand.marks}>{wand.text}</option>)}
            {!kWands.some((wand) => wand.marks === marks) && <option value={marks}>my own</option>}
          </select>
        </label>
        <label class="field"><span>Its markers from one end, mm; measure them</span><input value={marks} onInput={(event) => setMarks(event.currentTarget.value)} /></label>
        <label class="field">
          <span>Lenses</span>
          <select value={lenses} onChange={(event) => setLenses(event.currentTarget.value)}>
            <option value="known">as in the rig</option><option value="refine">as in the rig, estimated again</option><option value="unknown">not calibrated yet</option>
          </select>
        </label>
        {lenses === "unknown" && <label class="field"><span>Horizontal field of view, about, °</span><input type="number" min="5" max="150" value={fov_deg} onInput={(event) => setFov(event.currentTarget.value)} /></label>}
      </div>
      <OrderButton primary text="Start waving" disabled={!mayChange.value || !wand_m} run={start} />
    </div>
  );
}

function Coverage({ progress, looked }: { progress: Calibration; looked: number }): JSX.Element {
  const needed = Number(progress.minShared);
  return (
    <div class="coverage">
      {progress.cameras.map((camera) => {
        const share = Math.round(100 * camera.coverage);
        const [shared, dropped] = [Number(camera.shared), Number(camera.dropped)];
        return (
          <div key={camera.name}>
            <CellMap cells={camera.cells} columns={kCells} redraw={looked} label={`${share} % of the image of camera ${camera.name} has seen the wand`} caption={`${camera.name}: ${share} %, ${shared} of ${needed} samples${dropped > 0 ? `, ${dropped} images dropped` : ""}`} />
            <Meter share={needed > 0 ? shared / needed : 0} low={1} label={`${shared} of ${needed} samples of camera ${camera.name}`} />
          </div>
        );
      })}
    </div>
  );
}

function Result({ progress }: { progress: Calibration }): JSX.Element | null {
  const { result } = progress;
  if (!result) return null;
  const degrees = (rad: number) => fixed((rad * 180) / Math.PI, 4, "°");
  return (
    <div class="stack">
      <p class="soft">{result.grade}: {fixed(result.rmsPx, 3, "px")} rms, {fixed(result.heldoutPx, 3, "px")} on samples that were held out. The wand measures {fixed(1000 * result.wandM, 2, "mm")} ± {fixed(1000 * result.wandStdM, 2, "mm")} in {Number(result.samples)} samples. The floor is {result.floorIsGuessed ? "provisional" : "where it was"}.</p>
      <div class="table-box" tabIndex={0} role="region" aria-label="Result of the calibration">
        <table>
          <thead><tr><th>Camera</th><th class="number">Residual</th><th class="number">Held out</th><th class="number">Points</th><th class="number">Position ±</th><th class="number">Rotation ±</th></tr></thead>
          <tbody>
            {progress.cameras.map((camera) => (
              <tr key={camera.name}>
                <th scope="row">{camera.name}</th><td class="number">{fixed(camera.rmsPx, 3, "px")}</td><td class="number">{fixed(camera.heldoutPx, 3, "px")}</td>
                <td class="number">{Number(camera.points)}</td><td class="number">{fixed(1000 * camera.positionSigmaM, 2, "mm")}</td><td class="number">{degrees(camera.rotationSigmaRad)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {result.issues.length > 0 && <ul class="soft">{result.issues.map((issue) => <li key={issue}>{issue}</li>)}</ul>}
    </div>
  );
}

const kSentences: Partial<Record<CalibrationState, (progress: Calibration) => string>> = {
  [CalibrationState.COLLECTING]: (progress) => (progress.complete ? "Enough samples: solve, or go on waving." : progress.advice),
  [CalibrationState.SOLVING]: (progress) => `Solving: ${progress.step} ${Math.round(100 * progress.fraction)} %`,
  [CalibrationState.SOLVED]: () => "Solved. Apply writes the rig and uses it; the rig before is kept.",
  [CalibrationState.APPLIED]: () => "The rig is in force.",
  [CalibrationState.FAILED]: (progress) => `No rig: ${progress.message}`,
  [CalibrationState.CANCELLED]: (progress) => `Cancelled: ${progress.message}`,
};

export function WandCalibration({ applied }: { applied(): void }): JSX.Element {
  const [progress, setProgress] = useState<Calibration | null>(null);
  const [looked, setLooked] = useState(0);
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  const look = async () => {
    try {
      setProgress(await lookAtCalibration());
      setLooked((count) => count + 1);
    } catch {
      setProgress(null);  // an older daemon, or none: the order to start says why
    }
  };
  const running = isRunning(progress);
  useEffect(() => {
    if (!open.value) return undefined;
    void look();
    const timer = window.setInterval(() => void look(), running ? kLookRunning_ms : kLook_ms);
    return () => window.clearInterval(timer);
  }, [open.value, running]);
  const run: Run = async (params) => {
    const done = await order("calibration", params);
    setOutcome(done.good && !done.message ? null : done);
    await look();
    if (params.action === "ACTION_APPLY") applied();
  };
  const state = progress?.state ?? CalibrationState.UNSPECIFIED;
  const sentence = progress && kSentences[state]?.(progress);
  const button = (text: string, action: string, primary = false) => <OrderButton primary={primary} text={text} disabled={!mayChange.value} run={() => run({ action })} />;
  return (
    <Panel title="Wand">
      <div class="stack">
        <p class="soft">Wave the wand through the whole volume in all directions. Capture goes on.</p>
        {!running && <Start run={run} />}
        {sentence && <p role="status"><strong>{sentence}</strong></p>}
        {running && (
          <div class="row">
            {state === CalibrationState.COLLECTING && button("Solve", "ACTION_SOLVE", progress?.complete)}
            {button("Cancel", "ACTION_CANCEL")}
          </div>
        )}
        {state === CalibrationState.SOLVED && <div class="row">{button("Apply", "ACTION_APPLY", true)}{button("Discard", "ACTION_CANCEL")}</div>}
        <OutcomeLine outcome={outcome} />
        {progress && <Result progress={progress} />}
        {progress && progress.cameras.length > 0 && <Coverage progress={progress} looked={looked} />}
      </div>
    </Panel>
  );
}

export function KeptRigs({ changes, restored }: { changes: number; restored(): void }): JSX.Element | null {
  const [rigs, setRigs] = useState<KeptRig[]>([]);
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  useEffect(() => {
    if (open.value) listRigs().then(setRigs, () => setRigs([]));
  }, [open.value, changes]);
  const restore = async (name: string) => {
    setOutcome(await order("calibration", { action: "ACTION_RESTORE", name }));
    restored();
  };
  return (
    <Panel title="Earlier rigs">
      <div class="stack">
        {rigs.length === 0 && <p class="soft">None yet. The daemon keeps every rig that it calibrates, and the one before.</p>}
        {rigs.length > 0 && (
          <div class="table-box" tabIndex={0} role="region" aria-label="Earlier rigs">
            <table>
              <thead><tr><th>Made (UTC)</th><th class="number">Cameras</th><th class="number">Residual</th><th>By</th><th>Use</th></tr></thead>
              <tbody>
                {rigs.map((rig) => (
                  <tr key={rig.name} data-selected={rig.inForce}>
                    <th scope="row">{rig.name}</th><td class="number">{rig.cameras}</td><td class="number">{rig.rmsPx > 0 ? fixed(rig.rmsPx, 3, "px") : "–"}</td><td>{rig.solvedBy}</td>
                    <td>{rig.inForce ? "in force" : <OrderButton text="Restore" disabled={!mayChange.value} run={() => restore(rig.name)} />}</td>
                  </tr>
                ))}
              </tbody>
            </table>
          </div>
        )}
        <OutcomeLine outcome={outcome} />
      </div>
    </Panel>
  );
}
