// Measures the floor with markers that the running daemon sees.

import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { fixed } from "../model/format";
import { isRunning } from "../state/calibration";
import { mayChange } from "../state/live";
import { CalibrationSteps, type LiveCalibration } from "./calibration_progress";
import { OrderButton, Panel } from "./small";

const kMethods = [
  { method: "METHOD_FRAME", text: "floor frame (three markers in an L)", what: "Lay the floor frame where the origin should be; its long arm points along x." },
  { method: "METHOD_MARKERS", text: "three markers or more on the floor", what: "Lay the markers on the floor, far apart and not on one line." },
  { method: "METHOD_WALK", text: "a walk", what: "Walk through the whole volume with markers at the feet." },
];

export function FloorCalibration({ calibration }: { calibration: LiveCalibration }): JSX.Element {
  const [method, setMethod] = useState(kMethods[0].method);
  const [arms_mm, setArms] = useState("600, 400");
  const [height_mm, setHeight] = useState("0");
  const { progress, run } = calibration;
  const [long_m, short_m] = arms_mm.split(/[,;\s]+/).map((arm) => Number(arm) / 1000);
  const framed = method === "METHOD_FRAME";
  const valid = (!framed || (long_m > 0 && short_m > 0)) && Number.isFinite(Number(height_mm));
  const start = () => run({ action: "ACTION_FLOOR", floor: { method, heightM: Number(height_mm) / 1000, ...(framed && { longM: long_m, shortM: short_m }) } });
  const result = progress?.floor ? progress.result : undefined;
  return (
    <Panel title="Floor">
      <div class="stack">
        <p class="soft">{kMethods.find((each) => each.method === method)?.what} The cameras need a rig in force.</p>
        <div class="fields">
          <label class="field">
            <span>With</span>
            <select value={method} onChange={(event) => setMethod(event.currentTarget.value)}>
              {kMethods.map((each) => <option key={each.method} value={each.method}>{each.text}</option>)}
            </select>
          </label>
          {framed && <label class="field"><span>Long and short arm, mm</span><input value={arms_mm} onInput={(event) => setArms(event.currentTarget.value)} /></label>}
          <label class="field"><span>Marker centres above the floor, mm</span><input type="number" min="-100" max="1000" value={height_mm} onInput={(event) => setHeight(event.currentTarget.value)} /></label>
        </div>
        {!isRunning(progress) && <OrderButton primary text="Measure the floor" disabled={!mayChange.value || !valid} run={start} />}
        {progress?.floor && <CalibrationSteps calibration={calibration} />}
        {result?.floorRmsM !== undefined && <p class="soft">The markers lie within {fixed(1000 * result.floorRmsM, 1, "mm")} rms.</p>}
        {result !== undefined && result.issues.length > 0 && <ul class="soft">{result.issues.map((issue) => <li key={issue}>{issue}</li>)}</ul>}
      </div>
    </Panel>
  );
}
