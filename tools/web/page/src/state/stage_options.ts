// What the stage shows; kept in this browser.

import { effect, signal } from "@preact/signals";
import type { SceneOptions, Selected } from "../view/scene_view";
import { store, stored } from "./storage";
import { reducedMotion } from "./theme";

type Switch = "cameras" | "trails" | "names" | "volume" | "rays";

function read(): SceneOptions {
  const kept = new Set(stored("stage", reducedMotion.peek() ? "cameras" : "cameras,trails").split(","));
  return { cameras: kept.has("cameras"), trails: kept.has("trails"), names: kept.has("names"), volume: kept.has("volume"), rays: kept.has("rays"), follow: null };
}

export const stageOptions = signal<SceneOptions>(read());
export const selected = signal<Selected | null>(null);
/** The operator prefers the top view, also with WebGL. */
export const topView = signal(stored("view", "3d") === "top");

/** What the rays show, in words; empty while they are off. */
export const raysInWords = signal("");

/** Images of the cameras, on the strip of the stage and on the page Cameras. A preview costs the daemon time, so the strip is off at first. */
export const stripImages = signal(stored("strip-images", "off") === "on");
export const tileImages = signal(stored("tile-images", "on") === "on");

export const kSwitches: { name: Switch; text: string; key: string; hint: string }[] = [
  { name: "cameras", text: "Cameras", key: "c", hint: "Cameras and the pyramids that they see (C)" },
  { name: "trails", text: "Trails", key: "t", hint: "The last second of each marker (T)" },
  { name: "names", text: "Names", key: "l", hint: "Names of the labelled markers (L)" },
  { name: "volume", text: "Volume", key: "v", hint: "The volume that at least three cameras see (V)" },
  { name: "rays", text: "Rays", key: "r", hint: "Rays of the cameras that saw each marker, and how well its position is known (R)" },
];

export const toggle = (name: Switch): void => {
  stageOptions.value = { ...stageOptions.peek(), [name]: !stageOptions.peek()[name] };
};

/** Each call goes on to the next subject, then to none. */
export function followNext(subjects: number): void {
  const now = stageOptions.peek().follow;
  const next = now === null ? 0 : now + 1;
  stageOptions.value = { ...stageOptions.peek(), follow: next < subjects ? next : null };
}

export function startStageOptions(): void {
  effect(() => store("stage", kSwitches.map(({ name }) => name).filter((name) => stageOptions.value[name]).join(",")));
  effect(() => store("strip-images", stripImages.value ? "on" : "off"));
  effect(() => store("tile-images", tileImages.value ? "on" : "off"));
  effect(() => store("view", topView.value ? "top" : "3d"));
}
