/**
 * Hotspots of an exported scene: marks that follow the camera, a card with the text, and a tour from one to the
 * next. Texts are shown as text alone: nothing in them is markup.
 */
import type { Distances } from "../field/views";
import type { View } from "./camera_path";
import { column, dot, length, subtract } from "./vectors";
import type { Vec3 } from "./vectors";

export interface Hotspot {
  title: string;
  text: string;
  position: Vec3;
  view: View;
  /** Places at the stills of the camera path, null where it is not to be seen; absent for one that stays. */
  along?: (Vec3 | null)[];
}

/** A mark is hidden where the surface is nearer by these shares of the hotspot's distance and of the scene. */
const OCCLUSION_SHARE = 0.02;
const OCCLUSION_SCENE_SHARE = 0.01;

/** The parts of the viewer that hotspots use. */
export interface HotspotHost {
  readonly canvas: HTMLCanvasElement;
  readonly orbit: { readonly eye: Vec3; readonly c2w: number[] };
  /** Focal length in CSS pixels. */
  readonly focal: number;
  /** Distances of the drawn image; null before the first one. */
  readonly distances: Distances | null;
  /** Diagonal of the scene's box, world units; 0 before the scene is there. */
  readonly extent: number;
  flyTo(view: View, around: Vec3): void;
  /** Where the edits, as they are shown, carry a hotspot; null where it is not to be seen. */
  place(hotspot: Hotspot): Vec3 | null;
}

/** Position of a point in CSS pixels of the canvas, and whether the camera sees it. */
export function projectPoint(
  host: Pick<HotspotHost, "canvas" | "orbit" | "focal" | "distances" | "extent">,
  point: Vec3,
): { x: number; y: number; seen: boolean } {
  const { c2w, eye } = host.orbit;
  const { clientWidth: width, clientHeight: height } = host.canvas;
  const ray = subtract(point, eye);
  const depth = -dot(ray, column(c2w, 2));
  if (depth <= 0) return { x: 0, y: 0, seen: false };
  const x = 0.5 * width + (host.focal * dot(ray, column(c2w, 0))) / depth;
  const y = 0.5 * height - (host.focal * dot(ray, column(c2w, 1))) / depth;
  if (x < 0 || y < 0 || x >= width || y >= height) return { x, y, seen: false };
  const distance = length(ray);
  const slack = OCCLUSION_SHARE * distance + OCCLUSION_SCENE_SHARE * host.extent;
  return { x, y, seen: surfaceAt(host.distances, x / width, y / height) >= distance - slack };
}

/** Distance of the surface at (u, v) in [0,1] from the left and the top; infinite where nothing is. */
function surfaceAt(distances: Distances | null, u: number, v: number): number {
  if (distances === null) return Infinity;
  const { width, height, values } = distances;
  return values[Math.floor(v * height) * width + Math.floor(u * width)];
}

export class HotspotMarks {
  /** The hotspot whose card is open; null without one. */
  shown: number | null = null;
  private readonly marks: HTMLButtonElement[];
  private readonly card: HTMLElement;

  constructor(
    private readonly host: HotspotHost,
    readonly hotspots: readonly Hotspot[],
    layer: HTMLElement,
    card: HTMLElement,
  ) {
    this.card = card;
    this.marks = hotspots.map((hotspot, index) => {
      const mark = document.createElement("button");
      mark.textContent = String(index + 1);
      mark.title = hotspot.title;
      mark.hidden = true;
      mark.onclick = () => this.open(index);
      return mark;
    });
    layer.replaceChildren(...this.marks);
  }

  /** Opens the card of a hotspot and flies to its view. */
  open(index: number): void {
    const hotspot = this.hotspots[index];
    this.shown = index;
    this.part("h2").textContent = hotspot.title;
    this.part("p").textContent = hotspot.text;
    this.part(".count").textContent = `${index + 1} / ${this.hotspots.length}`;
    this.card.hidden = false;
    this.marks.forEach((mark, n) => mark.classList.toggle("on", n === index));
    this.host.flyTo(hotspot.view, hotspot.position);
  }

  /** Goes on in the tour by a step: 1 or -1, from the last hotspot to the first. */
  step(by: number): void {
    const count = this.hotspots.length;
    if (count === 0) return;
    const start = by > 0 ? -1 : count;
    this.open(((this.shown ?? start) + by + count) % count);
  }

  close(): void {
    this.shown = null;
    this.card.hidden = true;
    for (const mark of this.marks) mark.classList.remove("on");
  }

  /** Puts the marks where the camera sees their hotspots. */
  arrange(): void {
    this.marks.forEach((mark, index) => {
      const place = this.host.place(this.hotspots[index]);
      mark.hidden = true;
      if (place === null) return;
      const { x, y, seen } = projectPoint(this.host, place);
      mark.hidden = !seen;
      if (seen) mark.style.transform = `translate(${x}px, ${y}px)`;
    });
  }

  private part(selector: string): HTMLElement {
    const found = this.card.querySelector<HTMLElement>(selector);
    if (!found) throw new Error(`the page has no ${selector}`);
    return found;
  }
}
