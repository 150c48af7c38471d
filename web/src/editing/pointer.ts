/** Mouse input of the canvas; precedence: corners, gizmo, faces and edges, then the view. */
import { Plane, Vector3 } from "three";
import { FACES, centroid, partCorners, halfExtent, faceNormal, type CagePart, type Posed } from "./cage";
import type { App } from "../app/app";
import { operationAtRest } from "./carrier";
import { targetCage } from "./drag";
import { asPointMove, moveCornersBy, closestPointOnLine, intersectPlane } from "./gestures";
import { snapLength, snapOperation, type Operation } from "./operations";
import { distanceToCage, pickHandle, pickMeshEdge, pickNetLine, pickPart } from "./picking";
import { middleOf, planeOf, rowOf, steppedRadius, type NetLine, type Proportional } from "./point_cages";
import { draggableCages, shownCages } from "./cage_overlay";
import { dragObstacle, hasPointTool, selectedEdit, showsCages, dragTarget, type Hover } from "../app/store";

const SNAP_ANGLE_DEG = 15;
const SNAP_FACTOR = 0.1;
const MAX_CLICK_PIXELS = 4;
const LINE_RADIUS_PIXELS = 7;
const DOUBLE_CLICK_MS = 500;
/** The gizmo's handle of free rotation, which fills the gizmo: parts of cages inside take precedence. */
const FREE_ROTATION = "XYZE";

type Constraint = "X" | "Y" | "Z" | null;

/** The object of a drag: the gizmo, or corners that follow the mouse in a plane or along a line. */
type Hold =
  | { kind: "gizmo"; corners: number[] }
  | { kind: "part"; corners: number[]; at: Vector3; grabbed: Vector3; plane: Plane; line: Vector3 | null };

export class Pointer {
  /** Position of the mouse on the canvas, CSS pixels. */
  position = { x: 0, y: 0 };
  /** Whether the snapping key is held. */
  snapKey = false;
  /** Called with the position of each click while the measuring tool is taken. */
  measure: (x: number, y: number) => void = () => undefined;
  /** Called with the position of each click while the tool that places hotspots is taken. */
  placeHotspot: (x: number, y: number) => void = () => undefined;
  /** Called with the position of each click while a tool collects points. */
  pickPoint: (x: number, y: number) => void = () => undefined;
  /** World axis to which a drag of corners is constrained. */
  private constraint: Constraint = null;
  private hold: Hold | null = null;
  /** Position of the mouse that the drag has applied last. */
  private appliedAt = { x: NaN, y: NaN };
  private pressed: { x: number; y: number } | null = null;
  private latestEvent = { x: 0, y: 0, time: 0 };
  /** Time of the first press of a possible double click, and whether no part was under the mouse. */
  private firstPress = { time: -Infinity, release: true };

  constructor(private readonly app: App) {
    const { canvas } = app.viewport;
    canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    // Positions between two frames, which not all browsers report.
    canvas.addEventListener("pointerrawupdate", (event) => {
      if (this.hold !== null) this.readPosition(event as PointerEvent);
    });
    app.frames.beforeRequest.push(() => this.applyNewMotion());
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", () => this.cancel());
    canvas.addEventListener("pointerleave", () => this.leave());
    canvas.addEventListener("dblclick", (event) => this.place(event));
    const wheel = (event: WheelEvent): void => {
      if (event.deltaY === 0 || !this.resizeReach(event.deltaY < 0 ? 1 : -1)) return;
      event.preventDefault();
      event.stopImmediatePropagation();
    };
    canvas.addEventListener("wheel", wheel, { capture: true, passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  get dragging(): boolean {
    return this.hold !== null;
  }

  /** Cancels the drag; returns false without a drag. */
  cancel(): boolean {
    if (this.hold === null) return false;
    if (this.hold.kind === "gizmo")
      this.app.gizmo.end(this.app.viewport.device(this.position.x, this.position.y));
    this.hold = null;
    this.app.cancelDrag();
    this.free();
    return true;
  }

  /**
   * Constrains a drag of corners to a world axis, or releases the same constraint; false without such a drag.
   */
  constrain(axis: "X" | "Y" | "Z"): boolean {
    if (this.hold?.kind !== "part") return false;
    this.constraint = this.constraint === axis ? null : axis;
    this.applyMotion();
    return true;
  }

  /** Applies the mouse's position to the drag again, after a change of snapping or constraint. */
  applyMotion(): void {
    if (this.hold === null) return;
    const carried = this.operation(this.hold);
    const { drag } = this.app;
    this.appliedAt = { ...this.position };
    if (carried === null || drag === null) return;
    const raw = operationAtRest(drag.edit.carrier, carried);
    const cage = targetCage(drag.start, drag.target);
    this.app.moveDrag(asPointMove(this.snap(raw), cage, this.proportional), this.latestEvent.time);
  }

  /** Changes the radius of proportional editing by some steps; false without such a drag. */
  resizeReach(steps: number): boolean {
    const { store, drag } = this.app;
    if (this.hold === null || drag === null || this.proportional === null) return false;
    const extent = halfExtent(drag.start.deformed.corners);
    store.set({ proportionalRadius: steppedRadius(this.proportional.radius, steps, extent) });
    this.applyMotion();
    return true;
  }

  /** Radius and curve by which points around the dragged ones go along; null where they stay. */
  private get proportional(): Proportional | null {
    const { proportional, proportionalRadius, curve } = this.app.store.now;
    const { drag } = this.app;
    if (!proportional || drag === null || targetCage(drag.start, drag.target).points === undefined)
      return null;
    return { radius: proportionalRadius ?? halfExtent(drag.start.deformed.corners), curve };
  }

  /** Applies the mouse's position if it has changed. */
  private applyNewMotion(): void {
    if (this.position.x !== this.appliedAt.x || this.position.y !== this.appliedAt.y) this.applyMotion();
  }

  private down(event: PointerEvent): void {
    this.readPosition(event);
    this.pressed = { ...this.position };
    const free = event.button !== 0 || event.altKey;
    const hover = free ? null : this.partUnderPointer();
    if (event.timeStamp - this.firstPress.time > DOUBLE_CLICK_MS) {
      this.firstPress = { time: event.timeStamp, release: hover === null && this.app.gizmo.axis === null };
    }
    if (free || (hover === null && this.app.gizmo.axis === null)) {
      this.app.camera.held = true;
      return;
    }
    event.stopImmediatePropagation();
    if (this.app.viewport.orbit) this.app.viewport.orbit.enabled = false;
    this.app.viewport.canvas.setPointerCapture(event.pointerId);
    if (hover !== null && event.shiftKey) this.toggleCorners(hover.part);
    else if (hover !== null) this.grab(hover);
    else this.grabGizmo();
    if (this.hold === null) this.free();
  }

  private move(event: PointerEvent): void {
    this.readPosition(event);
    if (this.hold !== null) this.applyNewMotion();
    else if (event.buttons === 0 && this.app.store.now.selecting === null) this.updateHover();
  }

  private up(event: PointerEvent): void {
    this.readPosition(event);
    this.app.camera.held = false;
    if (this.hold !== null) {
      if (this.hold.kind === "gizmo")
        this.app.gizmo.end(this.app.viewport.device(this.position.x, this.position.y));
      this.hold = null;
      this.app.endDrag();
    } else if (this.pressed && event.button === 0 && this.travelPixels() < MAX_CLICK_PIXELS) {
      if (this.app.store.now.measured !== null) this.measure(this.position.x, this.position.y);
      else if (this.app.store.now.placesHotspot) this.placeHotspot(this.position.x, this.position.y);
      else if (this.app.store.now.picked !== null) this.pickPoint(this.position.x, this.position.y);
      else if (event.altKey) this.chooseRow(event);
      else this.select();
    }
    this.free();
    this.updateHover();
  }

  private leave(): void {
    if (this.hold !== null) return;
    this.app.gizmo.clearHover();
    this.app.store.set({ hover: null });
    this.app.viewport.invalidate();
  }

  private free(): void {
    this.constraint = null;
    this.pressed = null;
    if (this.app.viewport.orbit) this.app.viewport.orbit.enabled = true;
  }

  /** Highlights the part under the mouse. */
  private updateHover(): void {
    const axis = this.app.gizmo.axis;
    const hover = this.partUnderPointer();
    const isOtherAxis = this.app.gizmo.axis !== axis;
    if (isOtherAxis) this.app.viewport.invalidate();
    const before = this.app.store.now.hover;
    const isOtherPart = !(
      hover?.cage === before?.cage &&
      hover?.part.kind === before?.part.kind &&
      hover?.part.index === before?.part.index
    );
    if (isOtherPart) this.app.store.set({ hover });
    if ((isOtherAxis && this.app.gizmo.axis !== null) || (isOtherPart && hover !== null))
      this.app.send({ type: "drag_expected" });
    this.app.viewport.canvas.style.cursor = hover || this.app.gizmo.axis !== null ? "pointer" : "";
  }

  /**
   * The part of a cage under the mouse; null for none, or where the gizmo takes precedence and is
   * highlighted.
   */
  private partUnderPointer(): Hover | null {
    const { now } = this.app.store;
    const edit = selectedEdit(now);
    this.app.gizmo.clearHover();
    if (hasPointTool(now)) return null;
    if (edit === null || !showsCages(now) || dragObstacle(now, edit) !== null) return null;
    const { project } = this.app.viewport;
    const { x, y } = this.position;
    const cages = draggableCages(now, shownCages(edit, this.app.drag));
    for (const { cage, posed } of cages) {
      const corner = pickHandle(x, y, posed, project);
      if (corner !== null) return { part: corner, cage };
    }
    const axis = this.app.gizmo.hover(this.app.viewport.device(x, y));
    if (axis !== null && axis !== FREE_ROTATION) return null;
    const eye = this.app.viewport.camera.position.toArray();
    for (const { cage, posed } of cages) {
      const part =
        posed.points === undefined
          ? pickPart(x, y, { corners: posed.corners, eye }, project)
          : pickMeshEdge(x, y, posed, project);
      if (part === null) continue;
      this.app.gizmo.clearHover();
      return { part, cage };
    }
    return null;
  }

  /** Adds the corners of a part to the corners that are dragged together, or removes them. */
  private toggleCorners(part: CagePart): void {
    const chosen = this.app.store.now.corners;
    const own = partCorners(part);
    const corners = own.every((k) => chosen.includes(k))
      ? chosen.filter((k) => !own.includes(k))
      : [...new Set([...chosen, ...own])].sort((a, b) => a - b);
    this.app.store.set({ corners });
  }

  private grab(hover: Hover): void {
    const { now } = this.app.store;
    const own = partCorners(hover.part);
    const together = own.every((k) => now.corners.includes(k)) && now.corners.length > own.length;
    const corners = together ? now.corners : own;
    const drag = this.app.beginDrag(now.mode === "edit" ? "field" : hover.cage);
    if (drag === null) return;
    if (!together && now.corners.length > 0) this.app.store.set({ corners: [] });
    const cage = targetCage(shownCages(drag.edit, drag), drag.target);
    const at = new Vector3(...middleOf(cage, own));
    const line =
      hover.part.kind === "face" && !together
        ? new Vector3(...faceNormal(cage.corners, hover.part.index))
        : null;
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.app.viewport.forward, at);
    this.hold = { kind: "part", corners, at, grabbed: at, plane, line };
    this.hold.grabbed = this.targetPosition(this.hold) ?? at;
  }

  private grabGizmo(): void {
    const { corners } = this.app.store.now;
    if (this.app.beginDrag() === null) return;
    this.app.gizmo.begin(this.app.viewport.device(this.position.x, this.position.y));
    this.hold = { kind: "gizmo", corners: [...corners] };
  }

  private operation(hold: Hold): Operation | null {
    if (hold.kind === "gizmo") {
      return this.app.gizmo.move(this.app.viewport.device(this.position.x, this.position.y), hold.corners);
    }
    const to = this.targetPosition(hold);
    if (to === null) return null;
    return moveCornersBy(hold.corners, to.clone().sub(this.constraint === null ? hold.grabbed : hold.at));
  }

  /** The world position to which the mouse moves the dragged part; null where its ray gives none. */
  private targetPosition(hold: Hold & { kind: "part" }): Vector3 | null {
    const ray = this.app.viewport.ray(this.position.x, this.position.y);
    const axes = { X: new Vector3(1, 0, 0), Y: new Vector3(0, 1, 0), Z: new Vector3(0, 0, 1) };
    if (this.constraint !== null) return closestPointOnLine(ray, hold.at, axes[this.constraint]);
    if (hold.line !== null) return closestPointOnLine(ray, hold.at, hold.line);
    return intersectPlane(ray, hold.at, hold.plane.normal);
  }

  private snap(operation: Operation): Operation {
    const { now } = this.app.store;
    const edit = selectedEdit(now);
    if (now.snap === this.snapKey || edit === null) return operation;
    const step = snapLength(2 * halfExtent(edit.inner));
    return snapOperation(operation, { length: step, angle: SNAP_ANGLE_DEG, factor: SNAP_FACTOR });
  }

  /** Chooses the row of a lattice's points on the clicked line, or with Ctrl the plane that faces the view most. */
  private chooseRow(event: PointerEvent): void {
    const { now } = this.app.store;
    const edit = selectedEdit(now);
    if (edit === null || !showsCages(now) || dragObstacle(now, edit) !== null) return;
    const cage = targetCage(shownCages(edit, this.app.drag), dragTarget(now));
    const { x, y } = this.position;
    const line = pickNetLine(x, y, cage, this.app.viewport.project, LINE_RADIUS_PIXELS);
    if (line === null || !cage.shape || cage.points === undefined) return;
    const { shape } = cage;
    const isPlane = event.ctrlKey || event.metaKey;
    const row = isPlane ? planeOf(shape, line.point, this.facingAxis(cage, line)) : rowOf(shape, line);
    const corners = event.shiftKey ? [...new Set([...now.corners, ...row])].sort((a, b) => a - b) : row;
    this.app.store.set({ corners });
  }

  /** The axis across the plane, through a line of a lattice's net, that faces the view most. */
  private facingAxis(cage: Posed, { axis }: NetLine): number {
    const forward = this.app.viewport.forward;
    const facing = (across: number): number => {
      const [first, last] = [2 * across, 2 * across + 1].map((face) => FACES[face]);
      const from = new Vector3(...centroid(cage.corners, first));
      return Math.abs(new Vector3(...centroid(cage.corners, last)).sub(from).normalize().dot(forward));
    };
    const [a, b] = [0, 1, 2].filter((other) => other !== axis);
    return facing(a) >= facing(b) ? a : b;
  }

  /** Selects the edit whose cage was clicked. */
  private select(): void {
    const { now } = this.app.store;
    const reach = (now.state?.edits ?? [])
      .filter((edit) => edit.enabled)
      .map((edit) => {
        const cages = shownCages(edit, this.app.drag);
        const cage = targetCage(cages, dragTarget(now));
        return {
          id: edit.id,
          distance: distanceToCage(this.position.x, this.position.y, cage, this.app.viewport.project),
        };
      })
      .filter(({ distance }) => distance < LINE_RADIUS_PIXELS)
      .sort((a, b) => a.distance - b.distance);
    if (reach.length > 0 && !reach.some(({ id }) => id === now.state?.selected)) {
      this.app.send({ type: "command", name: "select", edit: reach[0].id });
    }
  }

  private place(event: MouseEvent): void {
    this.readPosition(event);
    if (!this.firstPress.release || event.altKey || hasPointTool(this.app.store.now)) return;
    const { width, height } = this.app.viewport.points;
    this.app.expectEdit();
    const at = { x: clamp(this.position.x / width), y: clamp(this.position.y / height) };
    this.app.send({ type: event.ctrlKey || event.metaKey ? "place_point" : "place", ...at });
  }

  private travelPixels(): number {
    return this.pressed ? Math.hypot(this.position.x - this.pressed.x, this.position.y - this.pressed.y) : 0;
  }

  private readPosition(event: MouseEvent): void {
    const box = this.app.viewport.canvas.getBoundingClientRect();
    this.position = { x: event.clientX - box.left, y: event.clientY - box.top };
    this.snapKey = event.ctrlKey;
    this.latestEvent = { ...this.position, time: event.timeStamp };
  }
}

function clamp(x: number): number {
  return Math.min(1, Math.max(0, x));
}
