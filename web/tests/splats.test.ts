import { describe, expect, it } from "vitest";
import { depthOrder } from "../src/splats/depth_order";
import { harmonicWords, decodeMeans, joinHighLowBytes } from "../src/splats/splat_file";

describe("splats from far to near", () => {
  const depths = { axis: [0, 0, 1] as const, offset: 2, near: 0.5 };
  let seed = 1;
  const chance = (): number => (seed = (16807 * seed) % 2147483647) / 2147483647;

  it("sorts thousands by their depth, and leaves out what is too near", () => {
    const means = Float32Array.from({ length: 9000 }, () => 4 * chance() - 2);
    const order = depthOrder({ means, hidden: null, changed: null }, depths);
    const z = Float32Array.from(order, (n) => means[3 * n + 2] + 2);
    for (let n = 1; n < z.length; n++) expect(z[n]).toBeLessThanOrEqual(z[n - 1]);
    expect(new Set(order).size).toBe(order.length);
    expect(order.length).toBe(means.filter((value, n) => n % 3 === 2 && value + 2 >= 0.5).length);
  });

  it("leaves out hidden ones, and numbers changed ones after the others", () => {
    const means = Float32Array.of(0, 0, 1, 0, 0, 2, 0, 0, 3);
    const changed = Float32Array.of(0, 0, 2.5, 0, 0, -2, NaN, 0, 2);
    const set = { means, hidden: Uint8Array.of(0, 1, 0), changed };
    expect([...depthOrder(set, depths)]).toEqual([2, 3, 0]);
  });
});

describe("a file's numbers", () => {
  it("puts bytes together", () => {
    expect([...joinHighLowBytes(Uint8Array.of(1, 0, 2, 255))]).toEqual([258, 255]);
  });

  it("finds means in their chunk's bounds", () => {
    const chunks = Float32Array.of(-1, 0, 2, 1, 10, 2);
    expect([...decodeMeans(chunks, Uint8Array.of(0, 255, 7, 0, 255, 7), 1)]).toEqual([-1, 10, 2]);
  });

  it("keeps whole texels of coefficients", () => {
    expect([0, 1, 2, 3, 4].map(harmonicWords)).toEqual([0, 4, 8, 12, 20]);
  });
});
