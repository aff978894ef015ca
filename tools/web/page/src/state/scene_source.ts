// Where a picture of the volume takes its data from: the live feed, or a take.

import type { ReadonlySignal } from "@preact/signals";
import type { Description } from "../../gen/mocap/v1/description_pb";
import type { Health } from "../../gen/mocap/v1/health_pb";
import { type Sightings, SightingsSchema } from "../../gen/mocap/v1/sightings_pb";
import type { Snapshot } from "../../gen/mocap/v1/snapshot_pb";
import * as live from "./live";

export interface SceneSource {
  readonly description: ReadonlySignal<Description | null>;
  /** A few times a second, for texts. */
  readonly snapshot: ReadonlySignal<Snapshot | null>;
  newest(): Snapshot | null;
  /** Null: unknown. */
  health(): Health | null;
  /** Calls `draw` when the newest snapshot is another one. Returns the function that ends it. */
  onFrame(draw: () => void): () => void;
  /** Calls `draw` with sightings about as often as onFrame. Absent: the source has none. Returns the function that ends it. */
  onSightings?(draw: (sightings: Sightings) => void): () => void;
}

function onSightings(draw: (sightings: Sightings) => void): () => void {
  return live.onTopic("sightings", (payload) => {
    const received = live.decode(SightingsSchema, payload);
    if (received) draw(received);
  });
}

export const liveSource: SceneSource = {
  description: live.description, snapshot: live.snapshot, newest: live.newestSnapshot, health: () => live.health.value, onFrame: live.onFrame, onSightings,
};
