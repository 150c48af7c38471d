/** Operations from motions of the gizmo, or of a corner, an edge or a face. */
import { Quaternion, Ray, Vector3 } from "three";
import { degreesFromQuaternion, roundDecimals, type Axes, type Operation } from "./operations";
import type { Posed } from "./cage";
import type { Proportional } from "./point_cages";
import type { Vec3 } from "../net/protocol";

const UNIT_VECTORS: Record<string, Vector3> = {
  X: new Vector3(1, 0, 0),
  Y: new Vector3(0, 1, 0),
  Z: new Vector3(0, 0, 1),
};
const MIN_SCALE_FACTOR = 0.02;
const MAX_SCALE_FACTOR = 50;

/** The translation between two positions of the gizmo. */
export function translationBetween(from: Vector3, to: Vector3): Operation {
  return { kind: "translate", by: roundVector(to.clone().sub(from)) };
}

/**
 * The rotation between two orientations of the gizmo, whose axes are `axes`. A rotation about one of the gizmo's axes
 * ("X", "Y" or "Z") has that angle alone, any other intrinsic XYZ angles.
 */
export function rotationBetween(from: Quaternion, to: Quaternion, axes: Axes, about: string): Operation {
  const turn = from.clone().invert().multiply(to);
  const axis: Vector3 | undefined = UNIT_VECTORS[about];
  if (!(about in UNIT_VECTORS)) return { kind: "rotate", rotation_deg: degreesFromQuaternion(turn), axes };
  const angle = 2 * Math.atan2(new Vector3(turn.x, turn.y, turn.z).dot(axis), turn.w) * (180 / Math.PI);
  const wrapped = angle > 180 ? angle - 360 : angle <= -180 ? angle + 360 : angle;
  return { kind: "rotate", rotation_deg: roundVector(axis.clone().multiplyScalar(wrapped)), axes };
}

/** The scaling by the gizmo's factors, each within [1/50, 50]. */
export function scalingBy(factors: Vector3, axes: Axes): Operation {
  const by = factors
    .toArray()
    .map((s) => roundDecimals(Math.min(Math.max(s, MIN_SCALE_FACTOR), MAX_SCALE_FACTOR))) as Vec3;
  return { kind: "scale", by, axes };
}

/** The motion of some corners by a vector. */
export function moveCornersBy(corners: readonly number[], by: Vector3): Operation {
  return { kind: "move_corners", corners: [...corners].sort((a, b) => a - b), by: roundVector(by) };
}

/** A motion of handles as one of control points, where the cage has them; any other operation as it is. */
export function asPointMove(operation: Operation, cage: Posed, proportional: Proportional | null): Operation {
  if (operation.kind !== "move_corners" || cage.points === undefined) return operation;
  const { corners: points, by } = operation;
  if (proportional !== null)
    return { kind: "move_points", points, by, radius: proportional.radius, falloff: proportional.curve };
  return points.length === 1
    ? { kind: "move_point", point: points[0], by }
    : { kind: "move_points", points, by };
}

/** Intersection of a ray with the plane through a point; null for a parallel ray, or a plane behind it. */
export function intersectPlane(ray: Ray, point: Vector3, normal: Vector3): Vector3 | null {
  const slope = ray.direction.dot(normal);
  const distance = point.clone().sub(ray.origin).dot(normal) / slope;
  if (Math.abs(slope) < 1e-9 || distance < 0) return null;
  return ray.at(distance, new Vector3());
}

/** The point of a line closest to a ray; null for a parallel ray. */
export function closestPointOnLine(ray: Ray, point: Vector3, direction: Vector3): Vector3 | null {
  const across = direction.clone().cross(ray.direction);
  const size = across.lengthSq();
  if (size < 1e-9 * direction.lengthSq()) return null;
  const t = ray.origin.clone().sub(point).cross(ray.direction).dot(across) / size;
  return point.clone().addScaledVector(direction, t);
}

function roundVector(v: Vector3): Vec3 {
  return v.toArray().map((x) => roundDecimals(x)) as Vec3;
}
