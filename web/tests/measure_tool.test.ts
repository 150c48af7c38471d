import { describe, expect, it } from "vitest";
import { describeDistance, distanceOf } from "../src/editing/measure_tool";

describe("measuring tool", () => {
  it("has the distance between its points", () => {
    expect(
      distanceOf([
        [1, 2, 3],
        [1, 5, 7],
      ]),
    ).toBe(5);
  });

  it("names distances with four digits, in meters where the scale is known", () => {
    expect(describeDistance(1.23456, null)).toBe("1.235 units");
    expect(describeDistance(0.00123456, null)).toBe("0.001235 units");
    expect(describeDistance(123456, null)).toBe("123456 units");
    expect(describeDistance(2, 0.25)).toBe("0.5 m");
    expect(describeDistance(0, null)).toBe("0 units");
    expect(describeDistance(1e-40, null)).toBe("0 units");
  });
});
