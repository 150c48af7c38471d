import { describe, expect, it } from "vitest";
import { EDGES, FACE_NAMES } from "../src/editing/cage";
import {
  pickMeshEdge,
  distanceToCage,
  visibleFaceCenters,
  pickPart,
  pickCorner,
  type Project,
} from "../src/editing/picking";
import { box } from "./cages";
import { cageLines } from "../src/editing/point_cages";
import { partCorners, type Posed } from "../src/editing/cage";

/** Looks along -z from z = 10 without perspective: 100 pixels a unit, the origin at (500, 500). */
const project: Project = ([x, y, z]) => ({ x: 500 + 100 * x, y: 500 - 100 * y, depth: 10 - z });
const cage = { corners: box([0, 0, 0], [2, 2, 2]), eye: [0, 0, 10] as [number, number, number] };

describe("picking", () => {
  it("takes the nearer of two corners that are in line", () => {
    expect(pickPart(600, 400, cage, project)).toEqual({ kind: "corner", index: 7 });
    expect(pickCorner(601, 402, cage.corners, project)).toEqual({ kind: "corner", index: 7 });
  });

  it("takes the face that looks towards the eye by the square at its middle", () => {
    expect(pickPart(503, 500, cage, project)).toEqual({ kind: "face", index: FACE_NAMES.indexOf("+z") });
    expect(visibleFaceCenters(cage.corners, cage.eye).filter((at) => at !== null)).toHaveLength(1);
  });

  it("takes the nearer edge", () => {
    const found = pickPart(600, 470, cage, project);
    expect(found?.kind).toBe("edge");
    expect(EDGES[found!.index]).toEqual([5, 7]);
  });

  it("takes nothing next to a cage, nor behind the camera", () => {
    expect(pickPart(700, 700, cage, project)).toBeNull();
    expect(pickPart(600, 400, { ...cage, corners: box([0, 0, 20], [2, 2, 2]) }, project)).toBeNull();
  });

  it("measures how far the edges are", () => {
    expect(distanceToCage(620, 500, { corners: cage.corners, pivot: [0, 0, 0] }, project)).toBeCloseTo(20, 9);
  });
});

describe("edges of a mesh", () => {
  const tetrahedron: Posed = {
    corners: box([0, 0, 0], [1, 1, 1]),
    pivot: [0, 0, 0],
    points: [
      [0, 0, 2],
      [100, 0, 2],
      [0, 100, 2],
      [0, 0, 1],
    ],
    shape: null,
    edges: [
      [0, 1],
      [0, 2],
      [0, 3],
      [1, 2],
      [1, 3],
      [2, 3],
    ],
  };
  const project = ([x, y, depth]: readonly number[]): { x: number; y: number; depth: number } => ({
    x,
    y,
    depth,
  });

  it("are the lines of the cage", () => {
    expect(cageLines(tetrahedron)).toHaveLength(6);
    expect(cageLines(tetrahedron)[3]).toEqual([
      [100, 0, 2],
      [0, 100, 2],
    ]);
  });

  it("are picked by their two vertices, the closest one first", () => {
    const across = pickMeshEdge(52, 52, tetrahedron, project);
    expect(across).toMatchObject({ kind: "edge", index: 3, ends: [1, 2] });
    expect(partCorners(across!)).toEqual([1, 2]);
    // Edges (0, 1) and (1, 3) lie on each other on the screen; the second is nearer.
    expect(pickMeshEdge(50, 3, tetrahedron, project)).toMatchObject({ ends: [1, 3] });
    expect(pickMeshEdge(40, 30, tetrahedron, project)).toBeNull();
    expect(pickMeshEdge(50, 3, { ...tetrahedron, edges: null }, project)).toBeNull();
  });
});
