// The picture of the volume with its switches and legend. Falls back to the top view where there is no WebGL.

import { useSignalEffect } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import type { CameraView } from "../model/camera_view";
import { sceneFrame } from "../model/scene_frame";
import { readSightings, sightingSummary } from "../model/sightings";
import { sceneSummary } from "../model/summary";
import { liveSource, type SceneSource } from "../state/scene_source";
import { followNext, kSwitches, raysInWords, selected, stageOptions, toggle, topView } from "../state/stage_options";
import type { SceneView } from "../view/scene_view";
import { StageView } from "../view/stage_view";
import { TopView } from "../view/top_view";
import { useCameras, useKeys, useTheme } from "./hooks";
import { SceneLegend } from "./scene_legend";
import { Toggle } from "./small";

const troubled = (source: SceneSource) => new Set(source.health()?.cameras.filter((camera) => camera.bumped).map((camera) => camera.name) ?? []);

/** Returns null without WebGL. */
function makeStage(canvas: HTMLCanvasElement, overlay: HTMLCanvasElement): SceneView | null {
  try {
    return new StageView(canvas, overlay, (picked) => (selected.value = picked));
  } catch {
    return null;
  }
}

/** Draws each snapshot and follows switches, selection and description. */
function useView(source: SceneSource, view: { current: SceneView | null }, cameras: CameraView[], made: unknown): void {
  const troubledNames = [...troubled(source)].join("\n");
  useEffect(() => {
    const subjects = source.description.value?.subjects ?? [];
    view.current?.describe({
      cameras, troubled: troubled(source),
      names: { subjects: subjects.map((subject) => subject.name), markers: subjects.map((subject) => subject.markers.map((marker) => marker.name)) },
    });
  }, [source, cameras, troubledNames, made]);
  useEffect(() => {
    const show = () => {
      const newest = source.newest();
      const described = source.description.peek();
      if (newest && described) view.current?.show(sceneFrame(described, newest, source.health()));
    };
    show();
    return source.onFrame(show);
  }, [source, made]);
  useSignalEffect(() => view.current?.setOptions(stageOptions.value));
  useSignalEffect(() => view.current?.select(selected.value));
  useTheme(() => view.current?.recolour());
}

const kWords_ms = 1000;

/** Draws the sightings while the rays are on; otherwise the daemon makes none. */
function useSightings(source: SceneSource, view: { current: SceneView | null }, cameras: CameraView[], made: unknown): void {
  const on = stageOptions.value.rays;
  useEffect(() => {
    if (!on || !source.onSightings) return undefined;
    let said_ms = -Infinity;
    const end = source.onSightings((received) => {
      if (received.descriptionVersion !== source.description.peek()?.version) return;
      const sightings = readSightings(received, cameras.length);
      view.current?.sight(sightings);
      const now = performance.now();
      if (now - said_ms < kWords_ms) return;
      said_ms = now;
      raysInWords.value = sightingSummary(sightings);
    });
    return () => {
      end();
      view.current?.sight([]);
      raysInWords.value = "";
    };
  }, [on, source, cameras, made]);
}

function Tools({ source, flat, noWebGl, fit }: { source: SceneSource; flat: boolean; noWebGl: boolean; fit(): void }): JSX.Element {
  const subjects = source.description.value?.subjects ?? [];
  const followed = stageOptions.value.follow === null ? null : subjects[stageOptions.value.follow];
  return (
    <div class="tools" role="toolbar" aria-label="View">
      {kSwitches.filter(({ name }) => (name === "rays" ? source.onSightings : !flat || name === "cameras" || name === "names")).map(({ name, text, hint }) => (
        <Toggle key={name} text={text} hint={hint} on={stageOptions.value[name]} set={() => toggle(name)} />
      ))}
      <Toggle text={followed ? `Follow ${followed.name}` : "Follow"} hint="Keeps a subject in the centre; again for the next one (F)" on={followed !== null}
        set={() => followNext(subjects.length)} />
      <button class="button" type="button" title="Shows the whole volume (0)" onClick={fit}>Fit</button>
      <Toggle text="Top view" hint={noWebGl ? "This browser has no WebGL" : "A map in two dimensions (P)"} on={flat} set={(on) => !noWebGl && (topView.value = on)} />
    </div>
  );
}

export function ScenePanel({ plain = false, source = liveSource }: { plain?: boolean; source?: SceneSource }): JSX.Element {
  const canvas = useRef<HTMLCanvasElement>(null);
  const overlay = useRef<HTMLCanvasElement>(null);
  const view = useRef<SceneView | null>(null);
  const [noWebGl, setNoWebGl] = useState(false);
  const flat = topView.value || noWebGl;
  const cameras = useCameras(source.description.value);

  useEffect(() => {
    const made = flat ? new TopView(canvas.current!) : makeStage(canvas.current!, overlay.current!);
    if (!made) setNoWebGl(true);
    view.current = made;
    made?.setOptions(stageOptions.peek());
    made?.select(selected.peek());
    return () => {
      view.current = null;
      made?.dispose();
    };
  }, [flat]);
  useView(source, view, cameras, flat);
  useSightings(source, view, cameras, flat);
  useKeys(() => [
    ...kSwitches.filter(({ name }) => name !== "rays" || source.onSightings).map(({ name, key, hint }) => ({ key, shown: key.toUpperCase(), does: hint.replace(/ \(.\)$/, ""), run: () => toggle(name) })),
    { key: "f", shown: "F", does: "Follow the next subject", run: () => followNext(source.description.peek()?.subjects.length ?? 0) },
    { key: "0", shown: "0", does: "Show the whole volume", run: () => view.current?.fit() },
    { key: "p", shown: "P", does: "Top view or three dimensions", run: () => (topView.value = !topView.peek()) },
  ]);

  return (
    <figure class="panel view">
      {/* A canvas keeps its first kind of context: another view needs another canvas. */}
      <canvas key={flat ? "flat" : "deep"} ref={canvas} role="img" aria-label={sceneSummary(source.description.value, source.snapshot.value)} />
      <canvas ref={overlay} class="overlay" aria-hidden="true" />
      {!plain && <Tools source={source} flat={flat} noWebGl={noWebGl} fit={() => view.current?.fit()} />}
      {!plain && <SceneLegend rays={stageOptions.value.rays && source.onSightings !== undefined} />}
    </figure>
  );
}
