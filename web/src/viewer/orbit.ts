/** A camera that turns about a point, shifts and comes nearer; no browser. */
import { column, cross, dot, length, matrix, minus, plus, times, turned, unit } from "./vectors";
import type { Vec3 } from "./vectors";

/** Nearest to looking straight up or down, radians. */
const LIMIT = 0.02;

export class Orbit {
  eye: Vec3;
  target: Vec3;

  /** `c2w` row by row; the orbit's centre is the point of its axis next to `around`. */
  constructor(
    c2w: readonly number[],
    private readonly up: Vec3,
    around: Vec3,
  ) {
    this.eye = column(c2w, 3);
    const forward = times(column(c2w, 2), -1);
    this.target = plus(this.eye, forward, Math.max(dot(minus(around, this.eye), forward), 1e-3));
  }

  /** Camera to world, row by row. */
  get c2w(): number[] {
    const back = unit(minus(this.eye, this.target));
    const right = unit(cross(this.up, back));
    return matrix(right, cross(back, right), back, this.eye);
  }

  /** Turns about the centre by angles to the right and downwards. */
  turn(across: number, down: number): void {
    const away = turned(minus(this.eye, this.target), this.up, -across);
    const right = unit(cross(this.up, away));
    const angle = Math.acos(Math.max(-1, Math.min(1, dot(unit(away), this.up))));
    const by = Math.max(LIMIT, Math.min(Math.PI - LIMIT, angle - down)) - angle;
    this.eye = plus(this.target, turned(away, right, by));
  }

  /** Shifts by shares of the picture's height, with the tangent of half its vertical field of view. */
  shift(across: number, down: number, tangent: number): void {
    const far = 2 * tangent * length(minus(this.eye, this.target));
    const { c2w } = this;
    const by = plus(times(column(c2w, 0), -across * far), column(c2w, 1), down * far);
    this.eye = plus(this.eye, by);
    this.target = plus(this.target, by);
  }

  /** Multiplies the distance to the centre. */
  zoom(by: number): void {
    this.eye = plus(this.target, minus(this.eye, this.target), by);
  }
}
