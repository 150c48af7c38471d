import { Quaternion, Ray, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import {
  moveCornersBy,
  closestPointOnLine,
  intersectPlane,
  rotationBetween,
  scalingBy,
  translationBetween,
} from "../src/editing/gestures";
import { apply, quaternionFromDegrees } from "../src/editing/operations";
import { box, expectClose } from "./cages";

const frame = new Quaternion().setFromAxisAngle(new Vector3(1, 2, -1).normalize(), 0.8);
const around = (axis: Vector3, angle: number): Quaternion =>
  new Quaternion().setFromAxisAngle(axis, (angle * Math.PI) / 180);

describe("what the gizmo did, as an operation", () => {
  it("is a translation between two places", () => {
    expect(translationBetween(new Vector3(1, 1, 1), new Vector3(1.5, 1, 0))).toEqual({
      kind: "translate",
      by: [0.5, 0, -1],
    });
  });

  it.each([30, 120, -150, 180])("is one angle where it was turned about one axis: %d", (angle) => {
    const turned = frame.clone().multiply(around(new Vector3(0, 1, 0), angle));
    expect(rotationBetween(frame, turned, "cage", "Y")).toEqual({
      kind: "rotate",
      rotation_deg: [0, angle, 0],
      axes: "cage",
    });
  });

  it("is three angles that give the same turn where it was turned freely", () => {
    const free = around(new Vector3(1, 1, 0.2).normalize(), 77);
    const operation = rotationBetween(frame, frame.clone().multiply(free), "cage", "XYZE");
    if (operation.kind !== "rotate") throw new Error(operation.kind);
    expect(quaternionFromDegrees(operation.rotation_deg).angleTo(free)).toBeLessThan(1e-6);
  });

  it("turns the cage that the gizmo stood on as the gizmo was turned", () => {
    const cage = { corners: box([0, 0, 0], [1, 2, 3], frame), pivot: [0, 0, 0] as [number, number, number] };
    const turned = frame.clone().multiply(around(new Vector3(1, 0, 0), 40));
    const after = apply(rotationBetween(frame, turned, "cage", "X"), cage).corners;
    box([0, 0, 0], [1, 2, 3], turned).forEach((c, k) => expectClose(after[k], c, 7));
  });

  it("keeps factors of a scaling above 0 and within reason", () => {
    expect(scalingBy(new Vector3(2, -1, 1e9), "world")).toEqual({
      kind: "scale",
      by: [2, 0.02, 50],
      axes: "world",
    });
  });

  it("moves corners in order", () => {
    expect(moveCornersBy([5, 1], new Vector3(0, 0, 1))).toEqual({
      kind: "move_corners",
      corners: [1, 5],
      by: [0, 0, 1],
    });
  });
});

describe("where the mouse's ray goes", () => {
  const ray = new Ray(new Vector3(0, 0, 5), new Vector3(0, 0, -1));
  it("meets a plane in front of it, and none behind or along it", () => {
    expectClose(intersectPlane(ray, new Vector3(3, 3, 1), new Vector3(0, 0, 1))!.toArray(), [0, 0, 1]);
    expect(intersectPlane(ray, new Vector3(0, 0, 9), new Vector3(0, 0, 1))).toBeNull();
    expect(intersectPlane(ray, new Vector3(1, 0, 0), new Vector3(1, 0, 0))).toBeNull();
  });

  it("comes nearest to a line where the distance is least", () => {
    const point = new Vector3(1, 2, 3);
    const direction = new Vector3(1, 0.5, 0.2);
    const found = closestPointOnLine(ray, point, direction)!;
    const least = ray.distanceSqToPoint(found);
    for (const t of [-0.01, 0.01])
      expect(ray.distanceSqToPoint(found.clone().addScaledVector(direction, t))).toBeGreaterThan(least);
    expect(closestPointOnLine(ray, point, new Vector3(0, 0, 1))).toBeNull();
  });
});
