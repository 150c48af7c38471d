/** Actions of the user apart from drags, for keys, buttons and menus. */
import { halfExtent } from "./cage";
import { targetCage } from "./drag";
import { middleOf } from "./point_cages";
import { nextPointText } from "./point_picker";
import type { App } from "../app/app";
import type {
  ChangeSelection,
  Command,
  EditState,
  Mirror,
  Place,
  SelectionCage,
  Subdivide,
  Vec3,
} from "../net/protocol";
import { isSplatFile, uploadAddress, uploadFile } from "../net/upload";
import { isFirstUse } from "../app/session_storage";
import {
  NO_POINT_TOOL,
  canFill,
  canRelight,
  hasPointTool,
  selectedEdit,
  dragTarget,
  upOf,
  type CageName,
  type Editor,
  type PickedPoints,
  type SelectTool,
  type Tool,
  type View,
} from "../app/store";

const VIEWS: View[] = ["color", "depth", "opacity", "normals"];
const O_KEY_NOTICE = "cagefield.proportional";
const CAGES: CageName[] = ["inner", "outer", "both"];

/** Limits of the brush's radius, shares of the view's height, and the factor of a step. */
const MIN_BRUSH = 0.005;
const MAX_BRUSH = 0.5;
const BRUSH_STEP = 1.2;

/** Bytes of a mesh file that fit into a message in base64. */
const MAX_MESH_FILE = 750_000;

export class Actions {
  private cameraIndex = -1;

  /** `askFolder` asks for the folder to save into. */
  constructor(
    private readonly app: App,
    private readonly askFolder: () => void = () => undefined,
  ) {}

  setTool(tool: Tool): void {
    this.app.store.set({ tool, selecting: null, ...NO_POINT_TOOL });
  }

  /** Takes a tool that selects elements, or puts it away. */
  toggleSelecting(tool: SelectTool): void {
    const { selecting } = this.app.store.now;
    this.app.store.set({
      selecting: selecting === tool ? null : tool,
      ...NO_POINT_TOOL,
      hover: null,
    });
  }

  /** Takes the measuring tool, or puts it away. */
  toggleMeasuring(): void {
    const { measured } = this.app.store.now;
    this.app.store.set({
      ...NO_POINT_TOOL,
      measured: measured === null ? [] : null,
      selecting: null,
      hover: null,
    });
  }

  /** Takes the tool that places hotspots, or puts it away. */
  toggleHotspots(): void {
    const { placesHotspot } = this.app.store.now;
    this.app.store.set({
      ...NO_POINT_TOOL,
      placesHotspot: !placesHotspot,
      selecting: null,
      hover: null,
    });
  }

  /** Takes the tool that collects points for a purpose, or puts it away. */
  togglePicking(purpose: PickedPoints["purpose"]): void {
    const { now } = this.app.store;
    if (purpose === "paste" && selectedEdit(now)?.source == null)
      return this.app.say("choose an edit that pastes: pairs of points align what is pasted", "warning");
    const picked = now.picked?.purpose === purpose ? null : { purpose, points: [] };
    this.app.store.set({ ...NO_POINT_TOOL, picked, selecting: null, hover: null });
    if (picked !== null) this.app.say(nextPointText(picked));
  }

  /** Changes the size of the brush by a step; false where the brush is not the tool. */
  resizeBrush(step: 1 | -1): boolean {
    const { selecting, brushRadius } = this.app.store.now;
    if (selecting !== "brush") return false;
    const radius = brushRadius * (step > 0 ? BRUSH_STEP : 1 / BRUSH_STEP);
    this.app.store.set({ brushRadius: Math.min(MAX_BRUSH, Math.max(MIN_BRUSH, radius)) });
    return true;
  }

  changeSelection(change: ChangeSelection["change"]): void {
    this.app.send({ type: "change_selection", change });
  }

  /** Shows the selected elements alone, or all again. */
  toggleIsolated(): void {
    this.app.send({ type: "isolate", on: this.app.store.now.state?.isolated !== true });
  }

  /** Deletes the selected elements from the field. */
  removeElements(): void {
    if (this.app.store.now.state?.selection == null)
      return this.app.say("nothing is selected: paint with the brush (M), or drag a lasso (J)", "warning");
    this.app.send({ type: "remove_elements" });
  }

  /** Restores all deleted elements. */
  restoreElements(): void {
    this.app.send({ type: "remove_elements", restore: true });
  }

  /** Deletes the selected elements with a tool that selects them in hand, else the selected edit. */
  remove(): void {
    const { selecting, state } = this.app.store.now;
    if (selecting !== null && state?.selection != null) this.removeElements();
    else this.removeSelected();
  }

  /** Makes an edit whose inner cage, of a shape, holds the selected elements; `margin` in cells. */
  encloseSelection(cage: NonNullable<SelectionCage["cage"]> = "box", margin?: number): void {
    if (this.app.store.now.state?.selection == null)
      return this.app.say("nothing is selected: paint with the brush (M), or drag a lasso (J)", "warning");
    this.app.expectEdit();
    this.app.send({ type: "selection_cage", cage, ...(margin === undefined ? {} : { margin }) });
  }

  setMode(mode: Editor["mode"]): void {
    this.app.store.set({ mode, corners: [], hover: null });
  }

  toggleMode(): void {
    this.setMode(this.app.store.now.mode === "set" ? "edit" : "set");
  }

  toggleAxes(): void {
    this.app.store.set({ axes: this.app.store.now.axes === "world" ? "cage" : "world" });
  }

  setCage(cage: CageName): void {
    this.app.store.set({ cage, corners: [], hover: null });
  }

  nextCage(): void {
    this.setCage(next(CAGES, this.app.store.now.cage));
  }

  setView(view: View): void {
    this.app.store.set({ view });
  }

  nextView(): void {
    this.setView(next(VIEWS, this.app.store.now.view));
  }

  /** Switches proportional editing; says once for each browser that this key showed the cages before. */
  toggleProportional(moved: boolean): void {
    const proportional = !this.app.store.now.proportional;
    this.app.store.set({ proportional });
    if (moved && isFirstUse(O_KEY_NOTICE))
      this.app.say("O is proportional editing of points now; Shift+O shows or hides the cages");
    else this.app.say(`proportional editing is ${proportional ? "on: the wheel changes its radius" : "off"}`);
  }

  /** Switches between distances through dense matter alone and straight ones, of the selected control points. */
  toggleConnected(): void {
    this.withSelected((edit) => {
      if (edit.cage !== "points" || edit.points === null)
        return this.app.say("connected only is for control points (Ctrl+double-click)", "warning");
      const connected = !edit.points.connected;
      this.app.send({ type: "point_reach", edit: edit.id, connected });
      this.app.say(
        `connected only is ${connected ? "on: the points reach through dense matter alone" : "off"}`,
      );
    });
  }

  /** Makes an edit of a control point, on the surface in the middle of the view. */
  placePoint(): void {
    this.app.expectEdit();
    this.app.send({ type: "place_point" });
  }

  /** Makes the selected inner cage a lattice. */
  subdivide(cells: Subdivide["cells"], interpolation: Subdivide["interpolation"]): void {
    this.withSelected((edit) => this.app.send({ type: "subdivide", edit: edit.id, cells, interpolation }));
  }

  toggle(what: "snap" | "grid" | "cages" | "panel" | "help"): void {
    this.app.store.set({ [what]: !this.app.store.now[what] });
  }

  toggleSplit(): void {
    this.app.store.set({ split: this.app.store.now.split === null ? 0.5 : null });
  }

  command(name: Command["name"], edit: number | null = null): void {
    this.app.send({ type: "command", name, edit });
  }

  /** Calls an action with the selected edit, or says that none is selected. */
  withSelected(action: (edit: EditState) => void): void {
    const edit = selectedEdit(this.app.store.now);
    if (edit === null) this.app.say("no edit is selected: double-click the picture to make one", "warning");
    else action(edit);
  }

  duplicate(): void {
    this.withSelected((edit) => this.command("duplicate", edit.id));
  }

  removeSelected(): void {
    this.withSelected((edit) => this.command("remove", edit.id));
  }

  mirror(axis: Mirror["axis"]): void {
    this.withSelected((edit) => this.app.send({ type: "mirror", edit: edit.id, axis }));
  }

  toggleEnabled(): void {
    this.withSelected((edit) => this.app.send({ type: "change", edit: edit.id, enabled: !edit.enabled }));
  }

  /** Changes a continuous edit to a move, and any discrete edit to a continuous one. */
  toggleKind(): void {
    this.withSelected((edit) => {
      if (edit.source !== null)
        return this.app.say("a paste is always a copy; remove the edit to remove the paste", "warning");
      const kind = edit.kind === "continuous" ? "move" : "continuous";
      this.app.send({ type: "change", edit: edit.id, kind });
    });
  }

  /** Switches the fill of the area that a move or a delete uncovers. */
  toggleFill(): void {
    this.withSelected((edit) => {
      if (!canFill(this.app.store.now))
        this.app.say("only a move or a delete uncovers something to fill", "warning");
      else
        this.app.send({
          type: "change",
          edit: edit.id,
          fill: edit.fill === "none" ? "surroundings" : "none",
        });
    });
  }

  /** Switches whether shadows move with an edit. */
  toggleShadows(): void {
    this.withSelected((edit) => {
      if (!canRelight(this.app.store.now))
        this.app.say("choose an edit first: its shadows go along, or stay", "warning");
      else
        this.app.send({
          type: "change",
          edit: edit.id,
          relight: edit.relight === "none" ? "occlusion" : "none",
        });
    });
  }

  place(at: Pick<Place, "x" | "y"> = {}): void {
    this.app.expectEdit();
    this.app.send({ type: "place", ...at });
  }

  fitInner(): void {
    this.withSelected((edit) => this.app.send({ type: "fit_inner", edit: edit.id }));
  }

  outerMargin(margin: number): void {
    this.withSelected((edit) => this.app.send({ type: "outer_margin", edit: edit.id, margin }));
  }

  /** Centers the orbit on the selected cage; without a selection, on the surface at a CSS pixel. */
  focus(x: number, y: number): void {
    const edit = selectedEdit(this.app.store.now);
    if (edit !== null) {
      const cage = targetCage(this.app.shownCages(edit), dragTarget(this.app.store.now));
      this.app.viewport.focus(middleOf(cage), 2 * halfExtent(cage.corners));
      return;
    }
    const { width, height } = this.app.viewport.points;
    void this.app.ask({ what: "surface", x: x / width, y: y / height }).then((answer) => {
      if (!answer?.point) return;
      const { point } = answer;
      const eye = this.app.viewport.camera.position.toArray();
      this.app.viewport.focus(point, 0.2 * Math.hypot(...point.map((c, i) => c - eye[i])));
    });
  }

  /** Looks from the scene's first view, or from the camera `step` places further in its list. */
  lookFrom(step: number | null): void {
    const { hello } = this.app.store.now;
    if (hello === null) return;
    const around = hello.bounds[0].map((low, i) => 0.5 * (low + hello.bounds[1][i])) as Vec3;
    let pose = hello.start.c2w;
    if (step !== null && hello.cameras.length > 0) {
      this.cameraIndex = (this.cameraIndex + step + hello.cameras.length) % hello.cameras.length;
      pose = hello.cameras[this.cameraIndex];
      this.app.say(`camera ${this.cameraIndex + 1} of ${hello.cameras.length}`);
    }
    this.app.viewport.lookFrom(pose, hello.start.fov_y_deg, upOf(this.app.store.now), around);
  }

  copy(): void {
    this.withSelected((edit) => {
      void this.app.ask({ what: "edit_text", edit: edit.id }).then(async (answer) => {
        if (!answer?.text) return;
        try {
          await navigator.clipboard.writeText(answer.text);
          this.app.say(`“${edit.name}” is copied as text`);
        } catch {
          this.app.say("the browser does not let this page write to the clipboard", "error");
        }
      });
    });
  }

  paste(text: string): void {
    if (text.trim() !== "") this.app.send({ type: "load_edits", text, append: true });
  }

  /** Opens a file of splats in place of the scene; loads the edits of any other file. */
  async load(file: File): Promise<void> {
    if (isSplatFile(file.name)) await this.open(file);
    else if (file.name.toLowerCase().endsWith(".obj")) await this.placeMesh(file);
    else this.app.send({ type: "load_edits", text: await file.text(), append: false });
  }

  /** A new edit with the mesh of a file as its inner cage, where the file has it. */
  async placeMesh(file: File): Promise<void> {
    if (file.size > MAX_MESH_FILE) {
      this.app.say(`${file.name} is too large for a cage: decimate it to 512 vertices`, "error");
      return;
    }
    const bytes = new Uint8Array(await file.arrayBuffer());
    let text = "";
    for (const byte of bytes) text += String.fromCharCode(byte);
    this.app.expectEdit();
    this.app.send({ type: "place_mesh", name: file.name, content: btoa(text) });
  }

  /** Saves the scene; asks for a folder first if the scene is an opened file. */
  save(): void {
    if (this.app.store.now.state?.is_file) this.askFolder();
    else this.command("save");
  }

  private async open(file: File): Promise<void> {
    if (this.app.store.now.upload !== null) {
      this.app.say("another file is being opened", "warning");
      return;
    }
    const { name } = file;
    this.app.store.set({ upload: { name, share: 0 } });
    const progress = (share: number): void => this.app.store.set({ upload: { name, share } });
    const why = await uploadFile(new XMLHttpRequest(), file, uploadAddress(location, name), progress);
    this.app.store.set({ upload: null });
    if (why !== null) this.app.say(why, "error");
  }

  addKey(): void {
    const { state } = this.app.store.now;
    if (state === null) return;
    const parts = state.keys.at(-1)?.parts ?? {};
    const key = { c2w: this.app.viewport.c2w, fov_y_deg: this.app.viewport.camera.fov, seconds: 2, parts };
    this.app.send({ type: "set_path", keys: [...state.keys, key], loop: state.loop });
  }

  /**
   * Cancels the first of these that exists: the drag, the help, the tool that selects elements, the chosen
   * corners, the selected edit.
   */
  escape(cancelDrag: () => boolean): void {
    const { now } = this.app.store;
    if (cancelDrag()) return;
    if (now.help) this.app.store.set({ help: false });
    else if (hasPointTool(now)) this.app.store.set(NO_POINT_TOOL);
    else if (now.selecting !== null) this.app.store.set({ selecting: null });
    else if (now.corners.length > 0) this.app.store.set({ corners: [] });
    else if (now.state?.selected != null) this.command("select", null);
  }
}

function next<T>(all: T[], now: T): T {
  return all[(all.indexOf(now) + 1) % all.length];
}
