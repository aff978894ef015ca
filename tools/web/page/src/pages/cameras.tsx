import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { type CameraHealth, CameraPhase, ClockSource } from "../../gen/mocap/v1/health_pb";
import { CameraPicture } from "../parts/camera_picture";
import { CameraTile, blobsOf, cameraLevel, cameraWord } from "../parts/camera_tile";
import { GreyHistogram } from "../parts/grey_histogram";
import { useCameras } from "../parts/hooks";
import { LevelPill } from "../parts/level_mark";
import { MaskOverlay } from "../parts/mask_overlay";
import { MaskPanel, MaskTools, useMaskDraft } from "../parts/mask_panel";
import { BlobLegend, SceneLegend } from "../parts/scene_legend";
import { OrderButton, OutcomeLine, Panel, Toggle } from "../parts/small";
import type { CameraView } from "../model/camera_view";
import { count, fixed, kUnknown } from "../model/format";
import { health, mayChange } from "../state/live";
import { type Outcome, order, orderAndSay } from "../state/orders";
import { addressOf, route } from "../state/route";
import { tileImages } from "../state/stage_options";

const healthOf = (name: string): CameraHealth | undefined => health.value?.cameras.find((camera) => camera.name === name);

const kClock: Record<ClockSource, string> = {
  [ClockSource.UNSPECIFIED]: kUnknown, [ClockSource.RECEIPTS]: "estimated", [ClockSource.CAMERA]: "PTP", [ClockSource.LOST]: "PTP lost",
  [ClockSource.PTP]: "PTP of the node",
};

const percent = (share: number | undefined): string => (share === undefined ? kUnknown : `${Math.round(100 * share)}\u2009%`);

function Figures({ cameras }: { cameras: CameraView[] }): JSX.Element {
  return (
    <div class="table-box" tabIndex={0} role="region" aria-label="Figures of all cameras">
      <table>
        <caption>Counts are since the daemon started; rates and shares are over the last second.</caption>
        <thead>
          <tr>
            <th>Camera</th><th>State</th><th class="number">Rate</th><th class="number">Blobs</th><th class="number">Used</th><th class="number">Lost images</th>
            <th class="number">Skew</th><th class="number">Jitter</th><th>Clock</th><th class="number">Off the rig</th><th>Last fault</th>
          </tr>
        </thead>
        <tbody>
          {cameras.map((camera, index) => {
            const state = healthOf(camera.name);
            const blobs = blobsOf(index);
            return (
              <tr key={camera.name}>
                <th scope="row"><a href={addressOf("cameras", camera.name)}>{camera.name}</a></th>
                <td><LevelPill level={cameraLevel(state)} text={cameraWord(state)} /></td>
                <td class="number">{fixed(state?.rateHz, 1, "Hz")}</td>
                <td class="number">{blobs === null ? kUnknown : blobs}</td>
                <td class="number">{percent(state?.markerShare)}</td>
                <td class="number">{state ? count(state.missingFrames + state.failedFrames + state.droppedQueueFull) : kUnknown}</td>
                <td class="number">{fixed(state?.offsetUs, 0, "µs")}</td>
                <td class="number">{fixed(state?.jitterUs, 0, "µs")}</td>
                <td>{kClock[state?.clockSource ?? ClockSource.UNSPECIFIED]}</td>
                <td class="number">{fixed(state?.rigOffPx, 2, "px")}</td>
                <td class="wide">{state?.lastError || "none"}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

function All({ cameras }: { cameras: CameraView[] }): JSX.Element {
  const stopped = health.value?.cameras.some((camera) => camera.phase === CameraPhase.STOPPED) ?? false;
  const capture = (action: string, what: string) => orderAndSay(what, "capture", { action });
  return (
    <>
      <div class="row">
        {tileImages.value ? <BlobLegend /> : <SceneLegend />}
        <span class="row push">
          <Toggle text="Images" hint="Previews of the cameras; without them, the markers as each camera sees them" on={tileImages.value} set={(on) => (tileImages.value = on)} />
          <OrderButton text="Start cameras" disabled={!mayChange.value || !stopped} run={() => capture("ACTION_START", "Start cameras")} />
          <OrderButton text="Stop cameras" disabled={!mayChange.value || stopped} run={() => capture("ACTION_STOP", "Stop cameras")} />
        </span>
      </div>
      <section class="tiles" aria-label="Cameras">
        {cameras.map((camera, index) => <CameraTile key={camera.name} camera={camera} index={index} images={tileImages.value} />)}
      </section>
      {cameras.length === 0 && <p class="panel empty">The feed has described no camera yet.</p>}
      {cameras.length > 0 && <Panel title="Figures"><Figures cameras={cameras} /></Panel>}
    </>
  );
}

/** A number that is sent only if the operator enters one; the daemon does not publish the present value. */
function Exposure({ name }: { name: string }): JSX.Element {
  const [exposure, setExposure] = useState("");
  const [gain, setGain] = useState("");
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  const apply = async () => {
    const params = { name, ...(exposure && { exposureUs: Number(exposure) }), ...(gain && { gainDb: Number(gain) }) };
    setOutcome(await order("camera", params));
  };
  return (
    <Panel title="Exposure and gain">
      <form class="stack" onSubmit={(event) => { event.preventDefault(); void apply(); }}>
        <div class="fields">
          <label class="field"><span>Exposure, µs</span><input type="number" min="10" max="20000" step="any" value={exposure} placeholder="unchanged" onInput={(event) => setExposure(event.currentTarget.value)} /></label>
          <label class="field"><span>Gain, dB</span><input type="number" min="0" max="48" step="any" value={gain} placeholder="unchanged" onInput={(event) => setGain(event.currentTarget.value)} /></label>
        </div>
        <button class="button primary" type="submit" disabled={!mayChange.value || (!exposure && !gain)}>Set</button>
        <OutcomeLine outcome={outcome} />
        <p class="faint">Holds until the daemon restarts. For good: <code>exposure_us</code> and <code>gain_db</code> in the configuration.</p>
      </form>
    </Panel>
  );
}

function details(state: CameraHealth): [string, string][] {
  const degrees = (rad: number | undefined) => (rad === undefined ? undefined : (rad * 180) / Math.PI);
  return [
    ["Images", count(state.frames)], ["Missing", count(state.missingFrames)], ["Incomplete", count(state.failedFrames)],
    ["Dropped, queue full", count(state.droppedQueueFull)], ["Arrived twice", count(state.repeatedFrames)], ["Reopened", count(state.reopened)],
    ["Packets sent again", count(state.resentPackets)], ["Packets lost", count(state.missingPackets)], ["No free buffer", count(state.underruns)],
    ["Threshold", fixed(state.thresholdGrey, 0, "grey")], ["Background", fixed(state.backgroundGrey, 1, "grey")], ["Noise", fixed(state.noiseGrey, 2, "grey")],
    ["Brightest, no blob", fixed(state.brightestGrey, 0, "grey")],
    ["Blobs too small", count(state.blobsTooSmall)], ["Blobs too large", count(state.blobsTooLarge)], ["Blobs not round", count(state.blobsNotRound)],
    ["Blobs too dim", count(state.blobsTooDim)], ["Rows given up", count(state.rowsGivenUp)],
    ["Exposure after the others", fixed(state.offsetUs, 1, "µs")], ["Drift of it", fixed(state.driftUsS, 2, "µs/s")], ["Jitter", fixed(state.jitterUs, 1, "µs")],
    ["Clock", kClock[state.clockSource]], ["Clock uncertainty", fixed(state.clockUncertaintyUs || null, 1, "µs")], ["Clock leaps", count(state.clockLeaps)],
    ["Off the rig", fixed(state.rigOffPx, 2, "px")], ["Turned", fixed(degrees(state.rigTurnedRad), 2, "°")],
    ["Moved", fixed(state.rigMovedM === undefined ? undefined : 1000 * state.rigMovedM, 1, "mm")],
  ];
}

function One({ camera, index }: { camera: CameraView; index: number }): JSX.Element {
  const [greys, setGreys] = useState<Float32Array | null>(null);
  const masks = useMaskDraft(camera.name);
  const state = healthOf(camera.name);
  const blobs = blobsOf(index);
  return (
    <div class="large">
      <div class="stack">
        <article class="panel tile">
          <CameraPicture camera={camera} images onGreys={setGreys}
            over={(width_px, height_px) => (
              <MaskOverlay width_px={width_px} height_px={height_px} drawn={masks.drawn} learnt={masks.inForce?.learnt ?? []} marked={masks.marked} tool={masks.tool} add={masks.add} />
            )} />
          <div class="about">
            <header><h2>{camera.name}</h2><LevelPill level={cameraLevel(state)} text={cameraWord(state)} /></header>
            <div class="figures">
              <span>{camera.width_px} × {camera.height_px} px</span><span>{blobs === null ? kUnknown : blobs} blobs</span>
              <span>{fixed(state?.rateHz, 1, "Hz")}</span><span>{percent(state?.markerShare)} used</span>
            </div>
            <MaskTools camera={camera.name} draft={masks} />
            {state?.lastError && <p class="bad">{state.lastError}</p>}
          </div>
        </article>
        <BlobLegend />
      </div>
      <div class="stack">
        <Panel title="Brightness"><GreyHistogram greys={greys} threshold_grey={state?.thresholdGrey} /></Panel>
        <Exposure name={camera.name} />
        <MaskPanel camera={camera.name} draft={masks} />
        <Panel title="Figures">
          {!state && <p class="soft">No health has arrived yet.</p>}
          <dl class="facts-small">{state && details(state).map(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name}-value`}>{value}</dd>])}</dl>
        </Panel>
      </div>
    </div>
  );
}

export function CamerasPage(): JSX.Element {
  const cameras = useCameras();
  const name = route.value.argument;
  const index = cameras.findIndex((camera) => camera.name === name);
  if (!name) return <All cameras={cameras} />;
  return (
    <>
      <p><a href="#/cameras">All cameras</a></p>
      {index >= 0 ? <One key={name} camera={cameras[index]} index={index} /> : <p class="panel empty">There is no camera "{name}" in the description.</p>}
    </>
  );
}
