import { describe, expect, it } from "vitest";
import { extended, regionMessage, regionMode, type DrawnRegion } from "../src/editing/region_shapes";

const VIEW = { width: 200, height: 100 };
const OPTIONS = { brushRadius: 0.1, through: false, depthTolerance: 2, floodOpacity: 0.4, floodReach: 0.5 };
const NO_KEYS = { shiftKey: false, ctrlKey: false, metaKey: false };

function drawn(change: Partial<DrawnRegion>): DrawnRegion {
  return { tool: "lasso", mode: "replace", points: [{ x: 20, y: 20 }], ...change };
}

describe("regions that select", () => {
  it("have the mode of the keys, else the chosen one; a brush adds", () => {
    expect(regionMode("lasso", "replace", NO_KEYS)).toBe("replace");
    expect(regionMode("brush", "replace", NO_KEYS)).toBe("add");
    expect(regionMode("brush", "intersect", NO_KEYS)).toBe("intersect");
    expect(regionMode("lasso", "replace", { ...NO_KEYS, shiftKey: true })).toBe("add");
    expect(regionMode("brush", "replace", { ...NO_KEYS, metaKey: true })).toBe("subtract");
    expect(regionMode("lasso", "add", { ...NO_KEYS, shiftKey: true, ctrlKey: true })).toBe("intersect");
  });

  it("grow by steps of some pixels; a rectangle has two corners", () => {
    const lasso = drawn({});
    expect(extended(lasso, { x: 21, y: 20 })).toBe(lasso.points);
    expect(extended(lasso, { x: 24, y: 20 })).toHaveLength(2);
    const rectangle = drawn({
      tool: "rectangle",
      points: [
        { x: 0, y: 0 },
        { x: 9, y: 9 },
      ],
    });
    expect(extended(rectangle, { x: 50, y: 40 })).toEqual([
      { x: 0, y: 0 },
      { x: 50, y: 40 },
    ]);
  });

  it("are sent in shares of the view", () => {
    const points = [
      { x: 20, y: 20 },
      { x: 100, y: 20 },
      { x: 20, y: 90 },
    ];
    expect(regionMessage(drawn({ points }), VIEW, OPTIONS)).toEqual({
      type: "select_region",
      shape: "lasso",
      points: [
        [0.1, 0.2],
        [0.5, 0.2],
        [0.1, 0.9],
      ],
      radius: 0.1,
      mode: "replace",
      through: false,
      tolerance: 2,
    });
    expect(regionMessage(drawn({ tool: "flood", points: [{ x: -5, y: 50 }] }), VIEW, OPTIONS)).toEqual({
      type: "select_flood",
      x: 0,
      y: 0.5,
      threshold: 0.4,
      reach: 0.5,
      mode: "replace",
    });
  });

  it("need an area, except for the brush", () => {
    const points = [
      { x: 20, y: 20 },
      { x: 21, y: 21 },
    ];
    expect(regionMessage(drawn({ points }), VIEW, OPTIONS)).toBeNull();
    expect(regionMessage(drawn({ tool: "rectangle", points }), VIEW, OPTIONS)).toBeNull();
    expect(
      regionMessage(
        drawn({
          points: [
            { x: 0, y: 0 },
            { x: 50, y: 50 },
          ],
        }),
        VIEW,
        OPTIONS,
      ),
    ).toBeNull();
    expect(regionMessage(drawn({ tool: "brush" }), VIEW, OPTIONS)).toMatchObject({ points: [[0.1, 0.2]] });
  });

  it("are thinned to the points that the server takes", () => {
    const points = Array.from({ length: 10_001 }, (_, n) => ({ x: n % 190, y: n % 90 }));
    const message = regionMessage(drawn({ points }), VIEW, OPTIONS);
    if (message?.type !== "select_region") throw new Error("no region");
    expect(message.points.length).toBeLessThan(4000);
    expect(message.points.at(-1)).toEqual([points[10_000].x / 200, points[10_000].y / 100]);
  });
});
