/** Sorts splats beside the page, so that a view that is turned, or a drag of many of them, does not wait. */
import { depthOrder } from "./depth_order";
import type { Depths, SplatSet } from "./depth_order";

/** Parts of a set that are others than before, and then what to sort it by. */
export type ToSorter = Pick<SplatSet, "means"> | Pick<SplatSet, "hidden" | "changed"> | { sort: Depths };

let set: SplatSet = { means: new Float32Array(0), hidden: null, changed: null };

self.onmessage = ({ data }: MessageEvent<ToSorter>): void => {
  if (!("sort" in data)) {
    set = { ...set, ...data };
    return;
  }
  const order = depthOrder(set, data.sort);
  self.postMessage(order, { transfer: [order.buffer] });
};
