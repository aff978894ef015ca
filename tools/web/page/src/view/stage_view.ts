// The volume in three dimensions, drawn with WebGL. Draws only when a snapshot came or the view moved.

import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, GridHelper, InstancedMesh, LineBasicMaterial, LineSegments,
  type Material, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, OctahedronGeometry, PerspectiveCamera, Quaternion, Scene, SphereGeometry,
  BoxGeometry, TorusGeometry, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Vec3 } from "../model/camera_view";
import type { DrawnMarker, DrawnState, SceneFrame } from "../model/scene_frame";
import { seenVolume } from "../model/seen_volume";
import { ofSelected, type Sighting } from "../model/sightings";
import { boxSize, clearedContext } from "./canvas_size";
import { type Palette, readPalette, subjectColour } from "./palette";
import type { SceneContent, SceneOptions, SceneView, Selected } from "./scene_view";
import { SightingMarks } from "./sighting_marks";
import { boneGeometry, emptyLines, finish, finishLines, frustumLines, instances, replaceLines } from "./stage_shapes";
import { Trails } from "./trails";

const kMaxMarkers = 1024;
const kMaxBones = 2048;
// Forty of each marker of sixteen subjects.
const kMaxTrailLines = 40 * 656;
const kMarkerRadius_m = 0.018;
const kFollowShare = 0.15;
const kPick_px = 14;
// Without a graphics processor a picture costs the processor some 50 ms, which other programs on this machine need.
const kSoftwareEvery_ms = 100;
const kSoftware = /swiftshader|llvmpipe|softpipe|software/i;
const kShapes: DrawnState[] = ["measured", "filled", "unlabelled", "missing"];

const vector = ([x, y, z]: Vec3): Vector3 => new Vector3(x, y, z);

export class StageView implements SceneView {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly eye = new PerspectiveCamera(45, 1, 0.05, 200);
  private readonly controls: OrbitControls;
  private readonly markers: Record<DrawnState, InstancedMesh>;
  private readonly bones: InstancedMesh;
  private readonly trailLines: LineSegments;
  private readonly trails = new Trails();
  private readonly frusta = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ vertexColors: true }));
  private readonly volume = new Mesh(new BufferGeometry(), new MeshBasicMaterial({ transparent: true, opacity: 0.07, side: DoubleSide, depthWrite: false }));
  private readonly sightingMarks = new SightingMarks();
  private sightings: Sighting[] = [];
  private grid: GridHelper | null = null;
  private palette: Palette = readPalette();
  private content: SceneContent = { cameras: [], troubled: new Set(), names: { subjects: [], markers: [] } };
  private options: SceneOptions = { cameras: true, trails: false, names: false, volume: false, rays: false, follow: null };
  private selected: Selected | null = null;
  private frame: SceneFrame | null = null;
  private readonly drawEvery_ms: number;
  private drawnAt_ms = -Infinity;
  private scheduled = false;
  private fitted = false;
  private downAt: [number, number] = [0, 0];
  private readonly resizeWatch: ResizeObserver;

  /** Throws if there is no WebGL. `overlay` lies over `canvas` and shows names. */
  constructor(private readonly canvas: HTMLCanvasElement, private readonly overlay: HTMLCanvasElement, private readonly onPick: (picked: Selected | null) => void) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.drawEvery_ms = kSoftware.test(rendererName(this.renderer)) ? kSoftwareEvery_ms : 0;
    this.eye.up.set(0, 0, 1);
    this.eye.position.set(5, -4, 3);
    this.controls = new OrbitControls(this.eye, canvas);
    this.controls.target.set(0, 0, 0.9);
    this.controls.maxPolarAngle = Math.PI * 0.55;
    this.controls.minDistance = 0.5;
    this.controls.maxDistance = 40;
    this.controls.addEventListener("change", this.schedule);
    this.controls.update();

    this.markers = {
      measured: instances(new SphereGeometry(kMarkerRadius_m, 10, 8), new MeshLambertMaterial(), kMaxMarkers),
      filled: instances(new OctahedronGeometry(kMarkerRadius_m * 1.3), new MeshBasicMaterial({ wireframe: true }), kMaxMarkers),
      unlabelled: instances(new BoxGeometry(1.6 * kMarkerRadius_m, 1.6 * kMarkerRadius_m, 1.6 * kMarkerRadius_m), new MeshLambertMaterial(), kMaxMarkers),
      missing: instances(new TorusGeometry(kMarkerRadius_m * 1.8, 0.005, 6, 20), new MeshBasicMaterial(), kMaxMarkers),
    };
    this.bones = instances(boneGeometry(), new MeshLambertMaterial({ transparent: true, opacity: 0.9 }), kMaxBones);
    this.trailLines = new LineSegments(emptyLines(kMaxTrailLines), new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.7 }));
    for (const lines of [this.trailLines, this.frusta]) lines.frustumCulled = false;
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(2, -3, 6);
    this.scene.add(new AmbientLight(0xffffff, 1.6), sun, ...Object.values(this.markers), this.bones, this.trailLines, this.frusta, this.volume, this.sightingMarks.group);
    this.recolour();

    this.resizeWatch = new ResizeObserver(this.schedule);
    this.resizeWatch.observe(canvas);
    canvas.addEventListener("pointerdown", this.onDown);
    canvas.addEventListener("pointerup", this.onUp);
  }

  describe(content: SceneContent): void {
    this.content = content;
    this.drawFrusta();
    this.drawVolume();
    this.schedule();
  }

  setOptions(options: SceneOptions): void {
    const volumeChanged = options.volume !== this.options.volume;
    if (!options.trails) this.trails.clear();
    this.options = options;
    if (volumeChanged) this.drawVolume();
    this.frusta.visible = options.cameras;
    this.schedule();
  }

  select(selected: Selected | null): void {
    this.selected = selected;
    this.schedule();
  }

  show(frame: SceneFrame): void {
    this.frame = frame;
    if (this.options.trails) this.trails.add(frame.markers, performance.now());
    if (!this.fitted && frame.roots_m.some((root) => root !== null)) this.fit();
    this.follow(frame);
    this.draw();
  }

  sight(sightings: Sighting[]): void {
    this.sightings = sightings;
    if (sightings.length === 0) this.schedule();
  }

  fit(): void {
    const roots = this.frame?.roots_m.filter((root): root is Vec3 => root !== null) ?? [];
    const places = this.content.cameras.map((camera) => camera.centre_m);
    this.fitted = roots.length > 0;
    const radius = Math.max(2, ...places.map(([x, y]) => Math.hypot(x, y)));
    const target = roots.length > 0 ? vector(roots[0]) : new Vector3(0, 0, 0.9);
    target.z = 0.85;
    const narrow = this.canvas.clientWidth < this.canvas.clientHeight ? 1.35 : 1;
    const away = Math.min(1.25 * radius, 8) * narrow;
    this.controls.target.copy(target);
    this.eye.position.set(target.x + 0.8 * away, target.y - 0.55 * away, target.z + 0.42 * away);
    this.controls.update();
    this.schedule();
  }

  recolour(): void {
    this.palette = readPalette();
    if (this.grid) {
      this.scene.remove(this.grid);
      this.grid.dispose();
    }
    this.grid = new GridHelper(12, 12, this.palette.line, this.palette.grid);
    this.grid.rotation.x = Math.PI / 2;
    this.scene.add(this.grid);
    (this.volume.material as MeshBasicMaterial).color.set(this.palette.accent);
    this.drawFrusta();
    this.schedule();
  }

  dispose(): void {
    this.resizeWatch.disconnect();
    this.canvas.removeEventListener("pointerdown", this.onDown);
    this.canvas.removeEventListener("pointerup", this.onUp);
    this.controls.dispose();
    this.grid?.dispose();
    for (const mesh of [...Object.values(this.markers), this.bones, this.trailLines, this.frusta, this.volume]) {
      mesh.geometry.dispose();
      (mesh.material as Material).dispose();
      if (mesh instanceof InstancedMesh) mesh.dispose();
    }
    this.sightingMarks.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  private readonly schedule = (): void => {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      if (this.scheduled) this.draw();
    });
  };

  private draw(): void {
    this.scheduled = false;
    if (performance.now() - this.drawnAt_ms < this.drawEvery_ms) {
      this.schedule();
      return;
    }
    this.drawnAt_ms = performance.now();
    const { width, height, ratio: full } = boxSize(this.canvas);
    const ratio = this.drawEvery_ms > 0 ? 1 : full;
    if (this.canvas.width !== Math.floor(width * ratio) || this.canvas.height !== Math.floor(height * ratio)) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height, false);
      this.eye.aspect = width / height;
      this.eye.updateProjectionMatrix();
    }
    if (this.frame) this.place(this.frame);
    this.sightingMarks.show(ofSelected(this.sightings, this.selected), this.content.cameras, this.palette);
    this.renderer.render(this.scene, this.eye);
    this.drawNames();
  }

  private follow(frame: SceneFrame): void {
    const root = this.options.follow === null ? null : frame.roots_m[this.options.follow];
    if (!root) return;
    const move = vector(root).sub(this.controls.target);
    move.z = 0;
    move.multiplyScalar(kFollowShare);
    this.controls.target.add(move);
    this.eye.position.add(move);
    this.eye.lookAt(this.controls.target);
  }

  private colourOf(marker: DrawnMarker): string {
    if (this.selected && marker.subject === this.selected.subject && marker.index === this.selected.marker) return this.palette.ink;
    if (marker.state === "unlabelled") return this.palette.unlabelled;
    if (marker.state === "missing") return this.palette.missing;
    return subjectColour(this.palette, marker.subject);
  }

  private place(frame: SceneFrame): void {
    const counts: Record<DrawnState, number> = { measured: 0, filled: 0, unlabelled: 0, missing: 0 };
    const matrix = new Matrix4();
    const colour = new Color();
    for (const marker of frame.markers) {
      const mesh = this.markers[marker.state];
      const i = counts[marker.state];
      if (i >= kMaxMarkers) continue;
      counts[marker.state]++;
      mesh.setMatrixAt(i, matrix.makeTranslation(...marker.at_m));
      mesh.setColorAt(i, colour.set(this.colourOf(marker)));
    }
    for (const shape of kShapes) finish(this.markers[shape], counts[shape]);
    this.placeBones(frame);
    this.placeTrails();
  }

  private placeBones(frame: SceneFrame): void {
    const matrix = new Matrix4();
    const along = new Vector3();
    const turn = new Quaternion();
    const up = new Vector3(0, 0, 1);
    const colour = new Color();
    let count = 0;
    for (const bone of frame.bones) {
      if (count >= kMaxBones) break;
      along.set(bone.to_m[0] - bone.from_m[0], bone.to_m[1] - bone.from_m[1], bone.to_m[2] - bone.from_m[2]);
      const length = along.length();
      if (length < 1e-4) continue;
      const width = Math.min(0.05, 0.16 * length + 0.008) * (bone.filled ? 0.55 : 1);
      turn.setFromUnitVectors(up, along.divideScalar(length));
      matrix.compose(vector(bone.from_m), turn, new Vector3(width, width, length));
      this.bones.setMatrixAt(count, matrix);
      this.bones.setColorAt(count, colour.set(subjectColour(this.palette, bone.subject)));
      count++;
    }
    finish(this.bones, count);
  }

  private placeTrails(): void {
    const points = this.trailLines.geometry.getAttribute("position") as BufferAttribute;
    const colours = this.trailLines.geometry.getAttribute("color") as BufferAttribute;
    const colour = new Color();
    let vertex = 0;
    const add = (at_m: Vec3) => {
      points.setXYZ(vertex, ...at_m);
      colours.setXYZ(vertex, colour.r, colour.g, colour.b);
      vertex++;
    };
    if (this.options.trails) {
      for (const trail of this.trails.all()) {
        colour.set(subjectColour(this.palette, trail.subject));
        for (let i = 1; i < trail.points_m.length && vertex < 2 * kMaxTrailLines; i++) {
          add(trail.points_m[i - 1]);
          add(trail.points_m[i]);
        }
      }
    }
    this.trailLines.visible = vertex > 0;
    finishLines(this.trailLines, vertex);
  }

  private drawFrusta(): void {
    const points: number[] = [];
    const colours: number[] = [];
    for (const camera of this.content.cameras) {
      const colour = new Color(this.content.troubled.has(camera.name) ? this.palette.bad : this.palette.faint);
      for (const [from, to] of frustumLines(camera)) {
        points.push(...from, ...to);
        colours.push(colour.r, colour.g, colour.b, colour.r, colour.g, colour.b);
      }
    }
    replaceLines(this.frusta, points, colours);
  }

  private drawVolume(): void {
    this.volume.visible = this.options.volume;
    if (!this.options.volume) return;
    const points = seenVolume(this.content.cameras).faces.flatMap(([a, b, c, d]) => [...a, ...b, ...c, ...a, ...c, ...d]);
    this.volume.geometry.dispose();
    this.volume.geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  }

  /** Pixels of the canvas; null behind the eye. */
  private onScreen([x, y, z]: Vec3): [number, number] | null {
    const seen = new Vector3(x, y, z).project(this.eye);
    return seen.z > 1 ? null : [(0.5 + seen.x / 2) * this.canvas.clientWidth, (0.5 - seen.y / 2) * this.canvas.clientHeight];
  }

  private drawNames(): void {
    const cleared = clearedContext(this.overlay);
    if (!cleared) return;
    const { context } = cleared;
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    context.lineJoin = "round";
    const write = (text: string, at_m: Vec3, above_px: number, colour: string) => {
      const at = this.onScreen(at_m);
      if (!at || !text) return;
      context.strokeStyle = this.palette.surface;
      context.lineWidth = 3;
      context.strokeText(text, at[0], at[1] - above_px);
      context.fillStyle = colour;
      context.fillText(text, at[0], at[1] - above_px);
    };
    if (this.options.cameras) for (const camera of this.content.cameras) write(camera.name, camera.centre_m, 8, this.content.troubled.has(camera.name) ? this.palette.bad : this.palette.faint);
    if (!this.frame) return;
    this.frame.roots_m.forEach((root, subject) => {
      if (!root) return;
      const top = Math.max(root[2], ...this.frame!.markers.filter((marker) => marker.subject === subject && marker.state !== "missing").map((marker) => marker.at_m[2]));
      write(this.content.names.subjects[subject] ?? "", [root[0], root[1], top], 18, this.palette.ink);
    });
    for (const marker of this.frame.markers) {
      const chosen = this.selected !== null && marker.subject === this.selected.subject && marker.index === this.selected.marker;
      if (marker.subject < 0 || !(chosen || this.options.names || marker.state === "missing")) continue;
      write(this.content.names.markers[marker.subject]?.[marker.index] ?? "", marker.at_m, 9, marker.state === "missing" ? this.palette.missing : this.palette.ink);
    }
  }

  private readonly onDown = (event: PointerEvent): void => {
    this.downAt = [event.clientX, event.clientY];
  };

  /** A click, not the end of a turn of the view, selects the nearest labelled marker. */
  private readonly onUp = (event: PointerEvent): void => {
    if (Math.hypot(event.clientX - this.downAt[0], event.clientY - this.downAt[1]) > 4) return;
    const box = this.canvas.getBoundingClientRect();
    let nearest_px = kPick_px;
    let picked: Selected | null = null;
    for (const marker of this.frame?.markers ?? []) {
      const at = marker.subject < 0 ? null : this.onScreen(marker.at_m);
      if (!at) continue;
      const distance_px = Math.hypot(at[0] - (event.clientX - box.left), at[1] - (event.clientY - box.top));
      if (distance_px >= nearest_px) continue;
      nearest_px = distance_px;
      picked = { subject: marker.subject, marker: marker.index };
    }
    this.onPick(picked);
  };
}

function rendererName(renderer: WebGLRenderer): string {
  const context = renderer.getContext();
  const info = context.getExtension("WEBGL_debug_renderer_info");
  return String(context.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : context.RENDERER));
}
