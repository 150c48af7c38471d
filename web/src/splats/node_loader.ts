/** Loading of nodes of splats: those of the camera's image, each in place of its coarse splats. */
import type { PinholeCamera } from "../field/march_uniforms";
import type { LoadOptions } from "../field/scene_drawer";
import { NodeResidency } from "./node_residency";
import { readSplatLevels } from "./splat_file";
import type { SplatNode } from "./splat_file";
import type { SplatStore } from "./splat_store";

type Opened = NonNullable<LoadOptions["openBeside"]>;

/** Number of nodes that are loaded at a time: the next one is on its way while one is decoded. */
const PARALLEL = 2;

export class NodeLoader {
  readonly residency: NodeResidency;
  private applying: Promise<void> = Promise.resolve();
  /** Whether a call of `apply` waits for its turn. */
  private isQueued = false;
  private storing: Promise<void> = Promise.resolve();
  private running: Promise<void> | null = null;

  /**
   * @param apply Draws the stored nodes, once they are in order.
   * @param arrived Bytes that have arrived before the nodes.
   * @param wanted Whether the scene is still that of the page.
   */
  constructor(
    private readonly store: SplatStore,
    private readonly nodes: readonly SplatNode[],
    private readonly open: Opened,
    private readonly apply: () => Promise<void>,
    private readonly options: LoadOptions,
    public wanted: () => boolean,
    private arrived: number,
  ) {
    const coarse = nodes.reduce((end, node) => Math.max(end, node.coarse[1]), 0);
    this.residency = new NodeResidency(nodes, coarse, store.capacity);
  }

  /** Loads all nodes that have room, those of the camera's image first, and draws them. */
  async load(camera: () => PinholeCamera | null): Promise<void> {
    const now = camera();
    if (now !== null) this.residency.look(now);
    this.running ??= this.run(camera).finally(() => (this.running = null));
    await this.running;
  }

  /** Notes a view, and loads nodes that it shows and that have not been loaded. */
  look(camera: PinholeCamera): void {
    const { residency } = this;
    residency.look(camera);
    if (residency.isComplete || this.running !== null || residency.coarseInImage() === 0) return;
    this.load(() => camera).catch((error: unknown) => {
      this.options.onFailure?.(`details of the scene could not be loaded: ${String(error)}`);
    });
  }

  private async run(camera: () => PinholeCamera | null): Promise<void> {
    const one = async (): Promise<void> => {
      for (let next = this.residency.next(camera()); next; next = this.residency.next(camera())) {
        if (!this.wanted()) return;
        await this.loadNode(next.node, next.evicted);
      }
    };
    await Promise.all(Array.from({ length: PARALLEL }, one));
    await this.applied();
    const coarse = this.residency.coarseInImage();
    if (this.wanted() && coarse > 0) this.options.onCoarse?.(coarse, this.nodes.length);
  }

  private async loadNode(node: SplatNode, evicted: SplatNode | null): Promise<void> {
    let before = 0;
    const count = (bytes: number): void => {
      this.arrived += bytes - before;
      before = bytes;
      this.options.onArrival?.(this.arrived);
    };
    let isStored = false;
    try {
      for await (const level of readSplatLevels(await this.open(node.url), () => undefined, count)) {
        this.storing = this.storing.then(async () => {
          if (!this.wanted()) return;
          const leaving = evicted;
          evicted = null;
          if (leaving !== null) await this.evict(leaving);
          await this.store.storeNode(level, this.residency.place(node), node, this.wanted);
          this.residency.store(node);
        });
        await this.storing;
        isStored = true;
      }
    } finally {
      if (!isStored) {
        this.residency.release(node);
        if (evicted !== null) this.residency.store(evicted);
      }
    }
    void this.applied();
  }

  /** Draws a node's coarse splats in its place; only then is the place free. */
  private async evict(node: SplatNode): Promise<void> {
    this.store.dropNode(node);
    await this.applied();
    this.residency.release(node);
  }

  /** Draws the stored nodes after the earlier calls have done so: an older set never follows a newer one. */
  private applied(): Promise<void> {
    if (this.isQueued) return this.applying;
    this.isQueued = true;
    this.applying = this.applying.then(async () => {
      this.isQueued = false;
      await this.apply();
      if (this.wanted()) this.options.onDetails?.();
    });
    return this.applying;
  }
}
