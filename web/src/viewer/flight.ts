/**
 * Flights between two views, as `cagefield.scene.hotspot_tour` describes them: the point that is looked at goes
 * straight, the eye's direction from it turns at an even rate, and its distance changes evenly in the logarithm.
 */
import { add, cross, dot, length, normalize, rotate, scale, subtract } from "./vectors";
import type { Vec3 } from "./vectors";

export interface Pose {
  eye: Vec3;
  target: Vec3;
  fov_y_deg: number;
}

/** Pose at a share t of [0,1] of the flight between two; opposite directions turn about `up`. */
export function poseBetween(one: Pose, other: Pose, t: number, up: Vec3): Pose {
  const u = t * t * (3 - 2 * t);
  const target = add(one.target, subtract(other.target, one.target), u);
  const [a, b] = [one, other].map(({ eye, target: at }) => subtract(eye, at));
  const distance = length(a) ** (1 - u) * length(b) ** u;
  const direction = turned(normalize(a), normalize(b), u, up);
  return {
    eye: add(target, scale(direction, distance)),
    target,
    fov_y_deg: one.fov_y_deg + u * (other.fov_y_deg - one.fov_y_deg),
  };
}

/** Unit vector at a share u of the turn from unit vector a to b. */
function turned(a: Vec3, b: Vec3, u: number, up: Vec3): Vec3 {
  const angle = Math.acos(Math.max(-1, Math.min(1, dot(a, b))));
  if (angle < 1e-9) return b;
  const axis = cross(a, b);
  return rotate(a, normalize(length(axis) > 1e-9 ? axis : up), u * angle);
}
