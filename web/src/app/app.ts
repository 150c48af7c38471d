/** The page's parts put together: what arrives is taken in, what is to be seen is drawn. */
import { Vector3 } from "three";
import { middle } from "../editing/cage";
import { CameraFeed } from "../frames/camera_feed";
import { Connection, socketAddress } from "../net/connection";
import { Drag, leading } from "../editing/drag";
import { Gizmo } from "../editing/gizmo";
import { Grid } from "../editing/grid";
import { Handles } from "../editing/handles";
import { Lines } from "../editing/lines";
import { PageRenderer } from "../frames/page_renderer";
import { Pictures } from "../frames/pictures";
import { Player } from "./player";
import { Presenter } from "../frames/frame_pacing";
import { recallCamera, recallTools } from "./session_storage";
import { cageOverlay, shownCages } from "../editing/cage_overlay";
import { Viewport } from "../frames/viewport";
import { LOOKING, Store, maySay, obstacle, selected, showsCages, target } from "./store";
import { headed } from "../frames/picture_message";
import type { Operation } from "../editing/operations";
import type {
  Answer,
  Ask,
  EditState,
  Hello,
  Job,
  PageMessage,
  Preview,
  ServerMessage,
  State,
  Vec3,
} from "../net/protocol";

/** What of the page's state shows in the canvas. */
const DRAWN = [
  "state",
  "mode",
  "tool",
  "axes",
  "cage",
  "corners",
  "hover",
  "cages",
  "grid",
  "view",
  "before",
  "split",
  "connection",
  "preview",
] as const;

export class App {
  readonly store = new Store(recallTools());
  readonly viewport: Viewport;
  readonly pictures: Pictures;
  readonly gizmo: Gizmo;
  readonly camera: CameraFeed;
  readonly player: Player;
  readonly presenter: Presenter;
  readonly page: PageRenderer;
  drag: Drag | null = null;
  private readonly lines: Lines;
  private readonly handles: Handles;
  private readonly connection: Connection;
  private readonly grid: Grid;
  private readonly questions = new Map<number, (answer: Answer | null) => void>();
  private requests = 0;
  private drags = 0;
  private placedAfter: number | null = null;
  constructor(host: HTMLElement) {
    this.viewport = new Viewport(host);
    this.pictures = new Pictures(this.viewport);
    this.lines = new Lines(this.viewport, this.pictures);
    this.handles = new Handles(this.viewport);
    this.gizmo = new Gizmo(this.viewport.scene, this.viewport.camera);
    this.camera = new CameraFeed(this.viewport, (message) => this.send(message));
    this.grid = new Grid(
      (edit) => this.ask({ what: "grid", edit }),
      () => this.viewport.invalidate(),
    );
    this.player = new Player(this);
    this.presenter = new Presenter(this);
    this.page = new PageRenderer(this);
    this.camera.drawnHere = () => this.page.draws;
    this.viewport.beforeFrame.push(() => this.arrange());
    this.viewport.beforeFrame.push(() => this.presenter.askForMore());
    this.store.listen((now, before) => {
      if (now.view !== before.view || now.before !== before.before || now.split !== before.split)
        this.sendLook();
      if (DRAWN.some((key) => now[key] !== before[key])) this.viewport.invalidate();
    });
    this.connection = new Connection(() => new WebSocket(socketAddress(location)), {
      opened: () => this.store.set({ connection: "open" }),
      lost: () => this.lost(),
      message: (message) => this.take(message),
      binary: (bytes) => this.takeBinary(bytes),
    });
  }

  /** Sends a message; false where nobody is there, or where the page may not say it. */
  send(message: PageMessage): boolean {
    if (!maySay(this.store.now, message)) {
      this.say(LOOKING, "warning");
      return false;
    }
    return this.connection.send(message);
  }

  /** The server's answer; null, and a line says why, where it has none or is not there. */
  ask(question: Omit<Ask, "type" | "request">): Promise<Answer | null> {
    const request = ++this.requests;
    return new Promise((resolve) => {
      if (this.send({ type: "ask", request, ...question })) this.questions.set(request, resolve);
      else resolve(null);
    });
  }

  say(text: string, level: "info" | "warning" | "error" = "info"): void {
    this.store.set({ notice: { type: "notice", level, text } });
  }

  /** Begins a drag of the selected edit; null, and why, where it cannot be dragged. */
  beginDrag(what = target(this.store.now)): Drag | null {
    const edit = selected(this.store.now);
    if (edit === null || this.store.now.connection !== "open") return null;
    const why = obstacle(this.store.now, edit);
    if (why !== null) {
      this.say(why, "warning");
      return null;
    }
    this.drags += 1;
    this.drag = new Drag(this.drags, edit, what, (message) => this.send(message));
    this.store.set({ limit: null });
    return this.drag;
  }

  /** Moves the drag on; `time` is when the mouse moved. */
  moveDrag(operation: Operation, time: number): void {
    if (this.drag === null) return;
    this.drag.move(operation);
    this.presenter.latency.moved(this.drag.id, this.drag.seq, time);
    this.store.set({ limit: this.drag.why });
    this.viewport.invalidate();
  }

  endDrag(): void {
    this.drag?.end();
    this.viewport.invalidate();
  }

  cancelDrag(): void {
    this.drag?.cancel();
    this.drag = null;
    this.store.set({ limit: null });
    this.viewport.invalidate();
  }

  /** After a new edit was asked for: Set mode, as soon as it is there. */
  expectEdit(): void {
    this.placedAfter = Math.max(0, ...(this.store.now.state?.edits.map((edit) => edit.id) ?? []));
  }

  /** Where the gizmo stands: on a pivot, or between the corners that were chosen. */
  get gizmoAt(): Vector3 | null {
    const { now } = this.store;
    const edit = selected(now);
    if (edit === null || now.corners.length === 0) return null;
    return new Vector3(...middle(leading(shownCages(edit, this.drag), target(now)).corners, now.corners));
  }

  /** Puts lines, handles and the gizmo where they belong now. */
  arrange(): void {
    const { now } = this.store;
    const edit = selected(now);
    const eye = this.viewport.camera.position.toArray();
    const grid = now.grid && edit !== null ? this.grid.of(edit, shownCages(edit, this.drag)) : [];
    const { segments, dots } = cageOverlay(now, this.drag, grid, eye);
    this.lines.set(segments);
    this.handles.set(dots);
    if (
      edit === null ||
      !showsCages(now) ||
      obstacle(now, edit) !== null ||
      (now.tool === "select" && now.corners.length === 0)
    ) {
      this.gizmo.hide();
      return;
    }
    const cage = leading(shownCages(edit, this.drag), target(now));
    if (this.gizmo.dragging) this.gizmo.settle(this.gizmoAt ?? new Vector3(...cage.pivot));
    else this.gizmo.show(now.tool, now.axes, cage, this.gizmoAt);
  }

  private take(message: ServerMessage): void {
    switch (message.type) {
      case "hello":
        this.greeted(message);
        break;
      case "state":
        this.takeState(message);
        break;
      case "dragged":
        if (this.drag?.answered(message)) this.viewport.invalidate();
        if (this.drag && !this.drag.ended) this.store.set({ limit: this.drag.why });
        break;
      case "answer":
        this.questions.get(message.request)?.(message.failed ? null : message);
        this.questions.delete(message.request);
        break;
      case "notice":
        this.store.set({ notice: message });
        break;
      case "preview":
        this.takePreview(message);
        break;
      case "preparing":
        this.store.set({ preparing: message });
        break;
      case "job":
        this.takeJob(message);
        break;
    }
  }

  private greeted(hello: Hello): void {
    const before = this.store.now.hello;
    const another = before !== null && before.scene !== hello.scene;
    this.store.set(another ? { hello, state: null, corners: [], hover: null, jobs: [] } : { hello });
    this.lines.slack = 1.5 * hello.voxel;
    if (before === null || another) {
      const [low, high] = hello.bounds;
      const around = low.map((x, i) => 0.5 * (x + high[i])) as Vec3;
      const recalled = another ? null : recallCamera();
      this.viewport.lookFrom(recalled ?? hello.start.c2w, hello.start.fov_y_deg, hello.up, around);
    }
    this.camera.restate();
    this.sendLook();
  }

  private takeState(state: State): void {
    this.presenter.news = performance.now();
    const placed = state.edits.find((edit) => this.placedAfter !== null && edit.id > this.placedAfter);
    if (this.drag?.ended) {
      this.drag = null;
      this.store.set({ limit: null });
    }
    const other = state.selected !== this.store.now.state?.selected;
    this.store.set({ state, ...(other ? { corners: [], hover: null } : {}) });
    if (placed) {
      this.placedAfter = null;
      this.store.set({ mode: "set", cage: "inner" });
    }
  }

  /** Shows how far a job is; a file that this page asked for is downloaded when it is there. */
  private takeJob(job: Job): void {
    this.store.set({ jobs: [...this.store.now.jobs.filter((other) => other.job !== job.job), job] });
    if (job.what !== "splats" || job.state !== "done" || job.page !== this.store.now.hello?.page) return;
    const link = document.createElement("a");
    link.href = `exports/${job.job}/${encodeURIComponent(job.out)}${location.search}`;
    link.download = job.out;
    link.click();
  }

  private takePreview(preview: Preview): void {
    const { preview: shown } = this.store.now;
    if (preview.on) this.store.set({ preview });
    else if (shown?.page === preview.page && shown.play === preview.play) this.store.set({ preview: null });
    this.player.told(preview);
  }

  private lost(): void {
    const dragging = this.drag !== null;
    this.drag = null;
    for (const resolve of this.questions.values()) resolve(null);
    this.questions.clear();
    this.grid.forget();
    this.store.set({ connection: "lost", limit: null, preview: null });
    if (dragging) this.say("the server went away in the middle of a drag, which is lost", "warning");
    this.viewport.invalidate();
  }

  private sendLook(): void {
    const { view, before, split } = this.store.now;
    this.send({ type: "display", view, before, split });
  }

  private takeBinary(bytes: ArrayBuffer): void {
    const { header, start } = headed(bytes);
    if (header.type === "edits") this.page.take(header, bytes.slice(start));
    else this.presenter.take(bytes, header, start);
  }

  /** The cages of an edit as they are shown now. */
  shown(edit: EditState): ReturnType<typeof shownCages> {
    return shownCages(edit, this.drag);
  }
}
