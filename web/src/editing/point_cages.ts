/** Cages with control points: lattices, numbered x fastest, and points on their own with a radius. */
import { Vector3 } from "three";
import { EDGES, centroid, type Posed } from "./cage";
import type { Corners, MovePointsBy, PointsState, Vec3 } from "../net/protocol";

/** Curve by which the motion of points fades with the distance. */
export type Curve = NonNullable<MovePointsBy["falloff"]>;

/** Proportional editing: points within a radius, world units, go along by a curve. */
export interface Proportional {
  radius: number;
  curve: Curve;
}

/** Share of a step of the wheel by which the radius changes. */
const RADIUS_STEP = 1.1;
const CIRCLE_POINTS = 48;

/** Points by which a cage is moved: its control points, else its corners. */
export function handlesOf(cage: Posed): readonly Vec3[] {
  return cage.points ?? cage.corners;
}

/** Mean of the handles, or of some of them. */
export function middleOf(cage: Posed, which?: readonly number[]): Vec3 {
  return centroid(handlesOf(cage), which);
}

/** A cage of the given corners with the control points of an edit, if it has any. */
export function posedCage(
  corners: Corners,
  pivot: Vec3,
  points: readonly Vec3[],
  state: PointsState | null,
): Posed {
  if (state === null) return { corners, pivot };
  return { corners, pivot, points, shape: state.shape, edges: state.edges, radius: state.radius };
}

/** Lines of a cage: edges of a box or a mesh, lines between neighboring points of a lattice; none of others. */
export function cageLines(cage: Posed): [Vec3, Vec3][] {
  const { corners, points, shape, edges } = cage;
  if (points !== undefined && edges) return edges.map(([i, j]) => [points[i], points[j]]);
  if (points === undefined) return EDGES.map(([i, j]) => [corners[i], corners[j]]);
  if (shape === undefined || shape === null) return [];
  const [nx, ny, nz] = shape;
  const lines: [Vec3, Vec3][] = [];
  points.forEach((point, k) => {
    const at = [k % nx, Math.floor(k / nx) % ny, Math.floor(k / (nx * ny))];
    [1, nx, nx * ny].forEach((stride, axis) => {
      if (at[axis] + 1 < [nx, ny, nz][axis]) lines.push([point, points[k + stride]]);
    });
  });
  return lines;
}

/** Numbers of the outermost points of a lattice, in the order of the corners of a box. */
export function outermostPoints([nx, ny, nz]: readonly [number, number, number]): number[] {
  return [0, 1, 2, 3, 4, 5, 6, 7].map(
    (k) => (k & 1) * (nx - 1) + nx * (((k >> 1) & 1) * (ny - 1) + ny * ((k >> 2) & 1) * (nz - 1)),
  );
}

/** A line of a lattice's net: one of its points, and its axis. */
export interface NetLine {
  point: number;
  axis: 0 | 1 | 2;
}

/** The line at a place in `cageLines` of a lattice. */
export function netLine(cage: Posed, place: number): NetLine | null {
  const { points, shape } = cage;
  if (points === undefined || !shape) return null;
  let n = 0;
  for (let point = 0; point < points.length; point++) {
    const at = placeOf(point, shape);
    for (const axis of [0, 1, 2] as const) {
      if (at[axis] + 1 < shape[axis] && n++ === place) return { point, axis };
    }
  }
  return null;
}

/** Numbers of the points of a lattice on a line of its net, from end to end. */
export function rowOf(shape: Shape, { point, axis }: NetLine): number[] {
  return pointsWhere(shape, (at, here) => at.every((n, other) => other === axis || n === here[other]), point);
}

/** Numbers of the points of a lattice that have the place of a point along an axis: a plane across it. */
export function planeOf(shape: Shape, point: number, across: number): number[] {
  return pointsWhere(shape, (at, here) => at[across] === here[across], point);
}

type Shape = readonly [number, number, number];

function placeOf(point: number, [nx, ny]: Shape): [number, number, number] {
  return [point % nx, Math.floor(point / nx) % ny, Math.floor(point / (nx * ny))];
}

function pointsWhere(
  shape: Shape,
  isWanted: (at: number[], here: number[]) => boolean,
  point: number,
): number[] {
  const here = placeOf(point, shape);
  return Array.from({ length: shape[0] * shape[1] * shape[2] }, (_, k) => k).filter((k) =>
    isWanted(placeOf(k, shape), here),
  );
}

/** Weight of a point at a distance from the closest moved one: 1 at 0, and 0 from the radius on. */
export function curveWeight(distance: number, { radius, curve }: Proportional): number {
  const g = Math.min(1, Math.max(0, 1 - distance / radius));
  switch (curve) {
    case "smooth":
      return g * g * (3 - 2 * g);
    case "sphere":
      return Math.sqrt(Math.max(0, 2 * g - g * g));
    case "root":
      return Math.sqrt(g);
    case "sharp":
      return g * g;
    case "linear":
      return g;
  }
}

/** The cage with some of its control points moved by a vector, and those around them in part. */
export function movePoints(
  cage: Posed,
  chosen: readonly number[],
  by: Vec3,
  proportional: Proportional | null,
): Posed {
  const { points, shape } = cage;
  if (points === undefined) return cage;
  const moved = points.map((point, k): Vec3 => {
    const weight = chosen.includes(k) ? 1 : proportional === null ? 0 : weightAt(point, proportional);
    return [point[0] + weight * by[0], point[1] + weight * by[1], point[2] + weight * by[2]];
  });
  const corners = shape ? (outermostPoints(shape).map((k) => moved[k]) as Corners) : cage.corners;
  return { ...cage, points: moved, corners };

  function weightAt(point: Vec3, reach: Proportional): number {
    const distances = chosen.map((k) => Math.hypot(...point.map((x, i) => x - points![k][i])));
    return curveWeight(Math.min(...distances), reach);
  }
}

/** The radius after some steps of the wheel, within reason for a cage of a half extent. */
export function steppedRadius(radius: number, steps: number, extent: number): number {
  return Math.min(20 * extent, Math.max(0.02 * extent, radius * RADIUS_STEP ** steps));
}

/** Points of a closed circle around a center, seen as a circle along a viewing direction. */
export function circle(center: Vec3, radius: number, forward: Vec3): Vec3[] {
  const normal = new Vector3(...forward).normalize();
  const side = new Vector3(1, 0, 0);
  if (Math.abs(normal.x) > 0.9) side.set(0, 1, 0);
  const a = side.cross(normal).normalize();
  const b = normal.clone().cross(a);
  return Array.from({ length: CIRCLE_POINTS + 1 }, (_, n) => {
    const angle = (2 * Math.PI * n) / CIRCLE_POINTS;
    return new Vector3(...center)
      .addScaledVector(a, radius * Math.cos(angle))
      .addScaledVector(b, radius * Math.sin(angle))
      .toArray();
  });
}
