/** Operations from what the mouse does: with the gizmo, or by a corner, an edge or a face. */
import { Quaternion, Ray, Vector3 } from "three";
import { degrees, tidy, type Axes, type Operation } from "./operations";
import type { Vec3 } from "../net/protocol";

const UNIT: Record<string, Vector3> = {
  X: new Vector3(1, 0, 0),
  Y: new Vector3(0, 1, 0),
  Z: new Vector3(0, 0, 1),
};
const LEAST_FACTOR = 0.02;
const MOST_FACTOR = 50;

/** The translation between two positions of the gizmo. */
export function translation(from: Vector3, to: Vector3): Operation {
  return { kind: "translate", by: tidied(to.clone().sub(from)) };
}

/**
 * The rotation between two orientations of the gizmo, which stands along `axes`. Turned about one of its
 * axes ("X", "Y" or "Z") it is that angle alone, else intrinsic XYZ angles.
 */
export function rotation(from: Quaternion, to: Quaternion, axes: Axes, about: string): Operation {
  const turn = from.clone().invert().multiply(to);
  const axis: Vector3 | undefined = UNIT[about];
  if (!(about in UNIT)) return { kind: "rotate", rotation_deg: degrees(turn), axes };
  const angle = 2 * Math.atan2(new Vector3(turn.x, turn.y, turn.z).dot(axis), turn.w) * (180 / Math.PI);
  const wrapped = angle > 180 ? angle - 360 : angle <= -180 ? angle + 360 : angle;
  return { kind: "rotate", rotation_deg: tidied(axis.clone().multiplyScalar(wrapped)), axes };
}

/** The scaling that the gizmo's factors mean, a fiftieth to fifty along each axis. */
export function scaling(factors: Vector3, axes: Axes): Operation {
  const by = factors.toArray().map((s) => tidy(Math.min(Math.max(s, LEAST_FACTOR), MOST_FACTOR))) as Vec3;
  return { kind: "scale", by, axes };
}

/** The move of some corners. */
export function cornersMove(corners: readonly number[], by: Vector3): Operation {
  return { kind: "move_corners", corners: [...corners].sort((a, b) => a - b), by: tidied(by) };
}

/** Where a ray meets the plane through a point, or null where it runs along or away from it. */
export function onPlane(ray: Ray, point: Vector3, normal: Vector3): Vector3 | null {
  const slope = ray.direction.dot(normal);
  const distance = point.clone().sub(ray.origin).dot(normal) / slope;
  if (Math.abs(slope) < 1e-9 || distance < 0) return null;
  return ray.at(distance, new Vector3());
}

/** The point of a line that is nearest to a ray, or null where they are parallel. */
export function onLine(ray: Ray, point: Vector3, direction: Vector3): Vector3 | null {
  const across = direction.clone().cross(ray.direction);
  const size = across.lengthSq();
  if (size < 1e-9 * direction.lengthSq()) return null;
  const t = ray.origin.clone().sub(point).cross(ray.direction).dot(across) / size;
  return point.clone().addScaledVector(direction, t);
}

function tidied(v: Vector3): Vec3 {
  return v.toArray().map((x) => tidy(x)) as Vec3;
}
