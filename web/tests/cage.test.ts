import { Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import {
  EDGES,
  FACES,
  FACE_NAMES,
  edgeDirections,
  partCorners,
  halfExtent,
  faceNormal,
  centroid,
  nearestRotation,
} from "../src/editing/cage";
import { box, expectClose } from "./cages";

const turn = new Quaternion().setFromAxisAngle(new Vector3(1, 2, 3).normalize(), 0.7);

describe("a cage's parts", () => {
  it("has 12 edges between corners that differ in one bit, four along each axis", () => {
    expect(EDGES).toHaveLength(12);
    for (const [i, j] of EDGES) expect([1, 2, 4]).toContain(j - i);
    expect(new Set(EDGES.map(String)).size).toBe(12);
  });

  it("has faces whose corners share the bit that they are named after", () => {
    expect(FACES[FACE_NAMES.indexOf("+z")]).toEqual([4, 5, 6, 7]);
    expect(FACES[FACE_NAMES.indexOf("-x")]).toEqual([0, 2, 4, 6]);
  });

  it("knows the corners of each kind of part", () => {
    expect(partCorners({ kind: "corner", index: 5 })).toEqual([5]);
    expect(partCorners({ kind: "edge", index: 0 })).toEqual([0, 1]);
    expect(partCorners({ kind: "face", index: 2 })).toEqual([2, 3, 6, 7]);
  });
});

describe("a cage's frame", () => {
  it("is the rotation of a turned box", () => {
    expect(nearestRotation(box([1, 2, 3], [1, 2, 3], turn)).angleTo(turn)).toBeLessThan(1e-9);
  });

  it("of a sheared box is the nearest rotation: no other of many is nearer to the axes", () => {
    const sheared = box([0, 0, 0], [1, 1, 1]).map(([x, y, z]) => [x + 0.6 * y, y, z]) as ReturnType<
      typeof box
    >;
    const axes = edgeDirections(sheared).elements;
    const distance = (q: Quaternion): number => {
      const columns = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)].flatMap((v) =>
        v.applyQuaternion(q).toArray(),
      );
      return Math.hypot(...columns.map((x, i) => x - axes[i]));
    };
    const best = nearestRotation(sheared);
    for (let n = 0; n < 50; n++) {
      const axis = new Vector3(Math.sin(n), Math.cos(3 * n), Math.sin(7 * n)).normalize();
      const other = best.clone().multiply(new Quaternion().setFromAxisAngle(axis, 0.05));
      expect(distance(other)).toBeGreaterThan(distance(best));
    }
  });

  it("has unit axes along its edges", () => {
    const x = new Vector3(1, 0, 0).applyQuaternion(turn);
    expectClose(edgeDirections(box([0, 0, 0], [3, 2, 1], turn)).elements.slice(0, 3), x.toArray());
  });

  it("has outward face normals", () => {
    const cage = box([5, 5, 5], [1, 2, 3], turn);
    expectClose(faceNormal(cage, 3), new Vector3(0, -1, 0).applyQuaternion(turn).toArray());
    expectClose(faceNormal(cage, 0), new Vector3(1, 0, 0).applyQuaternion(turn).toArray());
  });

  it("measures its middle and its size", () => {
    expectClose(centroid(box([1, 2, 3], [1, 1, 1])), [1, 2, 3]);
    expectClose(centroid(box([0, 0, 0], [2, 2, 2]), [1, 3, 5, 7]), [1, 0, 0]);
    expect(halfExtent(box([0, 0, 0], [1, 2, 3], turn))).toBeCloseTo(1, 9);
  });
});
