// One light and its reasons, from what the page knows.

import type { Description } from "../../gen/mocap/v1/description_pb";
import {
  type CameraHealth, CameraPhase, ClockSource, type Health, LatencyStage, RecordingState, type StageLatency, TakeQuality, TakeState,
} from "../../gen/mocap/v1/health_pb";
import type { ServerState } from "../feed/server_text";
import { age } from "./format";

export type Level = "good" | "look" | "bad";

export interface Reason {
  level: Level;
  text: string;
  /** A command or a page that mends it; empty: none is known. */
  remedy: string;
}

export interface Known {
  /** The connection of the page to the server. */
  open: boolean;
  closedBecause: string;
  server: ServerState | null;
  description: Description | null;
  /** Newest, and the one about a minute before, which turns counters into faults of the last minute. */
  health: Health | null;
  before: Health | null;
  /** Since the newest snapshot came. Null: none came yet. */
  silent_s: number | null;
}

const kSilent_s = 2;
// A snapshot older than this is late for an avatar on a screen; the goal of the daemon is below 20 ms.
const kLate_ns = 50_000_000n;
const kSlowShare = 0.9;
const kUsefulShare = 0.3;

const phaseText: Record<CameraPhase, string> = {
  [CameraPhase.UNSPECIFIED]: "starting", [CameraPhase.STARTING]: "starting", [CameraPhase.STREAMING]: "streaming", [CameraPhase.SILENT]: "silent",
  [CameraPhase.REOPENING]: "lost, reopening", [CameraPhase.ENDED]: "ended", [CameraPhase.STOPPED]: "stopped",
};

export const cameraPhaseText = (phase: CameraPhase): string => phaseText[phase] ?? "starting";

export function stage(health: Health | null, which: LatencyStage): StageLatency | null {
  return health?.latencies.find((latency) => latency.stage === which) ?? null;
}

const bad = (text: string, remedy = ""): Reason => ({ level: "bad", text, remedy });
const look = (text: string, remedy = ""): Reason => ({ level: "look", text, remedy });

function connectionReasons(known: Known): Reason[] {
  if (!known.open) return [bad(`No connection to mocap-web: ${known.closedBecause}.`, "systemctl status mocap-web")];
  if (!known.server) return [look("Waiting for mocap-web.")];
  if (!known.server.connected) {
    return [bad(`mocap-web has no connection to mocapd at ${known.server.endpoint}${known.server.reason && `: ${known.server.reason}`}.`, "systemctl status mocapd")];
  }
  if (!known.description) return [look("No description of the feed has arrived yet.")];
  return [];
}

function growth(now: bigint, before: bigint | undefined): bigint {
  return before !== undefined && now > before ? now - before : 0n;
}

function cameraReasons(camera: CameraHealth, before: CameraHealth | undefined): Reason[] {
  const reasons: Reason[] = [];
  const name = `Camera ${camera.name}`;
  if (camera.phase === CameraPhase.STOPPED) return [look(`${name}: stopped by an operator.`, "Cameras: start")];
  if (camera.phase !== CameraPhase.STREAMING && camera.phase !== CameraPhase.ENDED) {
    reasons.push(bad(`${name}: ${cameraPhaseText(camera.phase)}${camera.lastError && `: ${camera.lastError}`}.`, "mocapctl doctor"));
  }
  if (camera.bumped) reasons.push(bad(`${name} no longer stands as the rig says${camera.rigOffPx === undefined ? "" : ` (${camera.rigOffPx.toFixed(1)} px off)`}.`, "mocap-calibrate refine --config FILE"));
  if (camera.synchronised === false) reasons.push(look(`${name} does not expose together with the others.`, "Check its trigger or PTP"));
  if (camera.clockSource === ClockSource.LOST) reasons.push(look(`${name}: its clock lost PTP.`, "Check ptp4l on the host"));
  const missing = growth(camera.missingFrames, before?.missingFrames) + growth(camera.failedFrames, before?.failedFrames);
  if (missing > 0n) reasons.push(look(`${name}: ${missing} images lost in the last minute.`, "mocapctl doctor"));
  if (growth(camera.droppedQueueFull, before?.droppedQueueFull) > 0n) reasons.push(look(`${name}: images dropped because the queue was full.`, "Use fewer programs on this machine, or a lower rate"));
  return reasons;
}

function shareReasons(health: Health): Reason[] {
  const shares = health.cameras.map((camera) => camera.markerShare);
  if (!shares.some((share) => share !== undefined && share > 2 * kUsefulShare)) return [];
  return health.cameras
    .filter((camera) => camera.markerShare !== undefined && camera.markerShare < kUsefulShare && !camera.bumped)
    .map((camera) => look(`Camera ${camera.name}: only ${Math.round(100 * camera.markerShare!)} % of its blobs are markers: reflections, or it does not fit the rig.`, "mocap-calibrate mask --config FILE"));
}

function pipelineReasons(health: Health, before: Health | null, nominal_hz: number): Reason[] {
  const reasons: Reason[] = [];
  const total = stage(health, LatencyStage.TOTAL);
  if (total && total.p99Ns > kLate_ns) reasons.push(look(`Latency: p99 is ${(Number(total.p99Ns) / 1e6).toFixed(0)} ms.`, "Health: the slowest stage"));
  if (nominal_hz > 0 && health.setRateHz > 0 && health.setRateHz < kSlowShare * nominal_hz) {
    reasons.push(look(`${health.setRateHz.toFixed(1)} sets a second instead of ${nominal_hz.toFixed(1)}.`, "Cameras: find the slow one"));
  }
  const skipped = growth(health.passedOverSets, before?.passedOverSets) + growth(health.droppedSnapshots, before?.droppedSnapshots);
  if (skipped > 0n) reasons.push(look(`${skipped} sets skipped in the last minute: the machine is too slow.`, "Health: the slowest stage"));
  if ((health.feed?.behind ?? 0) > 0) reasons.push(look(`${health.feed!.behind} subscribers do not keep up.`, "Health: subscribers"));
  return reasons;
}

function fileReasons(health: Health): Reason[] {
  const reasons = health.recordings
    .filter((recording) => recording.state === RecordingState.FAILED)
    .map((recording) => bad(`Recording ${recording.path} failed: ${recording.error}.`, "df -h"));
  const take = health.take;
  if (take?.state === TakeState.FAILED) reasons.push(bad(`Take ${take.name} ended early: ${take.message}.`, "mocapctl take show"));
  else if (take?.state === TakeState.RECORDING && (take.quality === TakeQuality.BAD || take.quality === TakeQuality.LOOK)) {
    reasons.push(look(`Take ${take.name}: ${take.reasons}.`, "Takes"));
  }
  return reasons;
}

/** Worst first. Empty: all is well. */
export function healthReasons(known: Known): Reason[] {
  const reasons = connectionReasons(known);
  const { health, before, description } = known;
  if (known.open && known.server?.connected && known.silent_s !== null && known.silent_s > kSilent_s) {
    reasons.push(bad(`No data since ${age(known.silent_s)}.`, "Cameras"));
  }
  if (health) {
    for (const camera of health.cameras) reasons.push(...cameraReasons(camera, before?.cameras.find((other) => other.name === camera.name)));
    reasons.push(...shareReasons(health), ...pipelineReasons(health, before, description?.nominalRateHz ?? 0), ...fileReasons(health));
    for (const search of health.searches) reasons.push(look(search.sentence || "A subject is not found.", "Subjects"));
  }
  const rank: Record<Level, number> = { bad: 0, look: 1, good: 2 };
  return reasons.sort((a, b) => rank[a.level] - rank[b.level]);
}

export function worst(reasons: Reason[]): Level {
  return reasons.length === 0 ? "good" : reasons[0].level;
}
