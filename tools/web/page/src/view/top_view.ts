// The volume from above on a 2D canvas: for browsers without WebGL, and for those who prefer a map. x is up, y is left.

import type { Vec3 } from "../model/camera_view";
import type { SceneFrame } from "../model/scene_frame";
import { ellipseFromAbove, enlargement, ofSelected, type Sighting } from "../model/sightings";
import { clearedContext } from "./canvas_size";
import { drawMark } from "./marks";
import { type Palette, readPalette, subjectColour } from "./palette";
import type { SceneContent, SceneOptions, SceneView, Selected } from "./scene_view";

const kBorder = 0.9;

export class TopView implements SceneView {
  private palette: Palette = readPalette();
  private content: SceneContent = { cameras: [], troubled: new Set(), names: { subjects: [], markers: [] } };
  private options: SceneOptions = { cameras: true, trails: false, names: false, volume: false, rays: false, follow: null };
  private selected: Selected | null = null;
  private frame: SceneFrame | null = null;
  private sightings: Sighting[] = [];
  private readonly resizeWatch = new ResizeObserver(() => this.draw());

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.resizeWatch.observe(canvas);
  }

  describe(content: SceneContent): void {
    this.content = content;
    this.draw();
  }

  setOptions(options: SceneOptions): void {
    this.options = options;
    this.draw();
  }

  select(selected: Selected | null): void {
    this.selected = selected;
    this.draw();
  }

  show(frame: SceneFrame): void {
    this.frame = frame;
    this.draw();
  }

  sight(sightings: Sighting[]): void {
    this.sightings = sightings;
    if (sightings.length === 0) this.draw();
  }

  fit(): void {
    this.draw();
  }

  recolour(): void {
    this.palette = readPalette();
    this.draw();
  }

  dispose(): void {
    this.resizeWatch.disconnect();
  }

  private draw(): void {
    const cleared = clearedContext(this.canvas);
    if (!cleared) return;
    const { context, width, height } = cleared;
    const centre = (this.options.follow === null ? null : this.frame?.roots_m[this.options.follow]) ?? [0, 0, 0];
    const radius_m = Math.max(2.5, ...this.content.cameras.map((camera) => Math.max(Math.abs(camera.centre_m[0]), Math.abs(camera.centre_m[1]))));
    const scale = (kBorder * Math.min(width, height)) / (2 * radius_m);
    const at = ([x, y]: Vec3): [number, number] => [width / 2 - (y - centre[1]) * scale, height / 2 - (x - centre[0]) * scale];

    this.drawGrid(context, at, radius_m);
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    if (this.options.cameras) this.drawCameras(context, at);
    if (!this.frame) return;
    for (const sighting of ofSelected(this.sightings, this.selected)) this.drawSighting(context, at, scale, sighting);
    for (const bone of this.frame.bones) {
      context.strokeStyle = subjectColour(this.palette, bone.subject);
      context.lineWidth = bone.filled ? 1.5 : 3;
      line(context, at(bone.from_m), at(bone.to_m));
    }
    for (const marker of this.frame.markers) {
      const chosen = this.selected?.subject === marker.subject && this.selected.marker === marker.index;
      drawMark(context, at(marker.at_m), marker.state, chosen ? 5 : 3, this.palette, marker.subject);
      if ((chosen || this.options.names) && marker.subject >= 0) this.write(context, this.content.names.markers[marker.subject]?.[marker.index] ?? "", at(marker.at_m));
    }
    this.frame.roots_m.forEach((root, subject) => root && this.write(context, this.content.names.subjects[subject] ?? "", at(root), 22));
  }

  private drawGrid(context: CanvasRenderingContext2D, at: (point: Vec3) => [number, number], radius_m: number): void {
    const cells = Math.ceil(radius_m) + 1;
    context.lineWidth = 1;
    for (let i = -cells; i <= cells; i++) {
      context.strokeStyle = i === 0 ? this.palette.faint : this.palette.grid;
      line(context, at([i, -cells, 0]), at([i, cells, 0]));
      line(context, at([-cells, i, 0]), at([cells, i, 0]));
    }
  }

  private drawCameras(context: CanvasRenderingContext2D, at: (point: Vec3) => [number, number]): void {
    for (const camera of this.content.cameras) {
      const colour = this.content.troubled.has(camera.name) ? this.palette.bad : this.palette.faint;
      context.strokeStyle = colour;
      context.lineWidth = 1.5;
      const middle = camera.height_px / 2;
      const [left, right] = [camera.unproject(0, middle, 0.8), camera.unproject(camera.width_px, middle, 0.8)];
      line(context, at(camera.centre_m), at(left));
      line(context, at(camera.centre_m), at(right));
      line(context, at(left), at(right));
      context.fillStyle = colour;
      const [u, v] = at(camera.centre_m);
      context.fillText(camera.name, u, v - 6);
    }
  }

  private drawSighting(context: CanvasRenderingContext2D, at: (point: Vec3) => [number, number], scale: number, sighting: Sighting): void {
    context.strokeStyle = context.fillStyle = sighting.subject < 0 ? this.palette.unlabelled : subjectColour(this.palette, sighting.subject);
    context.globalAlpha = 0.35;
    context.lineWidth = 1;
    for (const camera of sighting.cameras) {
      if (this.content.cameras[camera]?.calibrated) line(context, at(this.content.cameras[camera].centre_m), at(sighting.at_m));
    }
    if (sighting.spread_m) {
      const { long, short, turn_rad } = ellipseFromAbove(sighting.spread_m);
      const size = scale * enlargement(sighting);
      context.beginPath();
      context.ellipse(...at(sighting.at_m), size * long, size * short, turn_rad, 0, 2 * Math.PI);
      context.fill();
    }
    context.globalAlpha = 1;
  }

  private write(context: CanvasRenderingContext2D, text: string, [u, v]: [number, number], above_px = 8): void {
    context.fillStyle = this.palette.ink;
    context.fillText(text, u, v - above_px);
  }
}

function line(context: CanvasRenderingContext2D, from: [number, number], to: [number, number]): void {
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.stroke();
}
