// One camera: the markers of the snapshot as this camera sees them, its image if previews are on, and its figures.

import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { type CameraHealth, CameraPhase } from "../../gen/mocap/v1/health_pb";
import type { CameraView } from "../model/camera_view";
import { fixed, kUnknown } from "../model/format";
import { type Level, cameraPhaseText } from "../model/health_report";
import { sceneFrame } from "../model/scene_frame";
import { description, health, newestSnapshot, onFrame, snapshot } from "../state/live";
import { addressOf } from "../state/route";
import { clearedContext } from "../view/canvas_size";
import { drawMark } from "../view/marks";
import { type Palette, readPalette } from "../view/palette";
import { useSeen, useTheme } from "./hooks";
import { LevelPill } from "./level_mark";

const kDrawEvery_ms = 100;

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

function drawMarkers(context: CanvasRenderingContext2D, camera: CameraView, width: number, height: number, palette: Palette): void {
  const newest = newestSnapshot();
  const described = description.peek();
  if (!newest || !described || !camera.calibrated) return;
  const scale = Math.min(width / camera.width_px, height / camera.height_px);
  const [left, top] = [(width - scale * camera.width_px) / 2, (height - scale * camera.height_px) / 2];
  for (const marker of sceneFrame(described, newest, health.peek()).markers) {
    const at = camera.project(marker.at_m);
    if (at) drawMark(context, [left + scale * (at[0] + 0.5), top + scale * (at[1] + 0.5)], marker.state, Math.max(2, width / 130), palette, marker.subject);
  }
}

export function CameraPicture({ camera }: { camera: CameraView }): JSX.Element {
  const box = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const seen = useSeen(box);
  const palette = useRef<Palette>(readPalette());
  useTheme(() => (palette.current = readPalette()));
  useEffect(() => {
    if (!seen) return undefined;
    let drawn_ms = -Infinity;
    return onFrame(() => {
      const now = performance.now();
      if (now - drawn_ms < kDrawEvery_ms) return;
      drawn_ms = now;
      const cleared = canvas.current && clearedContext(canvas.current);
      if (cleared) drawMarkers(cleared.context, camera, cleared.width, cleared.height, palette.current);
    });
  }, [seen, camera]);
  return (
    <div class="picture" ref={box}>
      <canvas ref={canvas} role="img" aria-label={`Markers as camera ${camera.name} sees them`} />
      {!camera.calibrated && <span class="note">not calibrated</span>}
    </div>
  );
}

export function CameraTile({ camera, index }: { camera: CameraView; index: number }): JSX.Element {
  const state = health.value?.cameras.find((candidate) => candidate.name === camera.name);
  const level = cameraLevel(state);
  const blobs = blobsOf(index);
  return (
    <article class={`panel tile ${level === "bad" ? "troubled" : ""}`} aria-label={`Camera ${camera.name}`}>
      <CameraPicture camera={camera} />
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
