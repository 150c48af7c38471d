/** `window.cagefield`: what tests and measurements may read of the page. */
import { cornersOf, middle, type Part } from "../editing/cage";
import type { App } from "./app";
import type { Latency } from "../frames/latency";
import type { Operation } from "../editing/operations";
import type { PictureHeader } from "../net/protocol";
import { pickCorner } from "../editing/picking";
import { draggable } from "../editing/cage_overlay";
import { selected, type DrawnHere, type Editor } from "./store";

export interface TestApi {
  readonly now: Editor;
  readonly picture: PictureHeader | null;
  readonly latency: Latency;
  /** What the page's own GPU does: see `PageRenderer`. */
  readonly page: {
    drawn: number;
    why: string | null;
    draws: boolean;
    here: DrawnHere;
    /** How often the field was loaded. */
    loads: number;
    /** Bytes of edits that were uploaded, the last time and in all. */
    uploaded: { last: number; total: number };
    rates: string;
  };
  readonly camera: { c2w: number[]; seq: number };
  /** The drag that goes on: what the cages follow of it, and why not all. */
  readonly drag: {
    id: number;
    seq: number;
    ended: boolean;
    why: string | null;
    followed: Operation | null;
  } | null;
  /** Whether the last picture is final and shows what is to be seen: the camera, the view, the edits, no drag, no preview. */
  readonly settled: boolean;
  /** Milliseconds since a picture or a state came. */
  readonly quiet: number;
  /** A part of a cage, as it is shown, in CSS pixels of the window. */
  screen(
    edit: number,
    kind: Part["kind"],
    index: number,
    cage?: "inner" | "deformed" | "outer",
  ): { x: number; y: number };
  /** Where to take hold of the gizmo's handle ("X", "XY", "XYZ", ...), in CSS pixels of the window. */
  grip(axis: string): { x: number; y: number } | null;
  /** A point of space in CSS pixels of the window. */
  project(point: [number, number, number]): { x: number; y: number };
  /** Distance along the ray at a CSS pixel of the window; null where there is nothing. */
  depth(x: number, y: number): number | null;
}

declare global {
  interface Window {
    cagefield?: TestApi;
  }
}

export function testApi(app: App): TestApi {
  const { viewport } = app;
  const inWindow = (x: number, y: number): { x: number; y: number } => {
    const box = viewport.canvas.getBoundingClientRect();
    return { x: box.left + x, y: box.top + y };
  };
  return {
    get now() {
      return app.store.now;
    },
    get picture() {
      return app.presenter.last;
    },
    latency: app.presenter.latency,
    get page() {
      const { drawn, why, draws, here, scene, drawer, choice } = app.page;
      return {
        drawn,
        why,
        draws,
        here,
        loads: scene.loads,
        uploaded: { ...drawer.uploaded },
        rates: choice.words,
      };
    },
    get camera() {
      return { c2w: viewport.c2w, seq: app.camera.seq };
    },
    get drag() {
      if (app.drag === null) return null;
      const { id, seq, ended, why, followed } = app.drag;
      return { id, seq, ended, why, followed };
    },
    get settled() {
      const picture = app.presenter.last;
      const { state, view, before, split, preview } = app.store.now;
      if (app.drag !== null || preview !== null || picture === null || state === null || !app.camera.resting)
        return false;
      const seen =
        picture.camera === app.camera.seq && picture.revision >= state.pictured && picture.drag === 0;
      return (
        picture.final && seen && picture.view === view && picture.before === before && picture.split === split
      );
    },
    get quiet() {
      return performance.now() - app.presenter.news;
    },
    screen(id, kind, index, cage = "deformed") {
      const edit = app.store.now.state?.edits.find((each) => each.id === id);
      const posed = edit && app.shown(edit)[cage];
      if (!posed) throw new Error(`edit ${id} has no ${cage} cage`);
      const { x, y } = viewport.project(middle(posed.corners, cornersOf({ kind, index })));
      return inWindow(x, y);
    },
    grip(axis) {
      app.arrange();
      const { width, height } = viewport.points;
      const pixel = (at: { x: number; y: number }): [number, number] => [
        (0.5 + 0.5 * at.x) * width,
        (0.5 - 0.5 * at.y) * height,
      ];
      const edit = selected(app.store.now);
      const cages = edit === null ? [] : draggable(app.store.now, app.shown(edit));
      const slack = { x: 4 / width, y: 4 / height };
      const at = app.gizmo.grip(axis, slack, (device) =>
        cages.every(({ corners }) => pickCorner(...pixel(device), corners, viewport.project) === null),
      );
      return at && inWindow(...pixel(at));
    },
    project(point) {
      const { x, y } = viewport.project(point);
      return inWindow(x, y);
    },
    depth(x, y) {
      const box = viewport.canvas.getBoundingClientRect();
      return app.pictures.depth.at((x - box.left) / box.width, (y - box.top) / box.height);
    },
  };
}
