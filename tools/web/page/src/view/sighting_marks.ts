// Rays from the cameras to the markers that they saw, and the ellipsoids of the markers' covariances, in three dimensions.

import { type BufferAttribute, Color, Group, type InstancedMesh, LineBasicMaterial, LineSegments, Matrix4, MeshBasicMaterial, SphereGeometry } from "three";
import type { CameraView, Vec3 } from "../model/camera_view";
import { enlargement, type Sighting, type Spread } from "../model/sightings";
import { type Palette, subjectColour } from "./palette";
import { emptyLines, finish, finishLines, instances } from "./stage_shapes";

const kMaxMarkers = 1024;
const kMaxRays = 16 * kMaxMarkers;

/** Maps the unit sphere to the ellipsoid of `scale` standard deviations. */
function ellipsoid(into: Matrix4, [a, b, c]: Spread, scale: number, [x, y, z]: Vec3): Matrix4 {
  return into.set(scale * a[0], scale * b[0], scale * c[0], x, scale * a[1], scale * b[1], scale * c[1], y, scale * a[2], scale * b[2], scale * c[2], z, 0, 0, 0, 1);
}

export class SightingMarks {
  readonly group = new Group();
  private readonly rays: LineSegments;
  private readonly ellipsoids: InstancedMesh;

  constructor() {
    this.rays = new LineSegments(emptyLines(kMaxRays), new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.35, depthWrite: false }));
    this.ellipsoids = instances(new SphereGeometry(1, 16, 12), new MeshBasicMaterial({ transparent: true, opacity: 0.4, depthWrite: false }), kMaxMarkers);
    this.rays.frustumCulled = false;
    this.group.add(this.rays, this.ellipsoids);
    this.group.visible = false;
  }

  show(sightings: Sighting[], cameras: CameraView[], palette: Palette): void {
    this.group.visible = sightings.length > 0;
    if (sightings.length === 0) return;
    const colour = new Color();
    const matrix = new Matrix4();
    let vertices = 0;
    let count = 0;
    const points = this.rays.geometry.getAttribute("position") as BufferAttribute;
    const colours = this.rays.geometry.getAttribute("color") as BufferAttribute;
    for (const sighting of sightings) {
      colour.set(sighting.subject < 0 ? palette.unlabelled : subjectColour(palette, sighting.subject));
      for (const camera of sighting.cameras) {
        if (vertices >= 2 * kMaxRays || !cameras[camera]?.calibrated) continue;
        for (const end of [cameras[camera].centre_m, sighting.at_m]) {
          points.setXYZ(vertices, ...end);
          colours.setXYZ(vertices++, colour.r, colour.g, colour.b);
        }
      }
      if (!sighting.spread_m || count >= kMaxMarkers) continue;
      this.ellipsoids.setMatrixAt(count, ellipsoid(matrix, sighting.spread_m, enlargement(sighting), sighting.at_m));
      this.ellipsoids.setColorAt(count++, colour);
    }
    finish(this.ellipsoids, count);
    finishLines(this.rays, vertices);
  }

  dispose(): void {
    this.rays.geometry.dispose();
    (this.rays.material as LineBasicMaterial).dispose();
    this.ellipsoids.geometry.dispose();
    (this.ellipsoids.material as MeshBasicMaterial).dispose();
    this.ellipsoids.dispose();
  }
}
