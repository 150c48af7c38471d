/** Orbit camera: rotation about a center, panning and zoom. World units. */
import { column, cross, dot, length, poseMatrix, subtract, add, scale, rotate, normalize } from "./vectors";
import type { Vec3 } from "./vectors";

/** Smallest angle between the view axis and the vertical, radians. */
const MIN_POLE_ANGLE = 0.02;

export class Orbit {
  eye: Vec3;
  target: Vec3;

  /** `c2w` row by row; the orbit's center is the point of the camera's axis closest to `around`. */
  constructor(
    c2w: readonly number[],
    private readonly up: Vec3,
    around: Vec3,
  ) {
    this.eye = column(c2w, 3);
    const forward = scale(column(c2w, 2), -1);
    this.target = add(this.eye, forward, Math.max(dot(subtract(around, this.eye), forward), 1e-3));
  }

  /** Camera-to-world matrix, row by row. */
  get c2w(): number[] {
    const back = normalize(subtract(this.eye, this.target));
    const right = normalize(cross(this.up, back));
    return poseMatrix(right, cross(back, right), back, this.eye);
  }

  /** Rotates about the center by angles in radians, to the right and downwards. */
  turn(across: number, down: number): void {
    const offset = rotate(subtract(this.eye, this.target), this.up, -across);
    const right = normalize(cross(this.up, offset));
    const angle = Math.acos(Math.max(-1, Math.min(1, dot(normalize(offset), this.up))));
    const change = Math.max(MIN_POLE_ANGLE, Math.min(Math.PI - MIN_POLE_ANGLE, angle - down)) - angle;
    this.eye = add(this.target, rotate(offset, right, change));
  }

  /** Pans by shares of the image height; `tangent` is that of half the vertical field of view. */
  shift(across: number, down: number, tangent: number): void {
    const height = 2 * tangent * length(subtract(this.eye, this.target));
    const { c2w } = this;
    const motion = add(scale(column(c2w, 0), -across * height), column(c2w, 1), down * height);
    this.eye = add(this.eye, motion);
    this.target = add(this.target, motion);
  }

  /** Multiplies the distance to the center by a factor. */
  zoom(factor: number): void {
    this.eye = add(this.target, subtract(this.eye, this.target), factor);
  }
}
