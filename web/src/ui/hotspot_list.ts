/** Hotspots of the scene: the list in the panel, and their marks over the view. */
import { ChevronUp, Crosshair, MapPin, Pencil, RefreshCw, Route, Trash2 } from "lucide";
import type { Actions } from "../editing/actions";
import { surfacePoint } from "../editing/measure_tool";
import type { App } from "../app/app";
import { isReadOnly, upOf } from "../app/store";
import type { HotspotState, Vec3 } from "../net/protocol";
import { putHotspot, type Dialogs } from "./dialogs";
import { h, iconButton, section } from "./dom";

/** A mark is hidden where the surface is nearer than its hotspot by more than this share of the distance. */
const OCCLUSION_SHARE = 0.02;
const OCCLUSION_VOXELS = 3;

export class Hotspots {
  /** The list in the panel. */
  readonly panel: HTMLElement;
  /** Marks over the view. */
  readonly marks = h("div", { class: "hotspots" });
  private readonly list = h("ol", { class: "hotspot-list" });
  private buttons: { hotspot: HotspotState; element: HTMLButtonElement }[] = [];

  constructor(
    private readonly app: App,
    actions: Actions,
    private readonly dialogs: Pick<Dialogs, "hotspot" | "tour">,
  ) {
    const place = iconButton(
      MapPin,
      "Place on the surface (Shift+H)",
      () => actions.toggleHotspots(),
      "place",
    );
    const tour = iconButton(Route, "Tour as the camera path…", () => dialogs.tour(), "tour");
    this.panel = section("Hotspots", h("div", { class: "bar" }, place, tour), this.list);
    app.store.watch(["state"], ({ state }) => {
      this.build();
      tour.disabled = !state?.hotspots.some(({ hidden }) => !hidden);
    });
    app.store.watch(["placesHotspot"], (now) => place.classList.toggle("on", now.placesHotspot));
    app.viewport.beforeFrame.push(() => this.arrange());
  }

  /** Asks for the texts of a hotspot on the surface under a pixel of the view. */
  place(x: number, y: number): void {
    const { app } = this;
    const position = surfacePoint(app.viewport, app.pictures, x, y);
    if (position === null) return app.say("nothing is there to mark; click on a surface", "warning");
    const camera = { c2w: app.viewport.c2w, fov_y_deg: app.viewport.camera.fov };
    const title = `Hotspot ${(app.store.now.state?.hotspots.length ?? 0) + 1}`;
    this.dialogs.hotspot({ id: null, title, text: "", position, camera, follows: true });
  }

  private build(): void {
    const hotspots = this.app.store.now.state?.hotspots ?? [];
    if (JSON.stringify(hotspots) === JSON.stringify(this.buttons.map(({ hotspot }) => hotspot))) return;
    this.list.replaceChildren(...hotspots.map((hotspot, index) => this.row(hotspot, index)));
    this.buttons = hotspots.map((hotspot, index) => ({ hotspot, element: this.mark(hotspot, index) }));
    this.marks.replaceChildren(...this.buttons.map(({ element }) => element));
    this.app.viewport.invalidate();
  }

  private row(hotspot: HotspotState, index: number): HTMLElement {
    const { app } = this;
    const note = hotspot.hidden ? "the edits hide its place" : hotspot.text;
    const title = h("span", { class: "name", title: note }, hotspot.title);
    title.ondblclick = () => !isReadOnly(app.store.now) && this.dialogs.hotspot(hotspot);
    const move = (to: number | null) => (): void => {
      app.send({ type: "move_hotspot", hotspot: hotspot.id, to });
    };
    const takeView = (): void => {
      const camera = { c2w: app.viewport.c2w, fov_y_deg: app.viewport.camera.fov };
      app.send(putHotspot({ ...hotspot, camera }));
    };
    return h(
      "li",
      { class: "row", data: { hotspot: String(hotspot.id) } },
      h("span", { class: "number" }, String(index + 1)),
      title,
      iconButton(Crosshair, "Look at it", () => this.look(hotspot), "go"),
      iconButton(Pencil, "Title and text…", () => this.dialogs.hotspot(hotspot), "write"),
      iconButton(RefreshCw, "Take the view as it is now", takeView, "update"),
      iconButton(ChevronUp, "Earlier in the tour", move(Math.max(0, index - 1)), "earlier"),
      iconButton(Trash2, "Remove this hotspot", move(null), "drop"),
    );
  }

  private mark(hotspot: HotspotState, index: number): HTMLButtonElement {
    const onclick = (): void =>
      isReadOnly(this.app.store.now) ? this.look(hotspot) : this.dialogs.hotspot(hotspot);
    const mark = h("button", { type: "button", title: hotspot.title, onclick }, String(index + 1));
    mark.hidden = true; // until it has its place
    return mark;
  }

  /** Looks from the hotspot's camera, or turns the present view to it. */
  private look({ camera, position }: HotspotState): void {
    const { viewport, store } = this.app;
    const { hello } = store.now;
    if (hello === null) return;
    if (camera !== null) viewport.lookFrom(camera.c2w, camera.fov_y_deg, upOf(store.now), position);
    else viewport.focus(position, 0.15 * distance(position, viewport.camera.position.toArray()));
  }

  /** Where a hotspot is seen: in a preview of this page on its way along the path, in another page's nowhere. */
  private placeOf(hotspot: HotspotState): Vec3 | null {
    if (this.app.store.now.preview !== null) return this.app.player.placeOf(hotspot);
    return hotspot.hidden ? null : hotspot.position;
  }

  /** Puts the marks where the camera sees their hotspots. */
  private arrange(): void {
    const { viewport, pictures, store } = this.app;
    const { width, height } = viewport.points;
    const eye = viewport.camera.position.toArray();
    const slack = OCCLUSION_VOXELS * (store.now.hello?.voxel ?? 0);
    for (const { hotspot, element } of this.buttons) {
      const place = this.placeOf(hotspot);
      element.hidden = true;
      if (place === null) continue;
      const { x, y, depth } = viewport.project(place);
      const inside = depth > 0 && x >= 0 && y >= 0 && x < width && y < height;
      const far = distance(place, eye);
      const surface = inside ? pictures.depth.at(x / width, y / height) : null;
      const occluded = surface !== null && surface < far * (1 - OCCLUSION_SHARE) - slack;
      element.hidden = !inside || occluded;
      if (!element.hidden) element.style.transform = `translate(${x}px, ${y}px)`;
    }
  }
}

function distance(a: Vec3, b: readonly number[]): number {
  return Math.hypot(...a.map((value, k) => value - b[k]));
}
