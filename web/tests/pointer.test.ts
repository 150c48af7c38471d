import { Ray, Vector3 } from "three";
import { describe, expect, it, vi } from "vitest";
import type { App } from "../src/app/app";
import { Store, selectedEdit, dragTarget } from "../src/app/store";
import type { Target } from "../src/app/store";
import { Drag } from "../src/editing/drag";
import type { Operation } from "../src/editing/operations";
import { Pointer } from "../src/editing/pointer";
import type { DragMove, PageMessage, Vec3 } from "../src/net/protocol";
import { box, expectClose } from "./cages";
import { edit, state } from "./fake_server";

const SIZE = 200;
const PIXELS_PER_UNIT = 100;
const CANVAS_LEFT = 10;
const CANVAS_TOP = 20;

/**
 * Pixels of the front corners 6 and 7 of the inner cage, of the middle of the edge between 5 and 7, and of no
 * part.
 */
const CORNER_7 = { x: 130, y: 70 };
const CORNER_6 = { x: 70, y: 70 };
const EDGE_5_7 = { x: 130, y: 100 };
const NOTHING = { x: 5, y: 195 };

interface Pixel {
  x: number;
  y: number;
}

/**
 * An editor with a canvas of 200 x 200 pixels and an orthographic camera at (0, 0, 5) that looks along -z, 100 pixels
 * per world unit. The inner cage is a box of half-size .3 around the origin.
 */
class FakeEditor {
  readonly store = new Store({ state: state(), connection: "open" });
  readonly sent: PageMessage[] = [];
  readonly camera = { held: false };
  readonly frames = { beforeRequest: [] as (() => void)[] };
  readonly gizmo = {
    axis: null as string | null,
    hover: vi.fn(() => this.gizmo.axis),
    clearHover: vi.fn(),
    begin: vi.fn(),
    move: vi.fn((): Operation => ({ kind: "translate", by: [1, 0, 0] })),
    end: vi.fn(),
  };
  readonly captured: number[] = [];
  readonly expectEdit = vi.fn();
  drag: Drag | null = null;
  readonly viewport = {
    canvas: {
      style: { cursor: "" },
      addEventListener: (type: string, listener: (event: unknown) => void) =>
        this.listeners.set(type, listener),
      getBoundingClientRect: () => ({ left: CANVAS_LEFT, top: CANVAS_TOP }),
      setPointerCapture: (id: number) => this.captured.push(id),
    },
    orbit: { enabled: true },
    points: { width: SIZE, height: SIZE },
    camera: { position: new Vector3(0, 0, 5) },
    forward: new Vector3(0, 0, -1),
    invalidate: vi.fn(),
    device: (x: number, y: number): Pixel => ({ x: (2 * x) / SIZE - 1, y: 1 - (2 * y) / SIZE }),
    project: ([x, y, z]: Vec3) => ({
      x: 100 + PIXELS_PER_UNIT * x,
      y: 100 - PIXELS_PER_UNIT * y,
      depth: 5 - z,
    }),
    ray: (x: number, y: number): Ray =>
      new Ray(
        new Vector3((x - 100) / PIXELS_PER_UNIT, (100 - y) / PIXELS_PER_UNIT, 5),
        new Vector3(0, 0, -1),
      ),
  };
  private readonly listeners = new Map<string, (event: unknown) => void>();
  readonly pointer = new Pointer(this as unknown as App);
  private time = 0;

  send(message: PageMessage): boolean {
    this.sent.push(message);
    return true;
  }

  beginDrag(dragged: Target = dragTarget(this.store.now)): Drag | null {
    this.drag = new Drag(1, selectedEdit(this.store.now)!, dragged, (message) => this.send(message));
    return this.drag;
  }

  moveDrag(operation: Operation): void {
    this.drag?.move(operation);
  }

  endDrag(): void {
    this.drag?.end();
  }

  cancelDrag(): void {
    this.drag?.cancel();
  }

  /** Sends a mouse event at a pixel of the canvas; returns whether it was kept from other listeners. */
  fire(type: string, { x, y }: Pixel, more: Partial<PointerEvent> = {}): boolean {
    const stop = vi.fn();
    this.time += 1000;
    this.listeners.get(type)?.({
      clientX: x + CANVAS_LEFT,
      clientY: y + CANVAS_TOP,
      pointerId: 4,
      button: 0,
      buttons: type === "pointermove" ? 0 : 1,
      altKey: false,
      ctrlKey: false,
      shiftKey: false,
      timeStamp: this.time,
      stopImmediatePropagation: stop,
      ...more,
    });
    return stop.mock.calls.length > 0;
  }

  click(pixel: Pixel, more: Partial<PointerEvent> = {}): void {
    this.fire("pointerdown", pixel, more);
    this.fire("pointerup", pixel, more);
  }

  /** The operations that the drag has sent. */
  get operations(): Operation[] {
    return this.sent
      .filter((message): message is DragMove => message.type === "drag")
      .map(({ operation }) => operation);
  }

  /** The last operation, which must move corners. */
  get lastMove(): Extract<Operation, { kind: "move_corners" }> {
    const last = this.operations.at(-1);
    if (last?.kind !== "move_corners") throw new Error("no corners were moved");
    return last;
  }
}

describe("a drag of a part of a cage", () => {
  it("moves a corner in the plane of the image, and ends with the button", () => {
    const editor = new FakeEditor();
    expect(editor.fire("pointerdown", CORNER_7)).toBe(true);
    expect([editor.pointer.dragging, editor.viewport.orbit.enabled]).toEqual([true, false]);
    expect(editor.captured).toEqual([4]);
    editor.fire("pointermove", { x: 150, y: 60 }, { buttons: 1 });
    expect(editor.lastMove.corners).toEqual([7]);
    expectClose(editor.lastMove.by, [0.2, 0.1, 0]);
    editor.fire("pointerup", { x: 150, y: 60 });
    expect([editor.pointer.dragging, editor.viewport.orbit.enabled]).toEqual([false, true]);
    expect(editor.sent.at(-2)).toMatchObject({ type: "drag_end", operation: editor.lastMove });
    // Released over a handle: another drag may follow.
    expect(editor.sent.at(-1)).toEqual({ type: "drag_expected" });
  });

  it("moves the corners of an edge, or all chosen corners", () => {
    const editor = new FakeEditor();
    editor.fire("pointerdown", EDGE_5_7);
    editor.fire("pointermove", { x: 140, y: 100 }, { buttons: 1 });
    expect(editor.lastMove.corners).toEqual([5, 7]);
    expectClose(editor.lastMove.by, [0.1, 0, 0]);
    const other = new FakeEditor();
    other.store.set({ corners: [0, 6, 7] });
    other.fire("pointerdown", CORNER_7);
    other.fire("pointermove", { x: 140, y: 70 }, { buttons: 1 });
    expect(other.lastMove.corners).toEqual([0, 6, 7]);
  });

  it("stays on an axis of the world until the axis is given again", () => {
    const editor = new FakeEditor();
    expect(editor.pointer.constrain("X")).toBe(false);
    editor.fire("pointerdown", CORNER_7);
    editor.fire("pointermove", { x: 150, y: 40 }, { buttons: 1 });
    expect(editor.pointer.constrain("X")).toBe(true);
    expectClose(editor.lastMove.by, [0.2, 0, 0]);
    editor.pointer.constrain("Y");
    expectClose(editor.lastMove.by, [0, 0.3, 0]);
    editor.pointer.constrain("Y");
    expectClose(editor.lastMove.by, [0.2, 0.3, 0]);
  });

  it("follows the motion since the press, and the mouse itself on an axis", () => {
    const editor = new FakeEditor();
    editor.fire("pointerdown", { x: 134, y: 70 });
    editor.fire("pointermove", { x: 150, y: 60 }, { buttons: 1 });
    expectClose(editor.lastMove.by, [0.16, 0.1, 0]);
    editor.pointer.constrain("X");
    expectClose(editor.lastMove.by, [0.2, 0, 0]);
  });

  it("snaps to steps of the cage's size while exactly one of button and key is on", () => {
    for (const [button, key, by] of [
      [false, true, 0.15],
      [true, false, 0.15],
      [true, true, 0.17],
      [false, false, 0.17],
    ] as const) {
      const editor = new FakeEditor();
      editor.store.set({ snap: button });
      editor.fire("pointerdown", CORNER_7, { ctrlKey: key });
      editor.fire("pointermove", { x: 147, y: 70 }, { buttons: 1, ctrlKey: key });
      // A cage of half-size .3 has steps of .05.
      expectClose(editor.lastMove.by, [by, 0, 0]);
    }
  });

  it("is undone by cancel, which is refused without a drag", () => {
    const editor = new FakeEditor();
    expect(editor.pointer.cancel()).toBe(false);
    editor.fire("pointerdown", CORNER_7);
    editor.fire("pointermove", { x: 150, y: 60 }, { buttons: 1 });
    expect(editor.pointer.cancel()).toBe(true);
    expect(editor.sent.at(-1)).toMatchObject({ type: "drag_cancel" });
    expect([editor.pointer.dragging, editor.viewport.orbit.enabled]).toEqual([false, true]);
  });

  it("follows the mouse once more before a frame is requested, and only where it has moved", () => {
    const editor = new FakeEditor();
    editor.fire("pointerdown", CORNER_7);
    editor.fire("pointermove", { x: 140, y: 70 }, { buttons: 1 });
    editor.fire("pointerrawupdate", { x: 145, y: 70 });
    expect(editor.operations).toHaveLength(1);
    for (const action of editor.frames.beforeRequest) action();
    expectClose(editor.lastMove.by, [0.15, 0, 0]);
    for (const action of editor.frames.beforeRequest) action();
    expect(editor.operations).toHaveLength(2);
  });

  it("is the gizmo's where no corner is in front of its handle", () => {
    const editor = new FakeEditor();
    editor.gizmo.axis = "X";
    editor.fire("pointerdown", NOTHING);
    expect(editor.gizmo.begin).toHaveBeenCalledOnce();
    editor.fire("pointermove", { x: 50, y: 100 }, { buttons: 1 });
    expect(editor.operations).toEqual([{ kind: "translate", by: [1, 0, 0] }]);
    editor.fire("pointerup", { x: 50, y: 100 });
    expect(editor.gizmo.end).toHaveBeenCalledOnce();
    const corner = new FakeEditor();
    corner.gizmo.axis = "X";
    corner.fire("pointerdown", CORNER_7);
    expect(corner.gizmo.begin).not.toHaveBeenCalled();
    expect(corner.pointer.dragging).toBe(true);
  });
});

describe("the mouse without a drag", () => {
  it("shows the part under it, and nothing of a locked edit or with hidden cages", () => {
    const editor = new FakeEditor();
    editor.fire("pointermove", CORNER_7);
    expect(editor.store.now.hover).toEqual({ cage: "inner", part: { kind: "corner", index: 7 } });
    expect(editor.viewport.canvas.style.cursor).toBe("pointer");
    editor.fire("pointerleave", CORNER_7);
    expect(editor.store.now.hover).toBeNull();
    for (const hidden of [{ state: state({ edits: [edit({ locked: true })] }) }, { cages: false }]) {
      editor.store.set(hidden);
      editor.fire("pointermove", CORNER_7);
      expect(editor.store.now.hover).toBeNull();
      editor.store.set({ state: state() });
    }
  });

  it("turns the view with a press beside the cages, with another button or with Alt", () => {
    for (const [pixel, more] of [
      [NOTHING, {}],
      [CORNER_7, { button: 2 }],
      [CORNER_7, { altKey: true }],
    ] as const) {
      const editor = new FakeEditor();
      expect(editor.fire("pointerdown", pixel, more)).toBe(false);
      expect([editor.camera.held, editor.pointer.dragging]).toEqual([true, false]);
      editor.fire("pointerup", pixel, more);
      expect(editor.camera.held).toBe(false);
    }
  });

  it("chooses corners with Shift, and unchooses them", () => {
    const editor = new FakeEditor();
    editor.click(CORNER_7, { shiftKey: true });
    editor.click(EDGE_5_7, { shiftKey: true });
    expect(editor.store.now.corners).toEqual([5, 7]);
    editor.click(CORNER_6, { shiftKey: true });
    expect(editor.store.now.corners).toEqual([5, 6, 7]);
    editor.click(EDGE_5_7, { shiftKey: true });
    expect(editor.store.now.corners).toEqual([6]);
    expect(editor.drag).toBeNull();
  });

  it("selects the edit whose cage is clicked, but not at the end of a longer motion", () => {
    const corners = box([-0.7, -0.7, 0], [0.2, 0.2, 0.2]);
    const other = edit({ id: 2, inner: corners, deformed: corners, outer: null, outer_pivot: null });
    const editor = new FakeEditor();
    editor.store.set({ state: state({ edits: [edit(), other] }) });
    const onEdge = { x: 20, y: 170 };
    editor.fire("pointerdown", { x: 20, y: 175 });
    editor.fire("pointerup", onEdge);
    expect(editor.sent).toEqual([]);
    editor.click(onEdge);
    expect(editor.sent).toEqual([{ type: "command", name: "select", edit: 2 }]);
  });

  it("places an edit with a double click beside cages, in shares of the canvas", () => {
    const editor = new FakeEditor();
    editor.click({ x: 20, y: 180 });
    editor.fire("dblclick", { x: 20, y: 180 });
    expect(editor.expectEdit).toHaveBeenCalledOnce();
    expect(editor.sent).toEqual([{ type: "place", x: 0.1, y: 0.9 }]);
    const onCage = new FakeEditor();
    onCage.click(CORNER_7);
    onCage.fire("dblclick", CORNER_7);
    expect(onCage.expectEdit).not.toHaveBeenCalled();
  });
});
