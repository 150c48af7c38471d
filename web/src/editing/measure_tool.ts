/** The measuring tool: the distance between two clicked points of the surface, drawn over the view. */
import { isReadOnly, type Store } from "../app/store";
import type { Vec3 } from "../net/protocol";
import type { ScreenPoint } from "./picking";
import { roundDecimals } from "./operations";

const SVG = "http://www.w3.org/2000/svg";
const POINT_RADIUS_PIXELS = 4;
const LABEL_OFFSET_PIXELS = 10;
const SIGNIFICANT_DIGITS = 4;

/** The parts of the editor that the tool uses. */
export interface MeasureHost {
  readonly store: Store;
  readonly viewport: {
    readonly points: { readonly width: number; readonly height: number };
    readonly beforeFrame: (() => void)[];
    project(point: Vec3): ScreenPoint;
    ray(
      x: number,
      y: number,
    ): { readonly origin: { toArray(): number[] }; readonly direction: { toArray(): number[] } };
    invalidate(): void;
  };
  readonly pictures: { readonly depth: { at(u: number, v: number): number | null } };
  say(text: string, level: "info" | "warning" | "error"): void;
}

export class MeasureTool {
  /** The line between the points, and its length. */
  readonly element = document.createElementNS(SVG, "svg");
  private readonly line = document.createElementNS(SVG, "line");
  private readonly marks = [0, 1].map(() => document.createElementNS(SVG, "circle"));
  private readonly label = document.createElementNS(SVG, "text");

  /** `askScale` asks how many meters a distance in world units is. */
  constructor(
    private readonly host: MeasureHost,
    private readonly askScale: (distance: number) => void,
  ) {
    this.element.setAttribute("class", "measurement");
    this.element.append(this.line, ...this.marks, this.label);
    for (const mark of this.marks) mark.setAttribute("r", String(POINT_RADIUS_PIXELS));
    host.viewport.beforeFrame.push(() => this.show());
    host.store.watch(["measured", "state"], () => {
      this.show();
      host.viewport.invalidate();
    });
  }

  /** Adds the surface point under a pixel of the view; the second point ends the measurement. */
  add(x: number, y: number): void {
    const { store, viewport, pictures } = this.host;
    const { measured } = store.now;
    if (measured === null) return;
    const point = surfacePoint(viewport, pictures, x, y);
    if (point === null) {
      this.host.say("nothing is there to measure from; click on a surface", "warning");
      return;
    }
    const points = measured.length === 2 ? [point] : [...measured, point];
    store.set({ measured: points });
    if (points.length === 2 && !isReadOnly(store.now)) this.askScale(distanceOf(points));
  }

  private show(): void {
    const { measured, state } = this.host.store.now;
    const places = (measured ?? []).map((point) => this.host.viewport.project(point));
    const isSeen = places.map((place) => place.depth > 0);
    this.marks.forEach((mark, k) => {
      mark.style.display = isSeen[k] ? "" : "none";
      if (!isSeen[k]) return;
      mark.setAttribute("cx", String(places[k].x));
      mark.setAttribute("cy", String(places[k].y));
    });
    const isWhole = places.length === 2 && isSeen.every(Boolean);
    this.line.style.display = this.label.style.display = isWhole ? "" : "none";
    if (!isWhole || measured === null) return;
    const [a, b] = places;
    this.line.setAttribute("x1", String(a.x));
    this.line.setAttribute("y1", String(a.y));
    this.line.setAttribute("x2", String(b.x));
    this.line.setAttribute("y2", String(b.y));
    this.label.setAttribute("x", String(0.5 * (a.x + b.x) + LABEL_OFFSET_PIXELS));
    this.label.setAttribute("y", String(0.5 * (a.y + b.y) - LABEL_OFFSET_PIXELS));
    this.label.textContent = describeDistance(distanceOf(measured), state?.meters_per_unit ?? null);
  }
}

/** The point of the surface under a pixel of the view, world space; null where nothing is. */
export function surfacePoint(
  viewport: MeasureHost["viewport"],
  pictures: MeasureHost["pictures"],
  x: number,
  y: number,
): Vec3 | null {
  const depth = pictures.depth.at(x / viewport.points.width, y / viewport.points.height);
  if (depth === null) return null;
  const { origin, direction } = viewport.ray(x, y);
  const along = direction.toArray();
  return origin.toArray().map((value, k) => value + depth * along[k]) as Vec3;
}

/** Distance between two points, world units. */
export function distanceOf([a, b]: readonly Vec3[]): number {
  return Math.hypot(...a.map((value, k) => value - b[k]));
}

/** A distance in meters where the scale is known, else in units of the scene. */
export function describeDistance(distance: number, metersPerUnit: number | null): string {
  const length = distance * (metersPerUnit ?? 1);
  const digits = Math.min(20, Math.max(0, SIGNIFICANT_DIGITS - 1 - Math.floor(Math.log10(length))));
  return `${roundDecimals(length, digits)} ${metersPerUnit === null ? "units" : "m"}`;
}
