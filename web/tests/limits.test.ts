import { Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { containedShare, contains, expectedShare } from "../src/editing/limits";
import type { Corners } from "../src/net/protocol";
import { box } from "./cages";

const turn = new Quaternion().setFromAxisAngle(new Vector3(1, -1, 2).normalize(), 0.9);
const inner = { corners: box([0, 0, 0], [0.6, 0.6, 0.6]), pivot: [0, 0, 0] as [number, number, number] };
const outer = box([0, 0, 0], [1.6, 1.6, 1.6]);

describe("whether a cage contains a point", () => {
  it("agrees with a turned box's own coordinates", () => {
    const cage = box([1, 2, 3], [2, 1, 0.5], turn);
    for (let n = 0; n < 200; n++) {
      const local = new Vector3(1.6 * Math.sin(n), 0.8 * Math.sin(2.3 * n), 0.4 * Math.cos(5.1 * n));
      const inside = Math.abs(local.x) <= 1 && Math.abs(local.y) <= 0.5 && Math.abs(local.z) <= 0.25;
      const point = local
        .applyQuaternion(turn)
        .add(new Vector3(1, 2, 3))
        .toArray();
      expect(contains(cage, point)).toBe(inside);
    }
  });

  it("follows a corner that was pulled out", () => {
    const cage = box([0, 0, 0], [1, 1, 1]).map((c, k) => (k === 7 ? [1, 1, 1] : c)) as Corners;
    expect(contains(cage, [0.9, 0.9, 0.9])).toBe(true);
    expect(contains(cage, [0.9, 0.9, 0.1])).toBe(false);
    expect(contains(box([0, 0, 0], [1, 1, 1]), [0.9, 0.9, 0.9])).toBe(false);
  });
});

describe("how far a drag may go", () => {
  it("is the gap between the cages, of a translation", () => {
    expect(containedShare({ kind: "translate", by: [1, 0, 0] }, inner, outer)).toBeCloseTo(0.5, 2);
    expect(containedShare({ kind: "translate", by: [0.4, 0, 0] }, inner, outer)).toBe(1);
  });

  it("is found for a turn that would be inside again at its end", () => {
    const tight = box([0, 0, 0], [0.65, 0.65, 0.65]);
    // a cube of .6 turned by t about z reaches .3 (cos t + sin t) <= .325 up to t = 4.98 degrees
    const share = containedShare({ kind: "rotate", rotation_deg: [0, 0, 60], axes: "world" }, inner, tight);
    expect(share * 60).toBeGreaterThan(4.8);
    expect(share * 60).toBeLessThan(5.0);
  });

  it("is everything without an outer cage, and where the start is outside already", () => {
    expect(containedShare({ kind: "translate", by: [9, 0, 0] }, inner, null)).toBe(1);
    expect(containedShare({ kind: "translate", by: [9, 0, 0] }, inner, box([5, 0, 0], [1, 1, 1]))).toBe(1);
  });

  it("is guessed from what the server let through", () => {
    const last = {
      operation: { kind: "translate" as const, by: [1, 0, 0] as [number, number, number] },
      part: 0.5,
    };
    expect(expectedShare({ kind: "translate", by: [2, 0, 0] }, last)).toBeCloseTo(0.25, 12);
    expect(expectedShare({ kind: "translate", by: [0.4, 0, 0] }, last)).toBe(1);
    expect(expectedShare({ kind: "rotate", rotation_deg: [0, 0, 9] }, last)).toBe(1);
    expect(expectedShare({ kind: "translate", by: [2, 0, 0] }, null)).toBe(1);
  });
});
