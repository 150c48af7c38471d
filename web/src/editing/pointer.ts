/** The mouse on the canvas: corners first, then the gizmo, then faces and edges, then the view. */
import { Plane, Vector3 } from "three";
import { cornersOf, extent, faceNormal, middle, type Part } from "./cage";
import type { App } from "../app/app";
import { leading } from "./drag";
import { cornersMove, onLine, onPlane } from "./gestures";
import { lengthStep, snapped, type Operation } from "./operations";
import { distanceToEdges, pick, pickCorner } from "./picking";
import { draggable, shownCages } from "./cage_overlay";
import { obstacle, selected, showsCages, target, type Hover } from "../app/store";

const SNAP_ANGLE = 15;
const SNAP_FACTOR = 0.1;
const CLICK_REACH = 4;
const LINE_REACH = 7;
const DOUBLE_CLICK = 500;
/** The gizmo's handle for turning freely: it fills the gizmo, and gives way to what is inside. */
const WHOLE_BALL = "XYZE";

type Constraint = "X" | "Y" | "Z" | null;

/** What the mouse has hold of: the gizmo, or corners that follow it in a plane or along a line. */
type Hold =
  | { kind: "gizmo"; corners: number[] }
  | { kind: "part"; corners: number[]; at: Vector3; grabbed: Vector3; plane: Plane; line: Vector3 | null };

export class Pointer {
  /** Where the mouse is on the canvas, CSS pixels. */
  at = { x: 0, y: 0 };
  /** Whether the snapping key is held. */
  snapKey = false;
  /** Axis along which a drag of corners is kept. */
  private constraint: Constraint = null;
  private hold: Hold | null = null;
  /** Where the mouse was when the drag last followed it. */
  private followed = { x: NaN, y: NaN };
  private pressed: { x: number; y: number } | null = null;
  private latest = { x: 0, y: 0, time: 0 };
  /** The first press of what may become a double click: when, and whether nothing was under it. */
  private first = { time: -Infinity, free: true };

  constructor(private readonly app: App) {
    const { canvas } = app.viewport;
    canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    // Where the mouse is between two frames; not all browsers and addresses tell.
    canvas.addEventListener("pointerrawupdate", (event) => {
      if (this.hold !== null) this.locate(event as PointerEvent);
    });
    app.frames.beforeRequest.push(() => this.catchUp());
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", () => this.cancel());
    canvas.addEventListener("pointerleave", () => this.leave());
    canvas.addEventListener("dblclick", (event) => this.place(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  get dragging(): boolean {
    return this.hold !== null;
  }

  /** Gives the drag up that goes on; false where none does. */
  cancel(): boolean {
    if (this.hold === null) return false;
    if (this.hold.kind === "gizmo") this.app.gizmo.end(this.app.viewport.device(this.at.x, this.at.y));
    this.hold = null;
    this.app.cancelDrag();
    this.free();
    return true;
  }

  /** Keeps a drag of corners along an axis of the world, or lets it go again. */
  constrain(axis: "X" | "Y" | "Z"): boolean {
    if (this.hold?.kind !== "part") return false;
    this.constraint = this.constraint === axis ? null : axis;
    this.follow();
    return true;
  }

  /** Follows the mouse again where it is: after a snapping key, say. */
  follow(): void {
    if (this.hold === null) return;
    const raw = this.operation(this.hold);
    this.followed = { ...this.at };
    if (raw !== null) this.app.moveDrag(this.snap(raw), this.latest.time);
  }

  /** Follows the mouse if it has moved since. */
  private catchUp(): void {
    if (this.at.x !== this.followed.x || this.at.y !== this.followed.y) this.follow();
  }

  private down(event: PointerEvent): void {
    this.locate(event);
    this.pressed = { ...this.at };
    const free = event.button !== 0 || event.altKey;
    const hover = free ? null : this.under();
    if (event.timeStamp - this.first.time > DOUBLE_CLICK) {
      this.first = { time: event.timeStamp, free: hover === null && this.app.gizmo.axis === null };
    }
    if (free || (hover === null && this.app.gizmo.axis === null)) {
      this.app.camera.held = true;
      return;
    }
    event.stopImmediatePropagation();
    if (this.app.viewport.orbit) this.app.viewport.orbit.enabled = false;
    this.app.viewport.canvas.setPointerCapture(event.pointerId);
    if (hover !== null && event.shiftKey) this.choose(hover.part);
    else if (hover !== null) this.grab(hover);
    else this.grabGizmo();
    if (this.hold === null) this.free();
  }

  private move(event: PointerEvent): void {
    this.locate(event);
    if (this.hold !== null) this.catchUp();
    else if (event.buttons === 0) this.updateHover();
  }

  private up(event: PointerEvent): void {
    this.locate(event);
    this.app.camera.held = false;
    if (this.hold !== null) {
      if (this.hold.kind === "gizmo") this.app.gizmo.end(this.app.viewport.device(this.at.x, this.at.y));
      this.hold = null;
      this.app.endDrag();
    } else if (this.pressed && event.button === 0 && this.travelled() < CLICK_REACH) {
      this.select();
    }
    this.free();
    this.updateHover();
  }

  private leave(): void {
    if (this.hold !== null) return;
    this.app.gizmo.leave();
    this.app.store.set({ hover: null });
    this.app.viewport.invalidate();
  }

  private free(): void {
    this.constraint = null;
    this.pressed = null;
    if (this.app.viewport.orbit) this.app.viewport.orbit.enabled = true;
  }

  /** Shows what a click would take hold of. */
  private updateHover(): void {
    const axis = this.app.gizmo.axis;
    const hover = this.under();
    if (this.app.gizmo.axis !== axis) this.app.viewport.invalidate();
    const before = this.app.store.now.hover;
    if (!(
      hover?.cage === before?.cage &&
      hover?.part.kind === before?.part.kind &&
      hover?.part.index === before?.part.index
    )) {
      this.app.store.set({ hover });
    }
    this.app.viewport.canvas.style.cursor = hover || this.app.gizmo.axis !== null ? "pointer" : "";
  }

  /** The part of a cage that a click would take hold of; where it is the gizmo's handle instead, that is lit. */
  private under(): Hover | null {
    const { now } = this.app.store;
    const edit = selected(now);
    this.app.gizmo.leave();
    if (edit === null || !showsCages(now) || obstacle(now, edit) !== null) return null;
    const { project } = this.app.viewport;
    const { x, y } = this.at;
    const cages = draggable(now, shownCages(edit, this.app.drag));
    for (const { cage, corners } of cages) {
      const corner = pickCorner(x, y, corners, project);
      if (corner !== null) return { part: corner, cage };
    }
    const axis = this.app.gizmo.hover(this.app.viewport.device(x, y));
    if (axis !== null && axis !== WHOLE_BALL) return null;
    const eye = this.app.viewport.camera.position.toArray();
    for (const { cage, corners } of cages) {
      const part = pick(x, y, { corners, eye }, project);
      if (part === null) continue;
      this.app.gizmo.leave();
      return { part, cage };
    }
    return null;
  }

  /** Adds the corners of a part to those that are dragged together, or takes them out again. */
  private choose(part: Part): void {
    const chosen = this.app.store.now.corners;
    const own = cornersOf(part);
    const corners = own.every((k) => chosen.includes(k))
      ? chosen.filter((k) => !own.includes(k))
      : [...new Set([...chosen, ...own])].sort((a, b) => a - b);
    this.app.store.set({ corners });
  }

  private grab(hover: Hover): void {
    const { now } = this.app.store;
    const own = cornersOf(hover.part);
    const together = own.every((k) => now.corners.includes(k)) && now.corners.length > own.length;
    const corners = together ? now.corners : own;
    const drag = this.app.beginDrag(now.mode === "edit" ? "field" : hover.cage);
    if (drag === null) return;
    if (!together && now.corners.length > 0) this.app.store.set({ corners: [] });
    const cage = leading(drag.start, drag.target).corners;
    const at = new Vector3(...middle(cage, own));
    const line =
      hover.part.kind === "face" && !together ? new Vector3(...faceNormal(cage, hover.part.index)) : null;
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.app.viewport.forward, at);
    this.hold = { kind: "part", corners, at, grabbed: at, plane, line };
    this.hold.grabbed = this.reached(this.hold) ?? at;
  }

  private grabGizmo(): void {
    const { corners } = this.app.store.now;
    if (this.app.beginDrag() === null) return;
    this.app.gizmo.begin(this.app.viewport.device(this.at.x, this.at.y));
    this.hold = { kind: "gizmo", corners: [...corners] };
  }

  private operation(hold: Hold): Operation | null {
    if (hold.kind === "gizmo") {
      return this.app.gizmo.move(this.app.viewport.device(this.at.x, this.at.y), hold.corners);
    }
    const to = this.reached(hold);
    if (to === null) return null;
    return cornersMove(hold.corners, to.clone().sub(this.constraint === null ? hold.grabbed : hold.at));
  }

  /** Where the mouse has taken what it holds. */
  private reached(hold: Hold & { kind: "part" }): Vector3 | null {
    const ray = this.app.viewport.ray(this.at.x, this.at.y);
    const axes = { X: new Vector3(1, 0, 0), Y: new Vector3(0, 1, 0), Z: new Vector3(0, 0, 1) };
    if (this.constraint !== null) return onLine(ray, hold.at, axes[this.constraint]);
    if (hold.line !== null) return onLine(ray, hold.at, hold.line);
    return onPlane(ray, hold.at, hold.plane.normal);
  }

  private snap(operation: Operation): Operation {
    const { now } = this.app.store;
    const edit = selected(now);
    if (now.snap === this.snapKey || edit === null) return operation;
    const step = lengthStep(2 * extent(edit.inner));
    return snapped(operation, { length: step, angle: SNAP_ANGLE, factor: SNAP_FACTOR });
  }

  /** Selects the edit whose cage was clicked. */
  private select(): void {
    const { now } = this.app.store;
    const reach = (now.state?.edits ?? [])
      .filter((edit) => edit.enabled)
      .map((edit) => {
        const cages = shownCages(edit, this.app.drag);
        const corners = leading(cages, target(now)).corners;
        return {
          id: edit.id,
          distance: distanceToEdges(this.at.x, this.at.y, corners, this.app.viewport.project),
        };
      })
      .filter(({ distance }) => distance < LINE_REACH)
      .sort((a, b) => a.distance - b.distance);
    if (reach.length > 0 && !reach.some(({ id }) => id === now.state?.selected)) {
      this.app.send({ type: "command", name: "select", edit: reach[0].id });
    }
  }

  private place(event: MouseEvent): void {
    this.locate(event);
    if (!this.first.free) return;
    const { width, height } = this.app.viewport.points;
    this.app.expectEdit();
    this.app.send({ type: "place", x: clamp(this.at.x / width), y: clamp(this.at.y / height) });
  }

  private travelled(): number {
    return this.pressed ? Math.hypot(this.at.x - this.pressed.x, this.at.y - this.pressed.y) : 0;
  }

  private locate(event: MouseEvent): void {
    const box = this.app.viewport.canvas.getBoundingClientRect();
    this.at = { x: event.clientX - box.left, y: event.clientY - box.top };
    this.snapKey = event.ctrlKey;
    this.latest = { ...this.at, time: event.timeStamp };
  }
}

function clamp(x: number): number {
  return Math.min(1, Math.max(0, x));
}
