// Over the whole view when what it shows is old: a frozen picture must not look live.

import type { JSX } from "preact";
import { CameraPhase } from "../../gen/mocap/v1/health_pb";
import { age } from "../model/format";
import { isTake } from "../state/route";
import { closedBecause, health, open, server, silent_s } from "../state/live";

const kSilent_s = 2;

function why(): string {
  if (!open.value) return `No connection to mocap-web: ${closedBecause.value}. Connecting again.`;
  if (!server.value) return "Waiting for mocap-web.";
  if (!server.value.connected) return server.value.reason || `mocap-web has no connection to mocapd at ${server.value.endpoint}.`;
  const cameras = health.value?.cameras ?? [];
  if (cameras.length > 0 && cameras.every((camera) => camera.phase === CameraPhase.STOPPED)) return "An operator stopped the cameras.";
  if (cameras.length > 0 && cameras.every((camera) => camera.phase === CameraPhase.ENDED)) return "The recording that is replayed has ended.";
  return "mocapd is connected but sends no snapshots.";
}

export function Silence(): JSX.Element | null {
  if (isTake()) return null; // The page says that it is not live.
  const silent = silent_s.value;
  const quiet = silent === null || silent > kSilent_s;
  if (open.value && server.value?.connected !== false && !quiet) return null;
  if (open.value && server.value === null && silent !== null && !quiet) return null;
  return (
    <div class="silence" role="alert">
      <strong>{silent === null ? "No data yet" : quiet ? `No data since ${age(Math.floor(silent))}` : "Connection lost"}</strong>
      <p>{why()}</p>
    </div>
  );
}
