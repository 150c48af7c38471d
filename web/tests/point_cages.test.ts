import { describe, expect, it } from "vitest";
import { INITIAL } from "../src/app/store";
import type { Posed } from "../src/editing/cage";
import { cageOverlay } from "../src/editing/cage_overlay";
import { Drag } from "../src/editing/drag";
import { asPointMove } from "../src/editing/gestures";
import { apply, scaleOperation } from "../src/editing/operations";
import { pickHandle, pickNetLine } from "../src/editing/picking";
import {
  cageLines,
  circle,
  curveWeight,
  netLine,
  outermostPoints,
  planeOf,
  rowOf,
  steppedRadius,
  type Curve,
} from "../src/editing/point_cages";
import type { Corners, PointsState, Vec3 } from "../src/net/protocol";
import { box, expectClose } from "./cages";
import { edit, state } from "./fake_server";

const SHAPE: [number, number, number] = [2, 2, 3];
const POINTS: Vec3[] = Array.from({ length: 12 }, (_, k) => [
  k % 2,
  Math.floor(k / 2) % 2,
  Math.floor(k / 4),
]);

function lattice(): Posed {
  const corners = outermostPoints(SHAPE).map((k) => POINTS[k]) as Corners;
  return { corners, pivot: [0.5, 0.5, 1], points: POINTS, shape: SHAPE };
}

const ON_THEIR_OWN: PointsState = {
  canonical: [
    [0, 0, 0],
    [0.3, 0, 0],
  ],
  deformed: [
    [0, 0, 0],
    [0.3, 0, 0],
  ],
  shape: null,
  edges: null,
  interpolation: null,
  radius: 0.2,
  falloff: "smooth",
  connected: false,
};

describe("a lattice", () => {
  it("has lines between neighboring points, and the corners of a box outermost", () => {
    const lines = cageLines(lattice());
    expect(lines).toHaveLength(6 + 6 + 8);
    for (const [a, b] of lines) expect(Math.hypot(...a.map((x, i) => x - b[i]))).toBeCloseTo(1, 12);
    expect(outermostPoints(SHAPE)).toEqual([0, 1, 2, 3, 8, 9, 10, 11]);
  });

  it("moves one point, or those around it by the curve", () => {
    const one = apply({ kind: "move_point", point: 11, by: [0, 0, 1] }, lattice());
    expectClose(one.points![11], [1, 1, 3]);
    expectClose(one.corners[7], [1, 1, 3]);
    expectClose(one.points![10], [0, 1, 2]);
    const by: Vec3 = [1, 0, 0];
    const soft = apply({ kind: "move_points", points: [0], by, radius: 2, falloff: "linear" }, lattice());
    expectClose(soft.points![0], [1, 0, 0]);
    expectClose(soft.points![1], [1.5, 0, 0]);
    expectClose(soft.points![8], [0, 0, 2]);
    expect(scaleOperation({ kind: "move_point", point: 1, by: [2, 0, 0] }, 0.5)).toMatchObject({ by });
  });

  it("turns with all its points", () => {
    const turned = apply({ kind: "rotate", rotation_deg: [0, 0, 90], axes: "world" }, lattice());
    expectClose(turned.points![0], [1, 0, 0]);
    expectClose(turned.corners[0], [1, 0, 0]);
  });

  it("is picked by its points", () => {
    const project = ([x, y, z]: Vec3) => ({ x: 100 * x, y: 100 * y, depth: 5 - z });
    expect(pickHandle(101, 99, lattice(), project)).toEqual({ kind: "point", index: 11 });
    expect(pickHandle(50, 50, lattice(), project)).toBeNull();
  });
});

describe("proportional editing", () => {
  it("has the curves of the server", () => {
    const at = (curve: Curve): number => curveWeight(0.25, { radius: 1, curve });
    expectClose((["smooth", "sphere", "root", "sharp", "linear"] as const).map(at), [
      0.84375,
      Math.sqrt(0.9375),
      Math.sqrt(0.75),
      0.5625,
      0.75,
    ]);
    expect(curveWeight(1, { radius: 1, curve: "root" })).toBe(0);
  });

  it("makes a motion of corners one of points, with its radius", () => {
    const corners = { kind: "move_corners" as const, corners: [3], by: [1, 0, 0] as Vec3 };
    expect(asPointMove(corners, lattice(), null)).toEqual({ kind: "move_point", point: 3, by: [1, 0, 0] });
    expect(asPointMove(corners, lattice(), { radius: 2, curve: "sharp" })).toMatchObject({
      kind: "move_points",
      points: [3],
      radius: 2,
      falloff: "sharp",
    });
    const { corners: box, pivot } = lattice();
    expect(asPointMove(corners, { corners: box, pivot }, null)).toBe(corners);
  });

  it("has a radius that the wheel changes within bounds", () => {
    expect(steppedRadius(1, 1, 1)).toBeCloseTo(1.1, 12);
    expect(steppedRadius(1, -1, 1)).toBeCloseTo(1 / 1.1, 12);
    expect(steppedRadius(1, 1000, 1)).toBe(20);
    expect(steppedRadius(1, -1000, 1)).toBe(0.02);
    for (const point of circle([1, 2, 3], 0.5, [0, 0, -1])) {
      expect(point[2]).toBeCloseTo(3, 12);
      expect(Math.hypot(point[0] - 1, point[1] - 2)).toBeCloseTo(0.5, 12);
    }
  });
});

describe("control points on their own", () => {
  const points = edit({ cage: "points", points: ON_THEIR_OWN, outer_follows: true });

  it("are dots with circles of their radius, without a box", () => {
    const { segments, dots } = cageOverlay(
      { ...INITIAL, state: state({ edits: [points] }) },
      null,
      [],
      [0, -5, 0],
      [0, 1, 0],
    );
    expect(dots.map(({ position }) => position)).toEqual(ON_THEIR_OWN.deformed);
    expect(segments).toHaveLength(2 * 48);
  });

  it("are not held by the outer cage, which follows them", () => {
    const drag = new Drag(1, points, "field", () => undefined);
    drag.move({ kind: "move_point", point: 0, by: [9, 0, 0] });
    expect(drag.why).toBeNull();
    expectClose(drag.shown.deformed.points![0], [9, 0, 0]);
    drag.takeAnswer({
      type: "dragged",
      drag: 1,
      seq: 1,
      part: 1,
      why: null,
      inner: points.inner,
      deformed: points.inner,
      outer: points.outer,
      points: ON_THEIR_OWN.canonical,
      deformed_points: [
        [8, 0, 0],
        [0.3, 0, 0],
      ],
      carried: [],
    });
    expectClose(drag.shown.deformed.points![0], [8, 0, 0]);
  });
});

describe("rows and planes of a lattice", () => {
  const shape: [number, number, number] = [3, 2, 4];
  const points = Array.from({ length: 24 }, (_, k): Vec3 => [
    k % 3,
    Math.floor(k / 3) % 2,
    Math.floor(k / 6),
  ]);
  const lattice = { corners: box([1, 0.5, 1.5], [2, 1, 3]), pivot: [0, 0, 0] as Vec3, points, shape };

  it("hold the points with the same other places", () => {
    expect(rowOf(shape, { point: 7, axis: 0 })).toEqual([6, 7, 8]);
    expect(rowOf(shape, { point: 7, axis: 2 })).toEqual([1, 7, 13, 19]);
    expect(planeOf(shape, 7, 2)).toEqual([6, 7, 8, 9, 10, 11]);
    expect(planeOf(shape, 7, 1)).toEqual([0, 1, 2, 6, 7, 8, 12, 13, 14, 18, 19, 20]);
  });

  it("are found from the lines that are drawn", () => {
    cageLines(lattice).forEach(([from, to], place) => {
      const line = netLine(lattice, place)!;
      expect(points[line.point]).toEqual(from);
      const row = rowOf(shape, line).map((k) => points[k]);
      expect(row).toContainEqual(from);
      expect(row).toContainEqual(to);
      expect(row.length).toBe(shape[line.axis]);
    });
    expect(netLine({ corners: lattice.corners, pivot: [0, 0, 0] }, 0)).toBeNull();
    const project = ([x, y, z]: Vec3) => ({ x: 100 * x, y: 100 * y, depth: 10 - z });
    expect(pickNetLine(130, 2, lattice, project, 7)).toEqual({ point: 1, axis: 0 });
    expect(pickNetLine(102, 60, lattice, project, 7)).toEqual({ point: 1, axis: 1 });
    expect(pickNetLine(150, 50, lattice, project, 7)).toBeNull();
  });
});
