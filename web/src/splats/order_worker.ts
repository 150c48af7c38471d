/** Sorts splats beside the page, so that a view that is turned does not wait. */
import { depthOrder } from "./depth_order";
import type { Depths, SplatSet } from "./depth_order";

export type ToSorter = { set: SplatSet } | { sort: Depths };

let set: SplatSet | null = null;

self.onmessage = ({ data }: MessageEvent<ToSorter>): void => {
  if ("set" in data) {
    set = data.set;
    return;
  }
  const order = set ? depthOrder(set, data.sort) : new Uint32Array(0);
  self.postMessage(order, { transfer: [order.buffer] });
};
