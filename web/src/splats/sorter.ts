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

interface Job {
  set: SplatSet;
  depths: Depths;
  /** Called when a set's first order is there; null for another camera. */
  prepared: (() => void) | null;
}

export class Sorter {
  /** Called when an order has come from the worker. */
  onOrder: (() => void) | null = null;
  /** Orders that were made on the page, which waited for them. */
  sortedHere = 0;
  private order: Order | null = null;
  /** The first order of a set that is yet to be asked for. */
  private ready: Order | null = null;
  private worker: Worker | null = null;
  /** Whether there can be no worker: all is sorted at once. */
  private alone = false;
  /** The set that the worker has. */
  private posted: SplatSet | null = null;
  /** What the worker sorts now, and what it is to sort next: a set that is prepared goes first. */
  private running: Job | null = null;
  private preparing: Job | null = null;
  private next: Job | null = null;
  /** Whether an order has been made on the page since the worker began. */
  private outdated = false;

  /**
   * The order of a set that there is: of another camera where the worker has not answered yet, never of another set.
   * With `now` it is of this camera.
   */
  of(set: SplatSet, depths: Depths, now: boolean): Order {
    if (this.ready?.set === set) {
      this.order = this.ready;
      this.ready = null;
    }
    const { order } = this;
    const known = order?.set === set ? order : null;
    if (known !== null && same(known.depths, depths)) return known;
    if (known === null || now || this.isQuick(set)) {
      this.next = null;
      this.outdated = this.running !== null;
      this.sortedHere += 1;
      return (this.order = { numbers: depthOrder(set, depths), set, depths });
    }
    const { running } = this;
    const asked = running?.set === set && same(running.depths, depths);
    this.next = asked ? null : { set, depths, prepared: null };
    this.goOn();
    return known;
  }

  /** Has the worker sort a set that is to be drawn next, so that `of` finds an order of it. */
  prepare(set: SplatSet, depths: Depths): Promise<void> {
    if (this.isQuick(set)) return Promise.resolve();
    return new Promise((prepared) => {
      this.preparing?.prepared?.();
      this.preparing = { set, depths, prepared };
      this.goOn();
    });
  }

  dispose(): void {
    this.worker?.terminate();
    const waiting = [this.running, this.preparing];
    this.worker = this.posted = this.running = this.preparing = this.next = this.ready = this.order = null;
    for (const job of waiting) job?.prepared?.();
  }

  private isQuick({ means, changed }: SplatSet): boolean {
    return this.alone || means.length + (changed?.length ?? 0) <= 3 * FEW;
  }

  /** Gives the worker, if it waits, what is to be sorted next. */
  private goOn(): void {
    const job = this.preparing ?? this.next;
    if (this.running !== null || job === null) return;
    if (job === this.preparing) this.preparing = null;
    else this.next = null;
    this.running = job;
    this.worker ??= this.begun();
    const { set, depths } = job;
    const post = (message: ToSorter): void => this.worker?.postMessage(message);
    if (this.posted?.means !== set.means) post({ means: set.means });
    if (this.posted !== set) post({ hidden: set.hidden, changed: set.changed });
    this.posted = set;
    post({ sort: depths });
  }

  private begun(): Worker {
    const worker = new OrderWorker();
    worker.onmessage = ({ data }: MessageEvent<Uint32Array<ArrayBuffer>>): void => this.answered(data);
    worker.onerror = () => {
      this.alone = true;
      this.dispose();
      this.onOrder?.();
    };
    return worker;
  }

  private answered(numbers: Uint32Array<ArrayBuffer>): void {
    const { running: job, outdated } = this;
    this.running = null;
    this.outdated = false;
    if (job === null) return;
    const found = { numbers, set: job.set, depths: job.depths };
    if (job.prepared !== null) {
      this.ready = found;
      job.prepared();
    } else if (this.order?.set === job.set && !outdated) {
      this.order = found;
      this.onOrder?.();
    }
    this.goOn();
  }
}

export function same(one: Depths, other: Depths): boolean {
  return (
    one.offset === other.offset &&
    one.near === other.near &&
    one.axis.every((value, n) => value === other.axis[n])
  );
}
