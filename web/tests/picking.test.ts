import { describe, expect, it } from "vitest";
import { EDGES, FACE_NAMES } from "../src/editing/cage";
import {
  distanceToCage,
  visibleFaceCenters,
  pickPart,
  pickCorner,
  type Project,
} from "../src/editing/picking";
import { box } from "./cages";

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
