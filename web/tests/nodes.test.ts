import { describe, expect, it } from "vitest";
import { nodePriority } from "../src/splats/node_order";
import { NodeResidency } from "../src/splats/node_residency";
import type { SplatNode } from "../src/splats/splat_file";

/** A node of 10 splats, ten units before a camera at the origin. */
const node = (x: number, size: number): SplatNode => ({
  count: 10,
  coarse: [0, 1],
  bounds: [
    [x - size, -size, -10 - size],
    [x + size, size, -10 + size],
  ],
  url: String(x),
  bytes: 1,
});
/** A camera at `x`, whose image is ten units wide where the nodes are. */
const camera = (x = 0) => ({
  c2w: [1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
  width: 100,
  height: 100,
  fx: 100,
  fy: 100,
  cx: 50,
  cy: 50,
});

/** Names of the nodes that a residency loads for a camera, each with the one that it evicts. */
function loaded(residency: NodeResidency, x: number): string[] {
  const found: string[] = [];
  residency.look(camera(x));
  for (let next = residency.next(camera(x)); next; next = residency.next(camera(x))) {
    if (next.evicted !== null) residency.release(next.evicted);
    residency.place(next.node);
    residency.store(next.node);
    found.push(next.evicted === null ? next.node.url : `${next.node.url} for ${next.evicted.url}`);
  }
  return found;
}

it("nodes in the image come before larger ones beside it", () => {
  expect(nodePriority(node(0, 1), camera())).toBeGreaterThan(nodePriority(node(40, 2), camera()));
  expect(nodePriority(node(0, 1), camera())).toBeGreaterThan(nodePriority(node(0, 0.5), camera()));
  const all = new NodeResidency([node(40, 2), node(0, 0.5), node(1, 1)], 5, 35);
  expect(all.isComplete).toBe(true);
  expect(loaded(all, 0)).toEqual(["1", "0", "40"]);
  expect(all.next(camera())).toBeNull();
});

describe("where not all nodes have room", () => {
  const street = [0, 20, 40, 60].map((x) => node(x, 1));

  it("evicts the node least recently visible, and none in the image", () => {
    const two = new NodeResidency(street, 5, 34);
    expect(two.isComplete).toBe(false);
    expect(loaded(two, 0)).toEqual(["0", "20"]);
    expect(loaded(two, 20)).toEqual([]);
    expect(loaded(two, 40)).toEqual(["40 for 0"]);
    expect(loaded(two, 60)).toEqual(["60 for 20"]);
    // The node at 40 was seen after the one at 20 had gone.
    expect(loaded(two, 0)).toEqual(["0 for 40"]);
    expect(two.resident).toBe(2);
    expect(two.coarseInImage()).toBe(0);
  });

  it("gives a place to one node at a time", () => {
    const two = new NodeResidency(street, 5, 34);
    const places = [0, 20, 40, 60].map((x) => {
      loaded(two, x);
      return street.filter((each) => each.url === String(x)).map((each) => two.place(each))[0];
    });
    expect(places).toEqual([5, 15, 5, 15]);
  });

  it("keeps nodes in the image, but for much smaller ones", () => {
    const alike = new NodeResidency([node(-2, 1), node(0, 1), node(2, 0.9)], 5, 29);
    expect(loaded(alike, 0)).toEqual(["0", "-2"]);
    expect(alike.coarseInImage()).toBe(1);
    const small = new NodeResidency([node(-2, 0.2), node(0, 1.5), node(2, 1.4)], 5, 15);
    const [first] = [small].map((each) => each.next(null));
    small.store(first!.node);
    expect(loaded(small, 0)).toEqual(["0 for -2"]);
    expect(small.coarseInImage()).toBe(2);
  });

  it("tries a node again whose file has not come", () => {
    const one = new NodeResidency(street, 5, 15);
    one.look(camera());
    const next = one.next(camera());
    one.release(next!.node);
    expect(loaded(one, 0)).toEqual(["0"]);
  });

  it("loads none where no node has room", () => {
    const none = new NodeResidency(street, 5, 14);
    expect(loaded(none, 0)).toEqual([]);
    expect(none.coarseInImage()).toBe(1);
  });
});
