/** What a user can do beside dragging: for keys, buttons and menus alike. */
import { extent, middle } from "./cage";
import { leading } from "./drag";
import type { App } from "../app/app";
import type { Command, EditState, Mirror, Place, Vec3 } from "../net/protocol";
import { isSplats, openAddress, send } from "../net/upload";
import {
  fillable,
  relightable,
  selected,
  target,
  type CageName,
  type Editor,
  type Tool,
  type View,
} from "../app/store";

const VIEWS: View[] = ["colour", "depth", "opacity", "normals"];
const CAGES: CageName[] = ["inner", "outer", "both"];

export class Actions {
  private camera = -1;

  /** `whereTo` asks for the folder to save into. */
  constructor(
    private readonly app: App,
    private readonly whereTo: () => void = () => undefined,
  ) {}

  tool(tool: Tool): void {
    this.app.store.set({ tool });
  }

  mode(mode: Editor["mode"]): void {
    this.app.store.set({ mode, corners: [], hover: null });
  }

  toggleMode(): void {
    this.mode(this.app.store.now.mode === "set" ? "edit" : "set");
  }

  toggleAxes(): void {
    this.app.store.set({ axes: this.app.store.now.axes === "world" ? "cage" : "world" });
  }

  cage(cage: CageName): void {
    this.app.store.set({ cage, corners: [], hover: null });
  }

  nextCage(): void {
    this.cage(next(CAGES, this.app.store.now.cage));
  }

  view(view: View): void {
    this.app.store.set({ view });
  }

  nextView(): void {
    this.view(next(VIEWS, this.app.store.now.view));
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

  /** Does something to the selected edit, or says that none is selected. */
  withSelected(action: (edit: EditState) => void): void {
    const edit = selected(this.app.store.now);
    if (edit === null) this.app.say("no edit is selected: double-click the picture to make one", "warning");
    else action(edit);
  }

  duplicate(): void {
    this.withSelected((edit) => this.command("duplicate", edit.id));
  }

  remove(): void {
    this.withSelected((edit) => this.command("remove", edit.id));
  }

  mirror(axis: Mirror["axis"]): void {
    this.withSelected((edit) => this.app.send({ type: "mirror", edit: edit.id, axis }));
  }

  hide(): void {
    this.withSelected((edit) => this.app.send({ type: "change", edit: edit.id, enabled: !edit.enabled }));
  }

  /** Continuous to move, and all discrete kinds back to continuous. */
  toggleKind(): void {
    this.withSelected((edit) => {
      if (edit.source !== null)
        return this.app.say("what is pasted stays a copy; remove it to take it away", "warning");
      const kind = edit.kind === "continuous" ? "move" : "continuous";
      this.app.send({ type: "change", edit: edit.id, kind });
    });
  }

  /** Fills what a move or a delete uncovers, or leaves it. */
  toggleFill(): void {
    this.withSelected((edit) => {
      if (!fillable(this.app.store.now))
        this.app.say("only a move or a delete uncovers something to fill", "warning");
      else
        this.app.send({
          type: "change",
          edit: edit.id,
          fill: edit.fill === "none" ? "surroundings" : "none",
        });
    });
  }

  /** Lets shadows go along with an edit, or stay. */
  toggleShadows(): void {
    this.withSelected((edit) => {
      if (!relightable(this.app.store.now))
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

  /** Turns the view's orbit around the selected cage, or around the surface at a CSS pixel where none is. */
  focus(x: number, y: number): void {
    const edit = selected(this.app.store.now);
    if (edit !== null) {
      const { corners } = leading(this.app.shownCages(edit), target(this.app.store.now));
      this.app.viewport.focus(middle(corners), 2 * extent(corners));
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

  /** Looks from where the scene is seen at first, or from one of its cameras. */
  lookFrom(step: number | null): void {
    const { hello } = this.app.store.now;
    if (hello === null) return;
    const around = hello.bounds[0].map((low, i) => 0.5 * (low + hello.bounds[1][i])) as Vec3;
    let pose = hello.start.c2w;
    if (step !== null && hello.cameras.length > 0) {
      this.camera = (this.camera + step + hello.cameras.length) % hello.cameras.length;
      pose = hello.cameras[this.camera];
      this.app.say(`camera ${this.camera + 1} of ${hello.cameras.length}`);
    }
    this.app.viewport.lookFrom(pose, hello.start.fov_y_deg, hello.up, around);
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

  /** Opens a file of splats in the place of the scene; takes another file's edits. */
  async load(file: File): Promise<void> {
    if (isSplats(file.name)) await this.open(file);
    else this.app.send({ type: "load_edits", text: await file.text(), append: false });
  }

  /** Saves; of a file that was opened, asks for a folder first. */
  save(): void {
    if (this.app.store.now.state?.is_file) this.whereTo();
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
    const why = await send(new XMLHttpRequest(), file, openAddress(location, name), progress);
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

  /** Gives up what goes on: the drag, the help, the choice of corners, the selection. */
  escape(cancelDrag: () => boolean): void {
    const { now } = this.app.store;
    if (cancelDrag()) return;
    if (now.help) this.app.store.set({ help: false });
    else if (now.corners.length > 0) this.app.store.set({ corners: [] });
    else if (now.state?.selected != null) this.command("select", null);
  }
}

function next<T>(all: T[], now: T): T {
  return all[(all.indexOf(now) + 1) % all.length];
}
