/** Worker that sorts splats, so that neither camera motion nor drags of many splats wait. */
import { depthOrder } from "./depth_order";
import type { Depths, SplatSet } from "./depth_order";

/** The changed parts of a set, then the depth function to sort by. */
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
