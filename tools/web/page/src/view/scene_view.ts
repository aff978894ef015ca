// A picture of the volume. Two implementations: three dimensions with WebGL, and a top view that needs only a 2D canvas.

import type { CameraView } from "../model/camera_view";
import type { SceneFrame } from "../model/scene_frame";
import type { Sighting } from "../model/sightings";

export interface SceneOptions {
  cameras: boolean;
  trails: boolean;
  /** Names of labelled markers. */
  names: boolean;
  /** The volume that at least three cameras see. */
  volume: boolean;
  /** Rays of the cameras to the markers, and the covariances of the markers. */
  rays: boolean;
  /** Index of the subject that stays in the centre; null: none. */
  follow: number | null;
}

export interface Selected {
  subject: number;
  marker: number;
}

export interface SceneNames {
  subjects: string[];
  /** By subject, then by marker. */
  markers: string[][];
}

export interface SceneContent {
  cameras: CameraView[];
  /** Names of cameras that need attention. */
  troubled: Set<string>;
  names: SceneNames;
}

export interface SceneView {
  describe(content: SceneContent): void;
  setOptions(options: SceneOptions): void;
  select(selected: Selected | null): void;
  show(frame: SceneFrame): void;
  /** Drawn with the next frame; empty: none, at once. */
  sight(sightings: Sighting[]): void;
  /** Moves the view so that cameras and subjects are in the picture. */
  fit(): void;
  /** Colours of the page changed. */
  recolour(): void;
  dispose(): void;
}
