/**
 * Nodes of splats that are stored: which one is loaded next, its place, and which nodes it evicts.
 *
 * Where not all nodes have room, places have the size of the largest node. A node in the image then takes the
 * place of one outside, the one least recently visible, else of a node in the image that is smaller by
 * EVICTED_SIZE.
 */
import type { PinholeCamera } from "../field/march_uniforms";
import { isInImage, nodePriority } from "./node_order";
import type { SplatNode } from "./splat_file";

/** Angular size of a node in the image that is evicted, relative to the node that takes its place, at most. */
export const EVICTED_SIZE = 0.5;

type State = "coarse" | "loading" | "stored" | "evicted";

export class NodeResidency {
  /** Whether all nodes have room, so that none is evicted. */
  readonly isComplete: boolean;
  private readonly states: State[];
  /** Number of the view in which a node was last in the image. */
  private readonly seen: number[];
  private readonly places = new Map<SplatNode, number>();
  private readonly free: number[] = [];
  private views = 0;

  /** Nodes beside `first` coarse splats, `capacity` splats in all. */
  constructor(
    private readonly nodes: readonly SplatNode[],
    first: number,
    capacity: number,
  ) {
    const ends = [first];
    for (const node of nodes) ends.push(ends[ends.length - 1] + node.count);
    this.isComplete = ends[nodes.length] <= capacity;
    this.states = nodes.map(() => "coarse");
    this.seen = nodes.map(() => 0);
    if (this.isComplete) {
      this.free.push(...ends.slice(0, -1));
      nodes.forEach((node, n) => this.places.set(node, ends[n]));
      return;
    }
    const size = Math.max(...nodes.map((node) => node.count));
    for (let place = first; place + size <= capacity; place += size) this.free.push(place);
  }

  /** Number of nodes that are stored or on their way. */
  get resident(): number {
    return this.states.filter((state) => state === "loading" || state === "stored").length;
  }

  /** Notes which nodes a view has in its image. */
  look(camera: PinholeCamera): void {
    this.views += 1;
    this.nodes.forEach((node, n) => {
      if (isInImage(node, camera)) this.seen[n] = this.views;
    });
  }

  /**
   * The coarse node with the largest image for which there is room, and the node that it evicts, null where a
   * place is free; null where nothing is to be loaded.
   */
  next(camera: PinholeCamera | null): { node: SplatNode; evicted: SplatNode | null } | null {
    const size = (n: number): number => (camera === null ? -n : nodePriority(this.nodes[n], camera));
    const best = this.largest((n) => this.states[n] === "coarse", size);
    if (best === null) return null;
    const node = this.nodes[best];
    if (this.isComplete || this.resident < this.free.length + this.places.size) {
      this.states[best] = "loading";
      return { node, evicted: null };
    }
    if (camera === null || this.seen[best] !== this.views) return null;
    const victim = this.victim(size(best), size);
    if (victim === null) return null;
    this.states[best] = "loading";
    this.states[victim] = "evicted";
    return { node, evicted: this.nodes[victim] };
  }

  /** First splat of a loading node's place. */
  place(node: SplatNode): number {
    const known = this.places.get(node) ?? this.free.shift();
    if (known === undefined) throw new Error("no place for a node of splats");
    this.places.set(node, known);
    return known;
  }

  /** Marks a node as stored. */
  store(node: SplatNode): void {
    this.states[this.nodes.indexOf(node)] = "stored";
  }

  /** Makes a node coarse again whose splats are no longer drawn, or whose file has not come; frees its place. */
  release(node: SplatNode): void {
    this.states[this.nodes.indexOf(node)] = "coarse";
    if (this.isComplete) return;
    const place = this.places.get(node);
    this.places.delete(node);
    if (place !== undefined) this.free.push(place);
  }

  /** Number of nodes in the image that stay coarse. */
  coarseInImage(): number {
    return this.nodes.filter((_, n) => this.states[n] === "coarse" && this.seen[n] === this.views).length;
  }

  private victim(size: number, sizeOf: (n: number) => number): number | null {
    const outside = this.largest(
      (n) => this.states[n] === "stored" && this.seen[n] !== this.views,
      (n) => -this.seen[n],
    );
    if (outside !== null) return outside;
    const smallest = this.largest(
      (n) => this.states[n] === "stored",
      (n) => -sizeOf(n),
    );
    return smallest !== null && sizeOf(smallest) < EVICTED_SIZE * size ? smallest : null;
  }

  /** Number of the node for which a value is largest, among those of a condition; null without one. */
  private largest(among: (n: number) => boolean, value: (n: number) => number): number | null {
    let best: number | null = null;
    let most = -Infinity;
    for (let n = 0; n < this.nodes.length; n++) {
      if (!among(n) || value(n) <= most) continue;
      best = n;
      most = value(n);
    }
    return best;
  }
}
