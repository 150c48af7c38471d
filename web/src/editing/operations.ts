/**
 * Operations on a cage, equal to those of the server, so that lines move before the server's answer. Angles are in
 * degrees, intrinsic XYZ; rotation, scaling and shear are about the cage's pivot.
 */
import { Euler, MathUtils, Matrix3, Matrix4, Quaternion, Vector3 } from "three";
import { edgeDirections, nearestRotation, type Posed } from "./cage";
import { movePoints } from "./point_cages";
import type { Corners, DragMove, Vec3 } from "../net/protocol";

export type Operation = DragMove["operation"];
export type Axes = "world" | "cage";

/**
 * The cage after the operation; only a translation moves the pivot. Bends, twists and tapers, and motions of corners of
 * a lattice, are the server's: the cage stays until its answer.
 */
export function apply(operation: Operation, cage: Posed): Posed {
  const { corners, pivot } = cage;
  const linear = (matrix: Matrix3): Posed => mapped(cage, (p) => transformAboutPivot(p, pivot, matrix));
  switch (operation.kind) {
    case "translate":
      return { ...mapped(cage, (p) => addVectors(p, operation.by)), pivot: addVectors(pivot, operation.by) };
    case "move_corners":
      return cage.points ? cage : { ...cage, corners: moveCorners(corners, operation.corners, operation.by) };
    case "move_point":
      return movePoints(cage, [operation.point], operation.by, null);
    case "move_points": {
      const { points, by, radius = 0, falloff = "smooth" } = operation;
      return movePoints(cage, points, by, radius > 0 ? { radius, curve: falloff } : null);
    }
    case "rotate":
      return linear(rotationMatrix(operation.rotation_deg, operation.axes, corners));
    case "scale":
      return linear(inWorldAxes(diagonal(operation.by), operation.axes, corners));
    case "shear": {
      const { xy = 0, xz = 0, yx = 0, yz = 0, zx = 0, zy = 0 } = operation;
      const shear = new Matrix3().set(1, xy, xz, yx, 1, yz, zx, zy, 1);
      return linear(inWorldAxes(shear, operation.axes, corners));
    }
    case "bend":
    case "twist":
    case "taper":
    case "mirror":
      return cage;
  }
}

/** The share t of an operation: lengths, shears and the angle times t, factors to the power t. */
export function scaleOperation(operation: Operation, t: number): Operation {
  switch (operation.kind) {
    case "translate":
    case "move_corners":
    case "move_point":
    case "move_points":
      return { ...operation, by: scaleVector(operation.by, t) };
    case "rotate": {
      const full = quaternionFromDegrees(operation.rotation_deg);
      if (full.w < 0) full.set(-full.x, -full.y, -full.z, -full.w);
      return { ...operation, rotation_deg: degreesFromQuaternion(new Quaternion().slerp(full, t)) };
    }
    case "scale":
      return { ...operation, by: operation.by.map((s) => s ** t) as Vec3 };
    case "shear": {
      const { xy = 0, xz = 0, yx = 0, yz = 0, zx = 0, zy = 0 } = operation;
      return { ...operation, xy: xy * t, xz: xz * t, yx: yx * t, yz: yz * t, zx: zx * t, zy: zy * t };
    }
    case "bend":
    case "twist":
      return { ...operation, degrees: t * operation.degrees };
    case "taper":
      return { ...operation, factor: operation.factor ** t };
    case "mirror":
      return operation;
  }
}

/**
 * Magnitude of an operation: length, angle in degrees, largest logarithm of a factor, or norm of the shears.
 */
export function operationSize(operation: Operation): number {
  switch (operation.kind) {
    case "translate":
    case "move_corners":
    case "move_point":
    case "move_points":
      return Math.hypot(...operation.by);
    case "rotate":
      return MathUtils.radToDeg(quaternionFromDegrees(operation.rotation_deg).angleTo(new Quaternion()));
    case "scale":
      return Math.max(...operation.by.map((s) => Math.abs(Math.log(s))));
    case "shear": {
      const { xy = 0, xz = 0, yx = 0, yz = 0, zx = 0, zy = 0 } = operation;
      return Math.hypot(xy, xz, yx, yz, zx, zy);
    }
    case "bend":
    case "twist":
      return Math.abs(operation.degrees);
    case "taper":
      return Math.abs(Math.log(operation.factor));
    case "mirror":
      return 1;
  }
}

/** Steps of a snapped drag: length in world units, angle in degrees, and scale factor. */
export interface SnapSteps {
  length: number;
  angle: number;
  factor: number;
}

/** The operation with its numbers rounded to multiples of the steps. */
export function snapOperation(operation: Operation, steps: SnapSteps): Operation {
  const to = (v: Vec3, step: number): Vec3 =>
    v.map((x) => roundDecimals(Math.round(x / step) * step)) as Vec3;
  switch (operation.kind) {
    case "translate":
    case "move_corners":
    case "move_point":
    case "move_points":
      return { ...operation, by: to(operation.by, steps.length) };
    case "rotate":
      return { ...operation, rotation_deg: to(operation.rotation_deg, steps.angle) };
    case "scale":
      return {
        ...operation,
        by: to(operation.by, steps.factor).map((s) => Math.max(s, steps.factor)) as Vec3,
      };
    case "shear":
    case "bend":
    case "twist":
    case "taper":
    case "mirror":
      return operation;
  }
}

/** Step of translations for a cage of a length: 1 or 5 times a power of ten, at most a tenth of the length. */
export function snapLength(length: number): number {
  const raw = Math.max(length, 1e-9) / 10;
  const decade = 10 ** Math.floor(Math.log10(raw));
  return roundDecimals(raw / decade >= 5 ? 5 * decade : decade);
}

/** Text of the operation's numbers, for the readout beside the mouse. */
export function describeOperation(operation: Operation): string {
  const three = (v: Vec3, digits: number): string =>
    v.map((x) => roundDecimals(x, digits).toFixed(digits)).join("  ");
  switch (operation.kind) {
    case "translate":
    case "move_corners":
    case "move_point":
    case "move_points":
      return three(operation.by, 3);
    case "rotate":
      return `${operation.rotation_deg.map((x) => roundDecimals(x, 1).toFixed(1)).join("°  ")}°`;
    case "scale":
      return `× ${three(operation.by, 2)}`;
    case "shear":
    case "bend":
    case "twist":
    case "taper":
    case "mirror":
      return operation.kind;
  }
}

/** The quaternion of intrinsic XYZ angles in degrees. */
export function quaternionFromDegrees(rotation_deg: Vec3): Quaternion {
  const [x, y, z] = rotation_deg.map((angle) => MathUtils.degToRad(angle));
  return new Quaternion().setFromEuler(new Euler(x, y, z, "XYZ"));
}

/** Intrinsic XYZ angles in degrees. */
export function degreesFromQuaternion(q: Quaternion): Vec3 {
  const { x, y, z } = new Euler().setFromQuaternion(q, "XYZ");
  return [x, y, z].map((angle) => roundDecimals(MathUtils.radToDeg(angle))) as Vec3;
}

/** The number rounded to some decimals, without negative zero. */
export function roundDecimals(x: number, digits = 9): number {
  const rounded = Number(x.toFixed(digits));
  return rounded === 0 ? 0 : rounded;
}

function rotationMatrix(rotation_deg: Vec3, axes: Axes | undefined, corners: Corners): Matrix3 {
  const turn = quaternionFromDegrees(rotation_deg);
  if (axes === "cage") {
    const own = nearestRotation(corners);
    turn.premultiply(own).multiply(own.clone().invert());
  }
  return new Matrix3().setFromMatrix4(new Matrix4().makeRotationFromQuaternion(turn));
}

/** A matrix in world axes, given along `axes`: the world's, or the edges of the cage. */
function inWorldAxes(matrix: Matrix3, axes: Axes | undefined, corners: Corners): Matrix3 {
  if (axes !== "cage") return matrix;
  const own = edgeDirections(corners);
  return own.clone().multiply(matrix).multiply(own.clone().invert());
}

function diagonal([x, y, z]: Vec3): Matrix3 {
  return new Matrix3().set(x, 0, 0, 0, y, 0, 0, 0, z);
}

function mapped(cage: Posed, map: (point: Vec3) => Vec3): Posed {
  const corners = cage.corners.map(map) as Corners;
  return cage.points === undefined
    ? { ...cage, corners }
    : { ...cage, corners, points: cage.points.map(map) };
}

function transformAboutPivot(point: Vec3, pivot: Vec3, matrix: Matrix3): Vec3 {
  const center = new Vector3(...pivot);
  return new Vector3(...point).sub(center).applyMatrix3(matrix).add(center).toArray();
}

function moveCorners(corners: Corners, which: readonly number[], by: Vec3): Corners {
  return corners.map((corner, k) => (which.includes(k) ? addVectors(corner, by) : corner)) as Corners;
}

function addVectors(a: Vec3, b: Vec3): Vec3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

function scaleVector(a: Vec3, t: number): Vec3 {
  return [a[0] * t, a[1] * t, a[2] * t];
}
