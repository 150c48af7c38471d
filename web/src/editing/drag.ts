/**
 * A drag as the page sees it: cages that follow the mouse at once, messages to the server, and its answers,
 * which say how far the drag may go.
 */
import { apply, part, type Operation, type Posed } from "./operations";
import { containedPart, expectedPart } from "./limits";
import { extent, middle } from "./cage";
import type { Corners, Dragged, EditState, PageMessage } from "../net/protocol";
import type { Target } from "../app/store";

/** How far apart cages are that count as the same, as a share of their size. */
const ROUNDING = 1e-5;

/** What the server says, too, where a continuous edit is confined. */
const AT_OUTER_CAGE = "the inner cage must stay inside the outer cage; enlarge the outer cage (Set mode)";

/** The cages of an edit, as they are shown. */
export interface Cages {
  inner: Posed;
  deformed: Posed;
  outer: Posed | null;
}

/** The cages of an edit at rest. */
export function cagesOf(edit: EditState): Cages {
  return {
    inner: { corners: edit.inner, pivot: edit.inner_pivot },
    deformed: { corners: edit.deformed, pivot: edit.pivot },
    outer: edit.outer && { corners: edit.outer, pivot: edit.outer_pivot ?? middle(edit.outer) },
  };
}

/** The cage that a gizmo of this target stands on. */
export function leading(cages: Cages, target: Target): Posed {
  if (target === "field") return cages.deformed;
  return target === "outer" && cages.outer ? cages.outer : cages.inner;
}

/** Whether cages are where others are, but for rounding. */
function alike(a: Cages, b: Cages): boolean {
  const size = extent(a.deformed.corners);
  const near = (p: Posed, q: Posed): boolean =>
    p.corners.every((corner, k) => corner.every((x, i) => Math.abs(x - q.corners[k][i]) < ROUNDING * size));
  const outer = a.outer === null || b.outer === null ? a.outer === b.outer : near(a.outer, b.outer);
  return near(a.inner, b.inner) && near(a.deformed, b.deformed) && outer;
}

export class Drag {
  readonly start: Cages;
  shown: Cages;
  operation: Operation | null = null;
  /** As much of the operation as the cages follow. */
  followed: Operation | null = null;
  seq = 0;
  /** Why the drag stopped, or null while all of it is followed. */
  why: string | null = null;
  ended = false;
  private last: { operation: Operation; part: number; why: string | null } | null = null;
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

  /** Moves the cages to where the whole operation since the beginning takes them, as far as it may go. */
  move(operation: Operation): void {
    if (this.ended) return;
    this.operation = operation;
    this.seq += 1;
    this.sent.set(this.seq, operation);
    this.send({ type: "drag", drag: this.id, seq: this.seq, operation });
    const byCage = this.confined ? containedPart(operation, this.start.deformed, this.outerCorners) : 1;
    const byServer = expectedPart(operation, this.last);
    const share = Math.min(byCage, byServer);
    this.why = share >= 1 ? null : (this.last?.why ?? AT_OUTER_CAGE);
    this.follow(operation, share);
  }

  /** Takes the server's answer over; true where the cages are elsewhere than they were shown. */
  answered(message: Dragged): boolean {
    const operation = this.sent.get(message.seq);
    if (message.drag !== this.id || operation === undefined) return false;
    for (const seq of this.sent.keys()) if (seq < message.seq) this.sent.delete(seq);
    this.last = { operation, part: message.part, why: message.why };
    if (message.seq !== this.seq) return false;
    this.why = message.why;
    const before = this.shown;
    this.follow(operation, message.part);
    const pivots = this.shown;
    this.shown = {
      inner: { corners: message.inner, pivot: pivots.inner.pivot },
      deformed: { corners: message.deformed, pivot: pivots.deformed.pivot },
      outer: message.outer && { corners: message.outer, pivot: pivots.outer?.pivot ?? middle(message.outer) },
    };
    return !alike(before, this.shown);
  }

  /** Ends the drag: what was dragged becomes an entry of the history. A drag that moved nothing is none. */
  end(): void {
    if (this.ended) return;
    this.ended = true;
    if (this.operation === null) this.send({ type: "drag_cancel", drag: this.id });
    else this.send({ type: "drag_end", drag: this.id, seq: this.seq, operation: this.operation });
  }

  /** Gives the drag up: everything as before it. */
  cancel(): void {
    if (this.ended) return;
    this.ended = true;
    this.shown = this.start;
    this.send({ type: "drag_cancel", drag: this.id });
  }

  private follow(operation: Operation, share: number): void {
    this.followed = share < 1 ? part(operation, share) : operation;
    this.shown = this.after(this.followed);
  }

  private get confined(): boolean {
    return this.target === "field" && this.edit.kind === "continuous";
  }

  private get outerCorners(): Corners | null {
    return this.start.outer?.corners ?? null;
  }

  private after(operation: Operation): Cages {
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
        const about = operation.kind === "move_corners" ? outer?.pivot : inner.pivot;
        const moved = outer && about ? apply(operation, { corners: outer.corners, pivot: about }) : null;
        return { ...this.innerAfter(operation), outer: moved };
      }
    }
  }

  /** The inner cage after a drag in Set mode; the deformed one with it, as long as nothing tells them apart. */
  private innerAfter(operation: Operation): { inner: Posed; deformed: Posed } {
    const inner = apply(operation, this.start.inner);
    return {
      inner,
      deformed: this.edit.operations.length === 0 || this.edit.source !== null ? inner : this.start.deformed,
    };
  }
}
