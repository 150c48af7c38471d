/** `window.cagefield`: state of the page for tests and measurements. */
import { partCorners, type CagePart } from "../editing/cage";
import type { App } from "./app";
import type { Latency } from "../frames/latency";
import type { Operation } from "../editing/operations";
import type { PictureHeader } from "../net/protocol";
import { pickHandle } from "../editing/picking";
import { middleOf } from "../editing/point_cages";
import { draggableCages } from "../editing/cage_overlay";
import { selectedEdit, type DrawnHere, type Editor } from "./store";

export interface TestApi {
  readonly now: Editor;
  readonly picture: PictureHeader | null;
  readonly latency: Latency;
  /** State of rendering by the page's own GPU: see `PageRenderer`. */
  readonly page: {
    drawn: number;
    why: string | null;
    draws: boolean;
    here: DrawnHere;
    /** Number of loads of the field. */
    loads: number;
    /** Bytes of edits uploaded to the GPU, by the last change and by all. */
    uploaded: { last: number; total: number };
    rates: string;
  };
  readonly camera: { c2w: number[]; seq: number };
  /** Number of positions of selected elements that are drawn. */
  readonly highlighted: number;
  /** The drag in progress: the operation that the cages follow, and the reason if that is not all of it. */
  readonly drag: {
    id: number;
    seq: number;
    ended: boolean;
    why: string | null;
    followed: Operation | null;
  } | null;
  /**
   * Whether the last frame is final and shows the current camera, view and edits, without a drag or a
   * preview.
   */
  readonly settled: boolean;
  /** Milliseconds since the last frame or state. */
  readonly quiet: number;
  /** Position of a part of a drawn cage, in CSS pixels of the window. */
  screen(
    edit: number,
    kind: CagePart["kind"],
    index: number,
    cage?: "inner" | "deformed" | "outer",
  ): { x: number; y: number };
  /** Position where the gizmo's handle ("X", "XY", "XYZ", ...) can be grabbed, in CSS pixels of the window. */
  grip(axis: string): { x: number; y: number } | null;
  /** Position of a world point, in CSS pixels of the window. */
  project(point: [number, number, number]): { x: number; y: number };
  /** Distance along the ray of a CSS pixel of the window; null where the ray hits nothing. */
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
      return app.frames.last;
    },
    latency: app.frames.latency,
    get page() {
      const { drawn, why, draws, here, scene, uploaded, location } = app.page;
      return {
        drawn,
        why,
        draws,
        here,
        loads: scene.loads,
        uploaded: { ...uploaded },
        rates: location.summary,
      };
    },
    get camera() {
      return { c2w: viewport.c2w, seq: app.camera.seq };
    },
    get highlighted() {
      return app.highlight.shown;
    },
    get drag() {
      if (app.drag === null) return null;
      const { id, seq, ended, why, followed } = app.drag;
      return { id, seq, ended, why, followed };
    },
    get settled() {
      const picture = app.frames.last;
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
      return performance.now() - app.frames.lastNews;
    },
    screen(id, kind, index, cage = "deformed") {
      const edit = app.store.now.state?.edits.find((each) => each.id === id);
      const posed = edit && app.shownCages(edit)[cage];
      if (!posed) throw new Error(`edit ${id} has no ${cage} cage`);
      const { x, y } = viewport.project(
        middleOf(kind === "point" ? posed : { ...posed, points: undefined }, partCorners({ kind, index })),
      );
      return inWindow(x, y);
    },
    grip(axis) {
      app.arrange();
      const { width, height } = viewport.points;
      const pixel = (at: { x: number; y: number }): [number, number] => [
        (0.5 + 0.5 * at.x) * width,
        (0.5 - 0.5 * at.y) * height,
      ];
      const edit = selectedEdit(app.store.now);
      const cages = edit === null ? [] : draggableCages(app.store.now, app.shownCages(edit));
      const slack = { x: 4 / width, y: 4 / height };
      const at = app.gizmo.grip(axis, slack, (device) =>
        cages.every(({ posed }) => pickHandle(...pixel(device), posed, viewport.project) === null),
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
