/** Depth orders of sets of splats for the current camera: small sets at once, large ones in a worker. */
import { depthOrder } from "./depth_order";
import type { Depths, SplatSet } from "./depth_order";
import type { ToSorter } from "./order_worker";
import OrderWorker from "./order_worker?worker&inline";

/** Number of splats that are sorted within one or two milliseconds. */
const MAX_SYNCHRONOUS_SPLATS = 32_768;

export interface Order {
  /** Numbers of the splats, far to near. */
  numbers: Uint32Array<ArrayBuffer>;
  set: SplatSet;
  depths: Depths;
}

interface Job {
  set: SplatSet;
  depths: Depths;
  /** Called when the first order of a prepared set is complete; null for a job of the current set. */
  prepared: (() => void) | null;
}

export class Sorter {
  /** Called when the worker has returned an order. */
  onOrder: (() => void) | null = null;
  /** Number of orders for which the page has waited. */
  sortedHere = 0;
  private order: Order | null = null;
  /** The order of a prepared set that has not been drawn yet. */
  private firstOrder: Order | null = null;
  private worker: Worker | null = null;
  /** Whether the page may have no worker, so that all sets are sorted at once. */
  private hasNoWorker = false;
  /** The set that the worker has. */
  private postedSet: SplatSet | null = null;
  /** The job of the worker, and the next ones: a prepared set takes precedence. */
  private running: Job | null = null;
  private preparing: Job | null = null;
  private next: Job | null = null;
  /** Whether the page has sorted since the worker's job began, so that the job is obsolete. */
  private outdated = false;

  /**
   * An order of the set, possibly for an earlier camera, if the worker has not answered yet. With `now` the order is for
   * the given camera.
   */
  orderFor(set: SplatSet, depths: Depths, now: boolean): Order {
    if (this.firstOrder?.set === set) {
      this.order = this.firstOrder;
      this.firstOrder = null;
    }
    const { order } = this;
    const known = order?.set === set ? order : null;
    if (known !== null && haveSameDepths(known.depths, depths)) return known;
    if (known === null || now || this.isQuick(set)) {
      this.next = null;
      this.outdated = this.running !== null;
      this.sortedHere += 1;
      return (this.order = { numbers: depthOrder(set, depths), set, depths });
    }
    const { running } = this;
    const asked = running?.set === set && haveSameDepths(running.depths, depths);
    this.next = asked ? null : { set, depths, prepared: null };
    this.postNext();
    return known;
  }

  /** Sorts a set in the worker before it is drawn, so that `orderFor` has an order at once. */
  prepare(set: SplatSet, depths: Depths): Promise<void> {
    if (this.isQuick(set)) return Promise.resolve();
    return new Promise((prepared) => {
      this.preparing?.prepared?.();
      this.preparing = { set, depths, prepared };
      this.postNext();
    });
  }

  dispose(): void {
    this.worker?.terminate();
    const waiting = [this.running, this.preparing];
    this.worker =
      this.postedSet =
      this.running =
      this.preparing =
      this.next =
      this.firstOrder =
      this.order =
        null;
    for (const job of waiting) job?.prepared?.();
  }

  private isQuick({ means, changed }: SplatSet): boolean {
    return this.hasNoWorker || means.length + (changed?.length ?? 0) <= 3 * MAX_SYNCHRONOUS_SPLATS;
  }

  /** Posts the next job to an idle worker. */
  private postNext(): void {
    const job = this.preparing ?? this.next;
    if (this.running !== null || job === null) return;
    if (job === this.preparing) this.preparing = null;
    else this.next = null;
    this.running = job;
    this.worker ??= this.startWorker();
    const { set, depths } = job;
    const post = (message: ToSorter): void => this.worker?.postMessage(message);
    if (this.postedSet?.means !== set.means) post({ means: set.means });
    if (this.postedSet !== set) post({ hidden: set.hidden, changed: set.changed });
    this.postedSet = set;
    post({ sort: depths });
  }

  private startWorker(): Worker {
    const worker = new OrderWorker();
    worker.onmessage = ({ data }: MessageEvent<Uint32Array<ArrayBuffer>>): void => this.takeAnswer(data);
    worker.onerror = () => {
      this.hasNoWorker = true;
      this.dispose();
      this.onOrder?.();
    };
    return worker;
  }

  private takeAnswer(numbers: Uint32Array<ArrayBuffer>): void {
    const { running: job, outdated } = this;
    this.running = null;
    this.outdated = false;
    if (job === null) return;
    const found = { numbers, set: job.set, depths: job.depths };
    if (job.prepared !== null) {
      this.firstOrder = found;
      job.prepared();
    } else if (this.order?.set === job.set && !outdated) {
      this.order = found;
      this.onOrder?.();
    }
    this.postNext();
  }
}

export function haveSameDepths(one: Depths, other: Depths): boolean {
  return (
    one.offset === other.offset &&
    one.near === other.near &&
    one.axis.every((value, n) => value === other.axis[n])
  );
}
