/**
 * A drag in the page: cages that follow the mouse at once, messages to the server, and the server's answers, which state
 * the granted share of the operation.
 */
import { apply, scaleOperation, type Operation } from "./operations";
import { containedShare, expectedShare } from "./limits";
import { halfExtent, centroid, type Posed } from "./cage";
import { handlesOf, posedCage } from "./point_cages";
import type { Corners, Dragged, EditState, PageMessage } from "../net/protocol";
import type { Target } from "../app/store";

/** Distance of corners below which cages count as equal, as a share of the cage's size. */
const CAGE_TOLERANCE = 1e-5;

/** Reason for the limit of a continuous edit; the server's words. */
const OUTER_CAGE_LIMIT = "the inner cage must stay inside the outer cage; enlarge the outer cage (Set mode)";

/** The cages of an edit as they are drawn. */
export interface Cages {
  inner: Posed;
  deformed: Posed;
  outer: Posed | null;
}

/** The cages of an edit without a drag. */
export function cagesOf(edit: EditState): Cages {
  return {
    inner: posedCage(edit.inner, edit.inner_pivot, edit.points?.canonical ?? [], edit.points),
    deformed: posedCage(edit.deformed, edit.pivot, edit.points?.deformed ?? [], edit.points),
    outer: edit.outer && { corners: edit.outer, pivot: edit.outer_pivot ?? centroid(edit.outer) },
  };
}

/** The cage that carries the gizmo for a target of a drag. */
export function targetCage(cages: Cages, target: Target): Posed {
  if (target === "field") return cages.deformed;
  return target === "outer" && cages.outer ? cages.outer : cages.inner;
}

/** Whether cages have the same handles, up to CAGE_TOLERANCE of the size of the first. */
export function areSimilarCages(a: Posed, b: Posed): boolean {
  const slack = CAGE_TOLERANCE * halfExtent(a.corners);
  const others = handlesOf(b);
  return handlesOf(a).every((handle, k) => handle.every((x, i) => Math.abs(x - others[k][i]) <= slack));
}

function areSimilar(a: Cages, b: Cages): boolean {
  const outer =
    a.outer === null || b.outer === null ? a.outer === b.outer : areSimilarCages(a.outer, b.outer);
  return areSimilarCages(a.inner, b.inner) && areSimilarCages(a.deformed, b.deformed) && outer;
}

export class Drag {
  readonly start: Cages;
  shown: Cages;
  operation: Operation | null = null;
  /** The share of the operation that the cages follow. */
  followed: Operation | null = null;
  seq = 0;
  /** Reason for the limit of the drag; null while the cages follow the whole operation. */
  why: string | null = null;
  ended = false;
  private lastAnswer: { operation: Operation; part: number; why: string | null } | null = null;
  private readonly sent = new Map<number, Operation>();

  constructor(
    readonly id: number,
    readonly edit: EditState,
    readonly target: Target,
    private readonly send: (message: PageMessage) => void,
  ) {
    this.start = cagesOf(edit);
    this.shown = this.start;
    send({ type: "drag_begin", drag: id, edit: edit.id, target });
  }

  /** Applies the whole operation since the start of the drag, as far as the estimated limit allows. */
  move(operation: Operation): void {
    if (this.ended) return;
    this.operation = operation;
    this.seq += 1;
    this.sent.set(this.seq, operation);
    this.send({ type: "drag", drag: this.id, seq: this.seq, operation });
    const byCage = this.isConfined ? containedShare(operation, this.start.deformed, this.outerCorners) : 1;
    const byServer = expectedShare(operation, this.lastAnswer);
    const share = Math.min(byCage, byServer);
    this.why = share >= 1 ? null : (this.lastAnswer?.why ?? OUTER_CAGE_LIMIT);
    this.applyShare(operation, share);
  }

  /** Applies the server's answer; returns whether the drawn cages change. */
  takeAnswer(message: Dragged): boolean {
    const operation = this.sent.get(message.seq);
    if (message.drag !== this.id || operation === undefined) return false;
    for (const seq of this.sent.keys()) if (seq < message.seq) this.sent.delete(seq);
    this.lastAnswer = { operation, part: message.part, why: message.why };
    if (message.seq !== this.seq) return false;
    this.why = message.why;
    const before = this.shown;
    this.applyShare(operation, message.part);
    const pivots = this.shown;
    this.shown = {
      inner: posedCage(message.inner, pivots.inner.pivot, message.points, this.edit.points),
      deformed: posedCage(message.deformed, pivots.deformed.pivot, message.deformed_points, this.edit.points),
      outer: message.outer && {
        corners: message.outer,
        pivot: pivots.outer?.pivot ?? centroid(message.outer),
      },
    };
    return !areSimilar(before, this.shown);
  }

  /** Ends the drag, which becomes an entry of the history; a drag without a motion is cancelled. */
  end(): void {
    if (this.ended) return;
    this.ended = true;
    if (this.operation === null) this.send({ type: "drag_cancel", drag: this.id });
    else this.send({ type: "drag_end", drag: this.id, seq: this.seq, operation: this.operation });
  }

  /** Cancels the drag and restores the cages. */
  cancel(): void {
    if (this.ended) return;
    this.ended = true;
    this.shown = this.start;
    this.send({ type: "drag_cancel", drag: this.id });
  }

  private applyShare(operation: Operation, share: number): void {
    this.followed = share < 1 ? scaleOperation(operation, share) : operation;
    this.shown = this.cagesAfter(this.followed);
  }

  private get isConfined(): boolean {
    return this.target === "field" && this.edit.kind === "continuous" && !this.edit.outer_follows;
  }

  private get outerCorners(): Corners | null {
    return this.start.outer?.corners ?? null;
  }

  private cagesAfter(operation: Operation): Cages {
    const { inner, deformed, outer } = this.start;
    switch (this.target) {
      case "field": {
        const there = apply(operation, deformed);
        return { inner: this.edit.source === null ? inner : there, deformed: there, outer };
      }
      case "outer":
        return { inner, deformed, outer: outer && apply(operation, outer) };
      case "inner":
        return { ...this.innerAfter(operation), outer };
      case "both": {
        if (this.edit.outer_follows) return { ...this.innerAfter(operation), outer };
        const about = operation.kind === "move_corners" ? outer?.pivot : inner.pivot;
        const moved = outer && about ? apply(operation, { corners: outer.corners, pivot: about }) : null;
        return { ...this.innerAfter(operation), outer: moved };
      }
    }
  }

  /** The inner cage after a drag in Set mode; an edit without operations has an equal deformed cage. */
  private innerAfter(operation: Operation): { inner: Posed; deformed: Posed } {
    const inner = apply(operation, this.start.inner);
    return {
      inner,
      deformed: this.edit.operations.length === 0 || this.edit.source !== null ? inner : this.start.deformed,
    };
  }
}
