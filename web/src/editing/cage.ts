/**
 * Cages: hexahedra given by 8 corners, corner k = x + 2y + 4z along the cage's own axes. Edges are corner
 * pairs that differ in one bit, faces are "+x" to "-z". World units.
 */
import { Matrix3, Matrix4, Quaternion, Vector3 } from "three";
import type { Corners, Vec3 } from "../net/protocol";

export type Edge = readonly [number, number];
export type FaceName = "+x" | "-x" | "+y" | "-y" | "+z" | "-z";

const ALL_CORNERS = [0, 1, 2, 3, 4, 5, 6, 7] as const;

/** The 12 edges (i, j), i < j: four along x, four along y, four along z. */
export const EDGES: readonly Edge[] = [0, 1, 2].flatMap((axis) =>
  ALL_CORNERS.filter((k) => !((k >> axis) & 1)).map((k): Edge => [k, k | (1 << axis)]),
);

export const FACE_NAMES: readonly FaceName[] = ["+x", "-x", "+y", "-y", "+z", "-z"];

/** The four corners of each face, in the order of `FACE_NAMES`, increasing. */
export const FACES: readonly (readonly number[])[] = FACE_NAMES.map((name) => {
  const axis = "xyz".indexOf(name[1]);
  const bit = name[0] === "+" ? 1 : 0;
  return ALL_CORNERS.filter((k) => ((k >> axis) & 1) === bit);
});

/** A part of a cage that can be dragged: a corner, an edge, a face, or a control point. */
export interface CagePart {
  kind: "corner" | "edge" | "face" | "point";
  /** Number of the corner or the control point, or index in `EDGES`, `FACES` or the edges of a mesh. */
  index: number;
  /** Vertices of an edge of a mesh. */
  ends?: readonly [number, number];
}

/** A cage as it is drawn and moved. */
export interface Posed {
  corners: Corners;
  pivot: Vec3;
  /** Control points of a lattice, x fastest, or points on their own; none of a box. */
  points?: readonly Vec3[];
  /** Points of a lattice along x, y and z; null for points on their own. */
  shape?: [number, number, number] | null;
  /** Edges of a mesh, each by its two points; null for others. */
  edges?: readonly [number, number][] | null;
  /** Reach of points on their own. */
  radius?: number | null;
}

/** Numbers of the corners of a part; of a control point, its own. */
export function partCorners(part: CagePart): number[] {
  if (part.kind === "corner" || part.kind === "point") return [part.index];
  if (part.ends !== undefined) return [...part.ends];
  return [...(part.kind === "edge" ? EDGES : FACES)[part.index]];
}

/** Mean of the given corners [3], or of other points; of all by default. */
export function centroid(corners: readonly Vec3[], which: readonly number[] = [...corners.keys()]): Vec3 {
  const sum = new Vector3();
  for (const k of which) sum.add(new Vector3(...corners[k]));
  return sum.divideScalar(which.length).toArray();
}

/** Unit edge directions at the center of the cage, as the columns of a matrix. */
export function edgeDirections(corners: Corners): Matrix3 {
  const columns = [0, 1, 2].map((axis) => {
    const sum = new Vector3();
    for (const k of ALL_CORNERS) sum.addScaledVector(new Vector3(...corners[k]), (k >> axis) & 1 ? 1 : -1);
    return sum.normalize();
  });
  const [x, y, z] = columns;
  return new Matrix3().set(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z);
}

/** The rotation closest to the edge directions: the orthogonal factor of their polar decomposition. */
export function nearestRotation(corners: Corners): Quaternion {
  return orthogonalFactor(edgeDirections(corners));
}

/** The orthogonal factor of the polar decomposition of a matrix with a positive determinant. */
export function orthogonalFactor(matrix: Matrix3): Quaternion {
  let q = matrix;
  for (let step = 0; step < 60; step++) {
    const next = q.clone().invert().transpose();
    let change = 0;
    next.elements.forEach((value, i) => {
      const mean = 0.5 * (value + q.elements[i]);
      change = Math.max(change, Math.abs(mean - q.elements[i]));
      next.elements[i] = mean;
    });
    q = next;
    if (change < 1e-15) break;
  }
  return new Quaternion().setFromRotationMatrix(new Matrix4().setFromMatrix3(q));
}

/** Unit outward normal of a face at its center. */
export function faceNormal(corners: Corners, face: number): Vec3 {
  const [a, b, c, d] = FACES[face].map((k) => new Vector3(...corners[k]));
  const along = b.clone().add(d).sub(a).sub(c);
  const across = c.clone().add(d).sub(a).sub(b);
  const outward = new Vector3(...centroid(corners, FACES[face])).sub(new Vector3(...centroid(corners)));
  const normal = along.cross(across).normalize();
  return (normal.dot(outward) < 0 ? normal.negate() : normal).toArray();
}

/** Half the mean distance between the centers of opposite faces, world units. */
export function halfExtent(corners: Corners): number {
  const spans = [0, 2, 4].map((face) =>
    new Vector3(...centroid(corners, FACES[face])).distanceTo(
      new Vector3(...centroid(corners, FACES[face + 1])),
    ),
  );
  return (spans[0] + spans[1] + spans[2]) / 6;
}
