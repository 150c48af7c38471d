import { Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import {
  operationSize,
  apply,
  degreesFromQuaternion,
  describeOperation,
  snapLength,
  scaleOperation,
  quaternionFromDegrees,
  snapOperation,
  type Operation,
} from "../src/editing/operations";
import { box, expectClose } from "./cages";

const turn = new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), Math.PI / 6);
const cage = { corners: box([1, 0, 0], [2, 1, 1], turn), pivot: [1, 0, 0] as [number, number, number] };

describe("operations on a cage", () => {
  it("translate it with its pivot", () => {
    const after = apply({ kind: "translate", by: [1, 2, 3] }, cage);
    expectClose(after.pivot, [2, 2, 3]);
    after.corners.forEach((c, k) =>
      expectClose(
        c,
        cage.corners[k].map((x, i) => x + i + 1),
      ),
    );
  });

  it("turn it right-handed about its pivot, intrinsic XYZ", () => {
    // R_x(90) R_y(90) takes z to R_x x = x, x to R_x (-z) = y
    const q = quaternionFromDegrees([90, 90, 0]);
    expectClose(new Vector3(0, 0, 1).applyQuaternion(q).toArray(), [1, 0, 0]);
    expectClose(new Vector3(1, 0, 0).applyQuaternion(q).toArray(), [0, 1, 0]);
    const after = apply({ kind: "rotate", rotation_deg: [0, 0, 90], axes: "world" }, cage);
    expectClose(after.pivot, cage.pivot);
    after.corners.forEach((c, k) => {
      const [x, y, z] = cage.corners[k];
      expectClose(c, [1 - y, x - 1, z]);
    });
  });

  it("turn it about its own axes", () => {
    const after = apply({ kind: "rotate", rotation_deg: [180, 0, 0], axes: "cage" }, cage);
    // half a turn about the cage's own x swaps y and z bits' signs: corner 0 goes where corner 6 was
    expectClose(after.corners[0], cage.corners[6]);
    expectClose(after.corners[1], cage.corners[7]);
  });

  it("scale it along its own edges or the world's", () => {
    const own = apply({ kind: "scale", by: [2, 1, 1], axes: "cage" }, cage);
    expectClose(own.corners[1], box([1, 0, 0], [4, 1, 1], turn)[1]);
    const world = apply({ kind: "scale", by: [2, 1, 1], axes: "world" }, cage);
    world.corners.forEach((c, k) =>
      expectClose(c, [1 + 2 * (cage.corners[k][0] - 1), cage.corners[k][1], cage.corners[k][2]]),
    );
  });

  it("shear it about its pivot", () => {
    const after = apply({ kind: "shear", xy: 0.5 }, cage);
    after.corners.forEach((c, k) =>
      expectClose(c, [cage.corners[k][0] + 0.5 * cage.corners[k][1], cage.corners[k][1], cage.corners[k][2]]),
    );
  });

  it("move some corners and leave the pivot", () => {
    const after = apply({ kind: "move_corners", corners: [1, 7], by: [0, 0, 1] }, cage);
    expectClose(after.pivot, cage.pivot);
    expectClose(after.corners[7], [cage.corners[7][0], cage.corners[7][1], cage.corners[7][2] + 1]);
    expectClose(after.corners[2], cage.corners[2]);
  });
});

describe("a share of an operation", () => {
  const all: Operation[] = [
    { kind: "translate", by: [1, -2, 0.5] },
    { kind: "rotate", rotation_deg: [20, 50, -70], axes: "cage" },
    { kind: "scale", by: [2, 0.5, 1], axes: "world" },
    { kind: "shear", xz: 0.3 },
    { kind: "move_corners", corners: [3], by: [0.1, 0, 0] },
  ];
  it.each(all)("$kind: nothing at 0, all of it at 1, half the amount at a half", (operation) => {
    expect(operationSize(scaleOperation(operation, 0))).toBeCloseTo(0, 6);
    apply(scaleOperation(operation, 1), cage).corners.forEach((c, k) =>
      expectClose(c, apply(operation, cage).corners[k]),
    );
    expect(operationSize(scaleOperation(operation, 0.5))).toBeCloseTo(0.5 * operationSize(operation), 6);
  });

  it("of a rotation, done twice, is the rotation", () => {
    const half = scaleOperation({ kind: "rotate", rotation_deg: [20, 50, -70], axes: "world" }, 0.5);
    const twice = apply(half, apply(half, cage)).corners;
    twice.forEach((c, k) =>
      expectClose(c, apply({ kind: "rotate", rotation_deg: [20, 50, -70], axes: "world" }, cage).corners[k]),
    );
  });
});

describe("numbers", () => {
  it("snap to whole steps", () => {
    const steps = { length: 0.1, angle: 15, factor: 0.25 };
    expect(snapOperation({ kind: "translate", by: [0.26, -0.04, 1] }, steps)).toEqual({
      kind: "translate",
      by: [0.3, 0, 1],
    });
    expect(snapOperation({ kind: "rotate", rotation_deg: [0, 22, 0], axes: "world" }, steps)).toMatchObject({
      rotation_deg: [0, 15, 0],
    });
    expect(snapOperation({ kind: "scale", by: [0.01, 1.2, 1], axes: "cage" }, steps)).toMatchObject({
      by: [0.25, 1.25, 1],
    });
  });

  it("has a step of round length for cages of every size", () => {
    expect(snapLength(1)).toBeCloseTo(0.1, 12);
    expect(snapLength(0.6)).toBeCloseTo(0.05, 12);
    expect(snapLength(30)).toBeCloseTo(1, 12);
  });

  it("goes from angles to a quaternion and back", () => {
    expectClose(degreesFromQuaternion(quaternionFromDegrees([10, -20, 30])), [10, -20, 30]);
  });

  it("reads as text", () => {
    expect(describeOperation({ kind: "translate", by: [0.1, -0, 2] })).toBe("0.100  0.000  2.000");
    expect(describeOperation({ kind: "rotate", rotation_deg: [0, 12.34, 0] })).toBe("0.0°  12.3°  0.0°");
  });
});
