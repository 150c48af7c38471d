/** The order of a set of splats for the camera that was asked for last: at once of few, else from a worker. */
import { depthOrder } from "./depth_order";
import type { Depths, SplatSet } from "./depth_order";
import type { ToSorter } from "./order_worker";
import OrderWorker from "./order_worker?worker&inline";

/** Splats that are sorted at once: a millisecond or two. */
const FEW = 32_768;

export interface Order {
  /** Numbers from far to near. */
  numbers: Uint32Array<ArrayBuffer>;
  set: SplatSet;
  depths: Depths;
}

export class Sorter {
  /** Called when an order has come from the worker. */
  onOrder: (() => void) | null = null;
  private order: Order | null = null;
  private worker: Worker | null = null;
  /** The set that the worker has. */
  private posted: SplatSet | null = null;
  /** What the worker sorts now, and what it is to sort next. */
  private sorting: Depths | null = null;
  private next: Depths | null = null;
  /** Whether an order has been made on the page since the worker began. */
  private outdated = false;

  /**
   * The order of a set that there is: of another camera where the worker has not answered yet, never of another set.
   * With `now` it is of this camera.
   */
  of(set: SplatSet, depths: Depths, now: boolean): Order {
    const { order } = this;
    const known = order?.set === set ? order : null;
    if (known !== null && same(known.depths, depths)) return known;
    if (known === null || now || set.means.length <= 3 * FEW) {
      this.next = null;
      this.outdated = this.sorting !== null;
      return (this.order = { numbers: depthOrder(set, depths), set, depths });
    }
    this.ask(set, depths);
    return known;
  }

  dispose(): void {
    this.worker?.terminate();
    this.worker = this.posted = this.sorting = this.next = this.order = null;
  }

  private ask(set: SplatSet, depths: Depths): void {
    if (this.sorting !== null && same(this.sorting, depths) && this.posted === set) {
      this.next = null;
      return;
    }
    this.next = depths;
    if (this.sorting !== null) return;
    this.worker ??= this.begun();
    if (this.posted !== set) {
      this.worker.postMessage({ set } satisfies ToSorter);
      this.posted = set;
    }
    this.sorting = this.next;
    this.next = null;
    this.worker.postMessage({ sort: this.sorting } satisfies ToSorter);
  }

  private begun(): Worker {
    const worker = new OrderWorker();
    worker.onmessage = ({ data }: MessageEvent<Uint32Array<ArrayBuffer>>): void => {
      const { sorting, posted, order, next, outdated } = this;
      this.sorting = null;
      this.outdated = false;
      if (sorting === null || posted === null || order?.set !== posted || outdated) return;
      this.order = { numbers: data, set: posted, depths: sorting };
      if (next) this.ask(posted, next);
      this.onOrder?.();
    };
    return worker;
  }
}

export function same(one: Depths, other: Depths): boolean {
  return one.offset === other.offset && one.near === other.near && one.axis.every((value, n) => value === other.axis[n]);
}
