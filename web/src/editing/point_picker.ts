/** Tools that collect clicked points of the surface: three of a level plane, or three pairs that align a paste. */
import type { PickedPoints, Store } from "../app/store";
import type { PointPair, Vec3 } from "../net/protocol";
import { surfacePoint, type MeasureHost } from "./measure_tool";

const SVG = "http://www.w3.org/2000/svg";
const POINT_RADIUS_PIXELS = 4;
const LABEL_OFFSET_PIXELS = 8;
const PLANE_POINTS = 3;
const PAIRS = 3;

/** Number of points of a tool. */
export const POINT_COUNT: Record<PickedPoints["purpose"], number> = { up: PLANE_POINTS, paste: 2 * PAIRS };

/** Words for the last point. */
const WHOLE_TEXT: Record<PickedPoints["purpose"], string> = {
  up: "three points are there: up is the normal of their plane",
  paste: `${PAIRS} pairs are there`,
};

/** Receivers of the collected points. */
export interface PickerActions {
  /** Three points of a level plane. */
  plane(points: Vec3[]): void;
  /** Pairs of points that align the selected paste. */
  pairs(pairs: PointPair[]): void;
}

export class PointPicker {
  /** Marks of the points, and lines between those of a pair. */
  readonly element = document.createElementNS(SVG, "svg");

  constructor(
    private readonly host: MeasureHost & { readonly store: Store },
    private readonly actions: PickerActions,
  ) {
    this.element.setAttribute("class", "measurement picked");
    host.viewport.beforeFrame.push(() => this.show());
    host.store.watch(["picked"], () => {
      this.show();
      host.viewport.invalidate();
    });
  }

  /** Adds the surface point under a pixel of the view; the last one hands them over. */
  add(x: number, y: number): void {
    const { store, viewport, pictures } = this.host;
    const { picked } = store.now;
    if (picked === null) return;
    const { purpose } = picked;
    const point = surfacePoint(viewport, pictures, x, y);
    if (point === null) return this.host.say("nothing is there; click on a surface", "warning");
    // A full set begins anew.
    const points = picked.points.length === POINT_COUNT[purpose] ? [point] : [...picked.points, point];
    const isWhole = points.length === POINT_COUNT[purpose];
    store.set({ picked: isWhole && purpose === "up" ? null : { purpose, points } });
    this.host.say(isWhole ? WHOLE_TEXT[purpose] : nextPointText({ purpose, points }), "info");
    if (!isWhole) return;
    if (purpose === "up") this.actions.plane(points);
    else this.actions.pairs(pairsOf(points));
  }

  private show(): void {
    const { picked } = this.host.store.now;
    const marks: SVGElement[] = [];
    const places = (picked?.points ?? []).map((point) => this.host.viewport.project(point));
    places.forEach(({ x, y, depth }, k) => {
      if (depth <= 0) return;
      const mate = picked?.purpose === "paste" && k % 2 === 1 ? places[k - 1] : null;
      if (mate !== null && mate.depth > 0)
        marks.push(shape("line", { x1: mate.x, y1: mate.y, x2: x, y2: y }));
      marks.push(shape("circle", { cx: x, cy: y, r: POINT_RADIUS_PIXELS }));
      const label = shape("text", { x: x + LABEL_OFFSET_PIXELS, y: y - LABEL_OFFSET_PIXELS });
      label.textContent = picked === null ? "" : pointLabel(picked.purpose, k);
      marks.push(label);
    });
    this.element.replaceChildren(...marks);
  }
}

/** Pairs of points clicked in turn: of the pasted content, and of the scene where it belongs. */
export function pairsOf(points: readonly Vec3[]): PointPair[] {
  return Array.from({ length: Math.floor(points.length / 2) }, (_, k) => ({
    pasted: points[2 * k],
    scene: points[2 * k + 1],
  }));
}

/** The click that a tool waits for. */
export function nextPointText({ purpose, points }: PickedPoints): string {
  const done = points.length % POINT_COUNT[purpose];
  if (purpose === "up") return `click on point ${done + 1} of ${PLANE_POINTS} of something level`;
  const pair = `pair ${Math.floor(done / 2) + 1} of ${PAIRS}`;
  return done % 2 === 0 ? `${pair}: click on the pasted thing` : `${pair}: click where that point belongs`;
}

function pointLabel(purpose: PickedPoints["purpose"], k: number): string {
  return purpose === "up" ? String(k + 1) : `${Math.floor(k / 2) + 1}${k % 2 === 0 ? "" : "′"}`;
}

function shape(name: string, values: Record<string, number>): SVGElement {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(values)) element.setAttribute(key, String(value));
  return element;
}
