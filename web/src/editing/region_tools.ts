/**
 * Mouse input of the tools that select elements, and the region drawn over the view. Their listeners come before
 * those of the cages: with a tool taken up, the left button draws a region; with Alt it turns the view.
 */
import { isReadOnly, type Store } from "../app/store";
import type { PageMessage } from "../net/protocol";
import { extended, regionMessage, regionMode, type DrawnRegion, type ScreenPosition } from "./region_shapes";

const SVG = "http://www.w3.org/2000/svg";

/** The parts of the editor that the tools use. */
export interface RegionHost {
  readonly store: Store;
  readonly viewport: {
    readonly canvas: HTMLCanvasElement;
    readonly points: { readonly width: number; readonly height: number };
  };
  readonly camera: { readonly resting: boolean; restate(): void };
  readonly gizmo: { readonly axis: string | null };
  send(message: PageMessage): boolean;
}

export class RegionTools {
  /** The drawn region and the ring of the brush. */
  readonly element = document.createElementNS(SVG, "svg");
  private readonly shape = document.createElementNS(SVG, "path");
  private readonly ring = document.createElementNS(SVG, "circle");
  private drawn: DrawnRegion | null = null;
  private position: ScreenPosition = { x: -1, y: -1 };
  private inside = false;

  constructor(private readonly host: RegionHost) {
    this.element.setAttribute("class", "region");
    this.element.append(this.shape, this.ring);
    const { canvas } = host.viewport;
    canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event), { capture: true });
    canvas.addEventListener("pointerup", (event) => this.up(event), { capture: true });
    canvas.addEventListener("pointercancel", () => this.cancel(), { capture: true });
    canvas.addEventListener("pointerleave", () => this.leave(), { capture: true });
    canvas.addEventListener(
      "dblclick",
      (event) => {
        if (host.store.now.selecting !== null) event.stopImmediatePropagation();
      },
      { capture: true },
    );
    host.store.watch(["selecting", "brushRadius"], () => this.show());
  }

  /** Gives up the region that is being drawn; false without one. */
  cancel(): boolean {
    if (this.drawn === null) return false;
    this.drawn = null;
    this.show();
    return true;
  }

  private down(event: PointerEvent): void {
    this.read(event);
    const { now } = this.host.store;
    const isBeside = now.hover === null && this.host.gizmo.axis === null;
    const byKey = event.shiftKey && isBeside ? "rectangle" : null;
    const tool = now.selecting ?? byKey;
    if (tool === null || event.button !== 0 || event.altKey || isReadOnly(now)) return;
    event.stopImmediatePropagation();
    this.host.viewport.canvas.setPointerCapture(event.pointerId);
    const { ctrlKey, metaKey } = event;
    // Shift is what draws the rectangle here, and adds nothing.
    const keys = now.selecting === null ? { shiftKey: false, ctrlKey, metaKey } : event;
    this.drawn = { tool, mode: regionMode(tool, now.selectMode, keys), points: [{ ...this.position }] };
    if (tool === "flood") this.finish();
    this.show();
  }

  private move(event: PointerEvent): void {
    this.read(event);
    this.inside = true;
    if (this.drawn !== null) {
      event.stopImmediatePropagation();
      this.drawn.points = extended(this.drawn, { ...this.position });
    }
    if (this.drawn !== null || this.host.store.now.selecting !== null) this.show();
  }

  private up(event: PointerEvent): void {
    if (this.drawn === null) return;
    event.stopImmediatePropagation();
    this.read(event);
    this.drawn.points = extended(this.drawn, { ...this.position });
    this.finish();
    this.show();
  }

  private leave(): void {
    this.inside = false;
    this.show();
  }

  private finish(): void {
    const { store, viewport, camera } = this.host;
    const message = this.drawn === null ? null : regionMessage(this.drawn, viewport.points, store.now);
    this.drawn = null;
    if (message === null) return;
    if (!camera.resting) camera.restate();
    this.host.send(message);
  }

  private show(): void {
    const { selecting, brushRadius } = this.host.store.now;
    const radius = brushRadius * this.host.viewport.points.height;
    const isBrush = selecting === "brush";
    this.host.viewport.canvas.style.cursor = selecting === null ? "" : isBrush ? "none" : "crosshair";
    this.ring.style.display = isBrush && this.inside ? "" : "none";
    this.ring.setAttribute("r", String(radius));
    this.ring.setAttribute("cx", String(this.position.x));
    this.ring.setAttribute("cy", String(this.position.y));
    this.shape.setAttribute("d", this.drawn === null ? "" : outline(this.drawn));
    const isStroke = this.drawn?.tool === "brush";
    this.shape.setAttribute("class", `${isStroke ? "stroke" : "outline"} ${this.drawn?.mode ?? ""}`);
    this.shape.style.strokeWidth = isStroke ? `${2 * radius}px` : "";
  }

  private read(event: MouseEvent): void {
    const box = this.host.viewport.canvas.getBoundingClientRect();
    this.position = { x: event.clientX - box.left, y: event.clientY - box.top };
  }
}

/** Path of a region that is being drawn. */
function outline({ tool, points }: DrawnRegion): string {
  if (tool === "rectangle") {
    const [a, b] = [points[0], points[points.length - 1]];
    return `M${a.x} ${a.y}H${b.x}V${b.y}H${a.x}Z`;
  }
  const line = points.map(({ x, y }) => `${x} ${y}`).join("L");
  return tool === "lasso" ? `M${line}Z` : `M${line}${points.length === 1 ? "h0.01" : ""}`;
}
