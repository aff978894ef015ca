// The camera model of the feed: a point of the world in pixels, and the camera's place in the world.

import { type Camera, LensKind } from "../../gen/mocap/v1/description_pb";

export type Vec3 = [number, number, number];

/** A row-major rotation matrix. */
export type Rotation = [number, number, number, number, number, number, number, number, number];

export function rotationOf(x: number, y: number, z: number, w: number): Rotation {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
    2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
    2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
  ];
}

export function rotate(r: Rotation, [x, y, z]: Vec3): Vec3 {
  return [r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z, r[6] * x + r[7] * y + r[8] * z];
}

export function rotateBack(r: Rotation, [x, y, z]: Vec3): Vec3 {
  return [r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z];
}

// A point nearer than this to the plane of the camera has no useful projection.
const kNearest_m = 0.05;

export class CameraView {
  readonly name: string;
  readonly width_px: number;
  readonly height_px: number;
  /** Of the camera in the world. */
  readonly centre_m: Vec3;
  private readonly cameraFromWorld: Rotation;
  private readonly translation_m: Vec3;

  constructor(private readonly camera: Camera) {
    const q = camera.cameraFromWorldRotation;
    const t = camera.cameraFromWorldTranslationM;
    this.name = camera.name;
    this.width_px = camera.widthPx;
    this.height_px = camera.heightPx;
    this.cameraFromWorld = q ? rotationOf(q.x, q.y, q.z, q.w) : rotationOf(0, 0, 0, 1);
    this.translation_m = t ? [t.x, t.y, t.z] : [0, 0, 0];
    const [x, y, z] = rotateBack(this.cameraFromWorld, this.translation_m);
    this.centre_m = [-x, -y, -z];
  }

  /** True if the description has an image size and a lens. */
  get calibrated(): boolean {
    return this.width_px > 0 && this.height_px > 0 && this.camera.fxPx > 0 && this.camera.cameraFromWorldRotation !== undefined;
  }

  /** Pixels, from the centre of the top-left one; null outside the image. */
  project(point_m: Vec3): [number, number] | null {
    const [x, y, z] = rotate(this.cameraFromWorld, point_m);
    const depth = z + this.translation_m[2];
    if (depth < kNearest_m) return null;
    const [a, b] = this.distort((x + this.translation_m[0]) / depth, (y + this.translation_m[1]) / depth);
    const u = this.camera.fxPx * a + this.camera.cxPx;
    const v = this.camera.fyPx * b + this.camera.cyPx;
    return u >= -0.5 && v >= -0.5 && u < this.width_px - 0.5 && v < this.height_px - 0.5 ? [u, v] : null;
  }

  /** The point at `depth_m` along the ray of a pixel; the distortion of the lens is neglected, as for a sketch. */
  unproject(u: number, v: number, depth_m: number): Vec3 {
    const x = ((u - this.camera.cxPx) / (this.camera.fxPx || 1)) * depth_m;
    const y = ((v - this.camera.cyPx) / (this.camera.fyPx || 1)) * depth_m;
    const [wx, wy, wz] = rotateBack(this.cameraFromWorld, [x, y, depth_m]);
    return [wx + this.centre_m[0], wy + this.centre_m[1], wz + this.centre_m[2]];
  }

  private distort(x: number, y: number): [number, number] {
    const [a = 0, b = 0, c = 0, d = 0, e = 0] = this.camera.distortion;
    const r2 = x * x + y * y;
    if (this.camera.lensKind === LensKind.FISHEYE) {
      const r = Math.sqrt(r2);
      if (r < 1e-9) return [x, y];
      const t2 = Math.atan(r) ** 2;
      const scale = (Math.sqrt(t2) * (1 + t2 * (a + t2 * (b + t2 * (c + t2 * d))))) / r;
      return [x * scale, y * scale];
    }
    const radial = 1 + r2 * (a + r2 * (b + r2 * e));
    return [x * radial + 2 * c * x * y + d * (r2 + 2 * x * x), y * radial + c * (r2 + 2 * y * y) + 2 * d * x * y];
  }
}
