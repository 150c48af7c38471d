import { expect } from "vitest";
import { Quaternion, Vector3 } from "three";
import type { Corners, Vec3 } from "../src/net/protocol";

/** A box: center, full edge lengths, turned by a quaternion. */
export function box(center: Vec3, size: Vec3, turn = new Quaternion()): Corners {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((k) =>
    new Vector3((k & 1) - 0.5, ((k >> 1) & 1) - 0.5, ((k >> 2) & 1) - 0.5)
      .multiply(new Vector3(...size))
      .applyQuaternion(turn)
      .add(new Vector3(...center))
      .toArray(),
  ) as Corners;
}

export function expectClose(a: readonly number[], b: readonly number[], digits = 9): void {
  expect(a.length).toBe(b.length);
  a.forEach((x, i) => expect(x).toBeCloseTo(b[i], digits));
}
