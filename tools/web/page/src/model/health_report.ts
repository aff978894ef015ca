// One light and its reasons: the findings of preflight, which mocap-web makes with the code of `mocapctl preflight`, and what only the page
// knows.

import type { Description } from "../../gen/mocap/v1/description_pb";
import { CameraPhase, type Health, LatencyStage, type StageLatency, TakeQuality, TakeState } from "../../gen/mocap/v1/health_pb";
import type { ServerState } from "../feed/server_text";
import { age } from "./format";
import type { Finding, Level } from "./preflight";

export type { Level };

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
  health: Health | null;
  /** Of the last check; null: none has ended yet. */
  findings: readonly Finding[] | null;
  /** Since the newest snapshot came. Null: none came yet. */
  silent_s: number | null;
}

const kSilent_s = 2;

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

/** A take that is recorded: the quality is the daemon's judgement. */
function takeReasons(health: Health | null): Reason[] {
  const take = health?.take;
  if (take?.state !== TakeState.RECORDING || (take.quality !== TakeQuality.BAD && take.quality !== TakeQuality.LOOK)) return [];
  return [{ level: take.quality === TakeQuality.BAD ? "bad" : "look", text: `Take ${take.name}: ${take.reasons}.`, remedy: "Takes" }];
}

function findingReasons(findings: readonly Finding[] | null): Reason[] {
  if (findings === null) return [look("The first check of the daemon is under way.")];
  // A take that is recorded makes the daemon busy, not ill.
  return findings
    .filter(({ level, check }) => level !== "good" && check !== "take")
    .map(({ level, check, what, cure }) => ({ level, text: `${check[0]?.toUpperCase() ?? ""}${check.slice(1)}: ${what}.`, remedy: cure }));
}

/** Worst first. Empty: all is well. */
export function healthReasons(known: Known): Reason[] {
  const reasons = connectionReasons(known);
  if (known.open && known.server?.connected) {
    if (known.silent_s !== null && known.silent_s > kSilent_s) reasons.push(bad(`No data since ${age(known.silent_s)}.`, "Cameras"));
    reasons.push(...findingReasons(known.findings), ...takeReasons(known.health));
  }
  const rank: Record<Level, number> = { bad: 0, look: 1, good: 2 };
  return reasons.sort((a, b) => rank[a.level] - rank[b.level]);
}

export function worst(judged: readonly { level: Level }[]): Level {
  if (judged.some(({ level }) => level === "bad")) return "bad";
  return judged.some(({ level }) => level === "look") ? "look" : "good";
}
