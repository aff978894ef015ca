// Calibrates the cameras of the running daemon with a waved wand.

import type { JSX } from "preact";
import { useState } from "preact/hooks";
import type { Calibration } from "../../gen/mocap/v1/control_pb";
import { fixed } from "../model/format";
import { isRunning, wandMarks_m } from "../state/calibration";
import { mayChange } from "../state/live";
import { CalibrationSteps, type LiveCalibration } from "./calibration_progress";
import { CellMap } from "./cell_map";
import { Meter, OrderButton, Panel } from "./small";

const kCells = 8;
const kWands = [
  { text: "500 mm, middle marker at 160", marks: "0, 160, 500" },
  { text: "400 mm, middle marker at 130", marks: "0, 130, 400" },
  { text: "250 mm, middle marker at 80", marks: "0, 80, 250" },
];

function Start({ run }: { run: LiveCalibration["run"] }): JSX.Element {
  const [marks, setMarks] = useState(kWands[0].marks);
  const [lenses, setLenses] = useState("known");
  const [fov_deg, setFov] = useState("65");
  const wand_m = wandMarks_m(marks);
  const isGuessed = lenses === "unknown" || lenses === "replaced";
  const guess = isGuessed ? { fovDeg: Number(fov_deg) || 0 } : {};
  const start = () => run({ action: "ACTION_WAND", wandM: wand_m, ...guess, ...(lenses === "unknown" ? {} : { refineLens: lenses !== "known" }) });
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
            <option value="known">as in the rig</option><option value="refine">as in the rig, estimated again</option><option value="unknown">not calibrated yet; others are kept</option><option value="replaced">all estimated anew</option>
          </select>
        </label>
        {isGuessed && <label class="field"><span>Horizontal field of view, about, °</span><input type="number" min="5" max="150" value={fov_deg} onInput={(event) => setFov(event.currentTarget.value)} /></label>}
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
  const known = (figure: number, digits: number, unit: string, scale = 1) => fixed(figure > 0 ? scale * figure : null, digits, unit);  // 0 is unknown
  return (
    <div class="stack">
      <p class="soft">{result.grade}: {fixed(result.rmsPx, 3, "px")} rms, {known(result.heldoutPx, 3, "px")} on samples that were held out. The wand measures {known(result.wandM, 2, "mm", 1000)} ± {known(result.wandStdM, 2, "mm", 1000)} in {Number(result.samples)} samples; the scale is that of its length and was not checked. The floor is {result.floorIsGuessed ? "provisional: measure it after Apply" : "where it was"}.</p>
      <div class="table-box" tabIndex={0} role="region" aria-label="Result of the calibration">
        <table>
          <thead><tr><th>Camera</th><th class="number">Residual</th><th class="number">Held out</th><th class="number">Points</th><th class="number">Position ±</th><th class="number">Rotation ±</th></tr></thead>
          <tbody>
            {progress.cameras.map((camera) => (
              <tr key={camera.name}>
                <th scope="row">{camera.name}</th><td class="number">{fixed(camera.rmsPx, 3, "px")}</td><td class="number">{known(camera.heldoutPx, 3, "px")}</td>
                <td class="number">{Number(camera.points)}</td><td class="number">{known(camera.positionSigmaM, 2, "mm", 1000)}</td><td class="number">{known(camera.rotationSigmaRad, 4, "°", 180 / Math.PI)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {result.issues.length > 0 && <ul class="soft">{result.issues.map((issue) => <li key={issue}>{issue}</li>)}</ul>}
    </div>
  );
}

export function WandCalibration({ calibration }: { calibration: LiveCalibration }): JSX.Element {
  const { looked, run } = calibration;
  const progress = calibration.progress?.floor ? null : calibration.progress;
  return (
    <Panel title="Wand">
      <div class="stack">
        <p class="soft">Wave the wand through the whole volume in all directions. Capture goes on.</p>
        {!isRunning(calibration.progress) && <Start run={run} />}
        {!calibration.progress?.floor && <CalibrationSteps calibration={calibration} />}
        {progress && <Result progress={progress} />}
        {progress && progress.cameras.length > 0 && <Coverage progress={progress} looked={looked} />}
      </div>
    </Panel>
  );
}
