// One camera: what it sees, and its figures.

import type { JSX } from "preact";
import { type CameraHealth, CameraPhase } from "../../gen/mocap/v1/health_pb";
import type { CameraView } from "../model/camera_view";
import { fixed, kUnknown } from "../model/format";
import { type Level, cameraPhaseText } from "../model/health_report";
import { health, snapshot } from "../state/live";
import { addressOf } from "../state/route";
import { CameraPicture } from "./camera_picture";
import { LevelPill } from "./level_mark";

export function cameraLevel(camera: CameraHealth | undefined): Level {
  if (!camera) return "look";
  if (camera.phase === CameraPhase.STOPPED || camera.phase === CameraPhase.ENDED || camera.phase === CameraPhase.STARTING) return "look";
  return camera.phase !== CameraPhase.STREAMING || camera.bumped ? "bad" : camera.synchronised === false ? "look" : "good";
}

export const cameraWord = (camera: CameraHealth | undefined): string =>
  !camera ? "no health yet" : camera.bumped ? "moved" : cameraPhaseText(camera.phase);

/** Number of blobs of this camera in the newest set; null: the camera has no image in this set. */
export function blobsOf(index: number): number | null {
  const views = snapshot.value?.views;
  const at = views?.cameras.indexOf(index) ?? -1;
  return views && at >= 0 ? (views.blobs[at] ?? null) : null;
}

/** `images`: previews are wanted. */
export function CameraTile({ camera, index, images }: { camera: CameraView; index: number; images: boolean }): JSX.Element {
  const state = health.value?.cameras.find((candidate) => candidate.name === camera.name);
  const level = cameraLevel(state);
  const blobs = blobsOf(index);
  return (
    <article class={`panel tile ${level === "bad" ? "troubled" : ""}`} aria-label={`Camera ${camera.name}`}>
      <CameraPicture camera={camera} images={images} />
      <div class="about">
        <header>
          <a href={addressOf("cameras", camera.name)}>{camera.name}</a>
          <LevelPill level={level} text={cameraWord(state)} />
        </header>
        <div class="figures">
          <span title="Blobs in the newest set">{blobs === null ? kUnknown : blobs} blobs</span>
          <span title="Images a second">{fixed(state?.rateHz, 0, "Hz")}</span>
          <span title="Blobs that are views of a 3D marker, over the last second">{state?.markerShare === undefined ? kUnknown : `${Math.round(100 * state.markerShare)}\u2009%`} used</span>
        </div>
      </div>
    </article>
  );
}
