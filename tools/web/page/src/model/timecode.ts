// The time that the header shows: the timecode of the exposure, or the time of day of the exposure in UTC.

import type { Snapshot, Timecode } from "../../gen/mocap/v1/snapshot_pb";
import { timeOfDay } from "./format";

const pad = (value: number): string => String(value).padStart(2, "0");

/** "01:02:03:04"; ";" before the frame of drop-frame timecode, as SMPTE ST 12-1 users write it. */
export function timecodeText(code: Timecode): string {
  return `${pad(code.hours)}:${pad(code.minutes)}:${pad(code.seconds)}${code.dropFrame ? ";" : ":"}${pad(code.frames)}`;
}

/** UTC of the exposure; null if the feed does not say how its clock relates to UTC. */
export function exposedUtc_ms(snapshot: Snapshot): number | null {
  if (!snapshot.instants || snapshot.utcMinusHostNs === undefined) return null;
  return Number((snapshot.instants.exposedAtNs + snapshot.utcMinusHostNs) / 1000n) / 1000;
}

export function shownTime(snapshot: Snapshot | null): { text: string; source: string } {
  if (snapshot?.timecode) return { text: timecodeText(snapshot.timecode), source: `TC ${snapshot.timecode.framesPerSecond}` };
  const utc_ms = snapshot ? exposedUtc_ms(snapshot) : null;
  return utc_ms === null ? { text: "--:--:--", source: "no time" } : { text: timeOfDay(utc_ms), source: "UTC" };
}
