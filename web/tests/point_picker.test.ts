import { describe, expect, it } from "vitest";
import { nextPointText, pairsOf } from "../src/editing/point_picker";
import type { Vec3 } from "../src/net/protocol";

const points = (count: number): Vec3[] => Array.from({ length: count }, (_, k) => [k, 0, 0]);

describe("point picker", () => {
  it("makes pairs of the points clicked in turn", () => {
    expect(pairsOf(points(4))).toEqual([
      { pasted: [0, 0, 0], scene: [1, 0, 0] },
      { pasted: [2, 0, 0], scene: [3, 0, 0] },
    ]);
    expect(pairsOf(points(3))).toHaveLength(1);
  });

  it("names the click it waits for", () => {
    expect(nextPointText({ purpose: "up", points: points(2) })).toContain("point 3 of 3");
    expect(nextPointText({ purpose: "paste", points: points(2) })).toBe(
      "pair 2 of 3: click on the pasted thing",
    );
    expect(nextPointText({ purpose: "paste", points: points(5) })).toBe(
      "pair 3 of 3: click where that point belongs",
    );
  });
});
