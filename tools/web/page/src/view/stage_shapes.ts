// Shapes of the stage: their geometry, and the columns of many equal ones.

import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, InstancedMesh, type LineSegments, type Material, OctahedronGeometry } from "three";
import type { CameraView, Vec3 } from "../model/camera_view";

const kFrustum_m = 0.45;

export function instances(geometry: BufferGeometry, material: Material, count: number): InstancedMesh {
  const mesh = new InstancedMesh(geometry, material, count);
  mesh.instanceMatrix.setUsage(DynamicDrawUsage);
  mesh.setColorAt(0, new Color());
  mesh.frustumCulled = false;
  mesh.count = 0;
  return mesh;
}

export function finish(mesh: InstancedMesh, count: number): void {
  mesh.count = count;
  mesh.instanceMatrix.clearUpdateRanges();
  mesh.instanceMatrix.addUpdateRange(0, 16 * count);
  mesh.instanceMatrix.needsUpdate = true;
  if (!mesh.instanceColor) return;
  mesh.instanceColor.clearUpdateRanges();
  mesh.instanceColor.addUpdateRange(0, 3 * count);
  mesh.instanceColor.needsUpdate = true;
}

export function emptyLines(count: number): BufferGeometry {
  const column = () => new BufferAttribute(new Float32Array(6 * count), 3).setUsage(DynamicDrawUsage);
  return new BufferGeometry().setAttribute("position", column()).setAttribute("color", column());
}

/** Draws the first `vertices` of the columns that emptyLines made. */
export function finishLines(lines: LineSegments, vertices: number): void {
  lines.geometry.setDrawRange(0, vertices);
  for (const name of ["position", "color"]) {
    const column = lines.geometry.getAttribute(name) as BufferAttribute;
    column.clearUpdateRanges();
    column.addUpdateRange(0, 3 * vertices);
    column.needsUpdate = true;
  }
}

/** A four-sided double pyramid from the origin to z = 1, widest near its joint. */
export function boneGeometry(): BufferGeometry {
  const geometry = new OctahedronGeometry(1).toNonIndexed();
  const position = geometry.getAttribute("position") as BufferAttribute;
  for (let i = 0; i < position.count; i++) {
    const y = position.getY(i);
    position.setXYZ(i, position.getX(i), position.getZ(i), y > 0.5 ? 1 : y < -0.5 ? 0 : 0.18);
  }
  // The swap of two axes mirrors the shape: turn each triangle round.
  const array = position.array as Float32Array;
  for (let i = 0; i < array.length; i += 9) for (let k = 0; k < 3; k++) [array[i + 3 + k], array[i + 6 + k]] = [array[i + 6 + k], array[i + 3 + k]];
  geometry.computeVertexNormals();
  return geometry;
}

export function replaceLines(lines: LineSegments, points: number[], colours: number[]): void {
  lines.geometry.dispose();
  lines.geometry = new BufferGeometry()
    .setAttribute("position", new BufferAttribute(new Float32Array(points), 3))
    .setAttribute("color", new BufferAttribute(new Float32Array(colours), 3));
}

export function frustumLines(camera: CameraView): [Vec3, Vec3][] {
  if (!camera.calibrated) return [];
  const right = camera.width_px - 0.5;
  const bottom = camera.height_px - 0.5;
  const corners = ([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]] as const).map(([u, v]) => camera.unproject(u, v, kFrustum_m));
  return corners.flatMap((corner, i) => [[camera.centre_m, corner], [corner, corners[(i + 1) % 4]]] as [Vec3, Vec3][]);
}
