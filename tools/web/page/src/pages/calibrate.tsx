import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import type { CameraView } from "../model/camera_view";
import { Coverage, kColumns } from "../model/coverage";
import { fixed } from "../model/format";
import { sceneFrame } from "../model/scene_frame";
import { useCalibration } from "../parts/calibration_progress";
import { CellMap } from "../parts/cell_map";
import { FloorCalibration } from "../parts/floor_calibration";
import { useCameras } from "../parts/hooks";
import { KeptRigs } from "../parts/kept_rigs";
import { LevelPill } from "../parts/level_mark";
import { Command, OrderButton, OutcomeLine, Panel } from "../parts/small";
import { WandCalibration } from "../parts/wand_calibration";
import { description, health, mayChange, onFrame } from "../state/live";
import { type Outcome, order } from "../state/orders";

const kRedraw_ms = 500;
function CoverageMap({ camera, coverage, redraw }: { camera: CameraView; coverage: Coverage; redraw: number }): JSX.Element {
  const share = Math.round(100 * coverage.share(camera.name));
  return <CellMap cells={coverage.of(camera.name)} columns={kColumns} redraw={redraw} label={`${share} % of the image of camera ${camera.name} has seen a marker`} caption={`${camera.name}: ${share}\u2009%`} />;
}

function CoveragePanel({ cameras }: { cameras: CameraView[] }): JSX.Element {
  const coverage = useRef(new Coverage());
  const [redraw, setRedraw] = useState(0);
  useEffect(() => onFrame((newest) => {
    const described = description.peek();
    if (!described) return;
    const measured = sceneFrame(described, newest, null).markers.filter((marker) => marker.state !== "filled");
    coverage.current.add(cameras, measured.map((marker) => marker.at_m));
  }), [cameras]);
  useEffect(() => {
    const timer = window.setInterval(() => setRedraw((count) => count + 1), kRedraw_ms);
    return () => window.clearInterval(timer);
  }, []);
  const clear = () => {
    coverage.current.clear();
    setRedraw((count) => count + 1);
  };
  return (
    <Panel title="Coverage" tools={<button class="button" type="button" onClick={clear}>Start anew</button>}>
      <div class="stack">
        <p class="soft">Filled cells: a 3D marker was seen there since this page was opened. Small marks: not yet; walk or wave there, so that <code>verify</code> and <code>refine</code> see the whole volume.</p>
        <div class="coverage">{cameras.filter((camera) => camera.calibrated).map((camera) => <CoverageMap key={camera.name} camera={camera} coverage={coverage.current} redraw={redraw} />)}</div>
      </div>
    </Panel>
  );
}

function Drift(): JSX.Element {
  const cameras = health.value?.cameras ?? [];
  const degrees = (rad: number | undefined) => fixed(rad === undefined ? undefined : (rad * 180) / Math.PI, 2, "°");
  return (
    <Panel title="Drift of the cameras, live">
      <div class="table-box" tabIndex={0} role="region" aria-label="Drift of the cameras">
        <table>
          <thead><tr><th>Camera</th><th>Stands</th><th class="number">Off</th><th class="number">Turned</th><th class="number">Moved</th></tr></thead>
          <tbody>
            {cameras.map((camera) => (
              <tr key={camera.name}>
                <th scope="row">{camera.name}</th>
                <td>{camera.bumped === undefined ? <LevelPill level="look" text="unknown" /> : <LevelPill level={camera.bumped ? "bad" : "good"} text={camera.bumped ? "moved" : "as the rig says"} />}</td>
                <td class="number">{fixed(camera.rigOffPx, 2, "px")}</td><td class="number">{degrees(camera.rigTurnedRad)}</td>
                <td class="number">{fixed(camera.rigMovedM === undefined ? undefined : 1000 * camera.rigMovedM, 1, "mm")}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      <p class="faint">Needs moving markers that at least three cameras see.</p>
    </Panel>
  );
}

function Masks({ cameras }: { cameras: CameraView[] }): JSX.Element {
  const [camera, setCamera] = useState("");
  const [images, setImages] = useState("100");
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  return (
    <Panel title="Masks">
      <div class="stack">
        <p class="soft">Nobody in the volume. What is bright now, lamps, reflections, other cameras, is masked in the running daemon and in the rig file.</p>
        <div class="fields">
          <label class="field">
            <span>Camera</span>
            <select value={camera} onChange={(event) => setCamera(event.currentTarget.value)}>
              <option value="">all</option>
              {cameras.map(({ name }) => <option key={name} value={name}>{name}</option>)}
            </select>
          </label>
          <label class="field"><span>Images of each</span><input type="number" min="1" max="10000" value={images} onInput={(event) => setImages(event.currentTarget.value)} /></label>
        </div>
        <OrderButton primary text="Learn masks" disabled={!mayChange.value} run={async () => setOutcome(await order("mask", { camera, images: Number(images) || 0 }))} />
        <OutcomeLine outcome={outcome} />
      </div>
    </Panel>
  );
}

function Step({ title, text, command }: { title: string; text: string; command: string }): JSX.Element {
  return (
    <Panel title={title}>
      <div class="stack">
        <p class="soft">{text}</p>
        <Command text={command} />
      </div>
    </Panel>
  );
}

function Reload(): JSX.Element {
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  return (
    <Panel title="Use the new rig">
      <div class="stack">
        <p class="soft">The daemon reads configuration and rig again. Unchanged cameras, subjects and recordings go on without a gap.</p>
        <OrderButton primary text="Reload" disabled={!mayChange.value} run={async () => setOutcome(await order("reload", {}))} />
        <OutcomeLine outcome={outcome} />
      </div>
    </Panel>
  );
}

export function CalibratePage(): JSX.Element {
  const cameras = useCameras();
  const [changes, setChanges] = useState(0);
  const rigChanged = () => setChanges((count) => count + 1);
  const calibration = useCalibration(rigChanged);
  return (
    <div class="columns">
      <div class="stack steps">
        <Masks cameras={cameras} />
        <WandCalibration calibration={calibration} />
        <FloorCalibration calibration={calibration} />
        <Step title="Verify and repair" text="Checks with moving markers that every camera agrees with the rig; refine repairs drift and a bumped camera." command="mocap-calibrate refine --config my.toml" />
        <Reload />
      </div>
      <div class="stack">
        <KeptRigs changes={changes} restored={rigChanged} />
        <Drift />
        <CoveragePanel cameras={cameras} />
      </div>
    </div>
  );
}
