/** The editor: its parts, connected to each other, to the server's messages and to the canvas. */
import { Vector3 } from "three";
import { cageOverlay, restCages, shownCages } from "../editing/cage_overlay";
import { carrierRotation, carryPoint, withCarriers } from "../editing/carrier";
import { Drag, targetCage } from "../editing/drag";
import { Gizmo } from "../editing/gizmo";
import { Grid } from "../editing/grid";
import { Highlight } from "../editing/highlight";
import { Handles } from "../editing/handles";
import { Lines } from "../editing/lines";
import { middleOf } from "../editing/point_cages";
import type { Operation } from "../editing/operations";
import { memoryLimit } from "../field/render_location";
import { CameraFeed } from "../frames/camera_feed";
import { FramePacer } from "../frames/frame_pacing";
import { PageRenderer, renderRequest } from "../frames/page_renderer";
import { readHeader } from "../frames/picture_message";
import { Pictures } from "../frames/pictures";
import { Viewport } from "../frames/viewport";
import { Connection, socketAddress } from "../net/connection";
import type {
  Answer,
  Ask,
  Carried,
  EditState,
  Hello,
  Job,
  PageMessage,
  Preview,
  ServerMessage,
  State,
  Vec3,
} from "../net/protocol";
import { createDrawer } from "../splats/drawer_selection";
import { isDownload } from "./downloads";
import { Player } from "./player";
import { recallCamera, recallTools } from "./session_storage";
import {
  READ_ONLY_NOTICE,
  Store,
  maySend,
  dragObstacle,
  selectedEdit,
  showsCages,
  dragTarget,
  hasPointTool,
  upOf,
} from "./store";

/** Values of the store whose change redraws the canvas. */
const CANVAS_KEYS = [
  "state",
  "mode",
  "tool",
  "axes",
  "cage",
  "corners",
  "hover",
  "selecting",
  "measured",
  "placesHotspot",
  "picked",
  "cages",
  "grid",
  "view",
  "before",
  "split",
  "connection",
  "preview",
] as const;

/** Tolerance with which lines count as hidden, in voxels. */
const LINE_SLACK_VOXELS = 1.5;

/** Longest wait of a cage's redraw for the picture of its drag, and the latency of pictures above which none waits. */
const MAX_LINES_DELAY_MS = 150;
const MAX_AWAITED_LATENCY_MS = 300;

export class App {
  readonly store = new Store(recallTools());
  readonly viewport: Viewport;
  readonly pictures: Pictures;
  readonly gizmo: Gizmo;
  readonly camera: CameraFeed;
  readonly player: Player;
  readonly frames: FramePacer;
  readonly page: PageRenderer;
  drag: Drag | null = null;
  private readonly lines: Lines;
  private readonly handles: Handles;
  readonly highlight: Highlight;
  private readonly connection: Connection;
  private readonly grid: Grid;
  /** Callbacks of the questions without an answer yet, by the number of the request. */
  private readonly questions = new Map<number, (answer: Answer | null) => void>();
  private requests = 0;
  private drags = 0;
  /** The highest id of an edit before a new edit was requested; null without such a request. */
  private lastEditId: number | null = null;

  constructor(host: HTMLElement) {
    this.viewport = new Viewport(host);
    this.pictures = new Pictures(this.viewport);
    this.lines = new Lines(this.viewport, this.pictures);
    this.handles = new Handles(this.viewport);
    this.highlight = new Highlight(this.viewport, this.pictures);
    this.gizmo = new Gizmo(this.viewport.scene, this.viewport.camera);
    const { store, viewport, pictures } = this;
    const send = (message: PageMessage): boolean => this.send(message);
    const say = (text: string, level: "warning"): void => this.say(text, level);
    const camera = (this.camera = new CameraFeed(viewport, send));
    this.grid = new Grid(
      (edit) => this.ask({ what: "grid", edit }),
      () => viewport.invalidate(),
    );
    this.player = new Player(this);
    this.frames = new FramePacer({
      store,
      viewport,
      pictures,
      camera,
      send,
      say,
      isDragging: () => this.drag !== null,
      recordServerFrame: (header) => this.page.recordServerFrame(header),
      supersedes: (header) => this.page.supersedes(header),
    });
    const gl = viewport.renderer.getContext() as WebGL2RenderingContext;
    const memory = memoryLimit((navigator as { deviceMemory?: number }).deviceMemory);
    this.page = new PageRenderer(
      { store, viewport, pictures, camera, frames: this.frames, send, say },
      renderRequest(location.search),
      (kind) => createDrawer(kind, gl, memory),
    );
    camera.drawnHere = () => this.page.draws;
    viewport.beforeFrame.push(() => this.arrange());
    viewport.beforeFrame.push(() => this.frames.requestNext());
    store.listen((now, before) => {
      if (now.view !== before.view || now.before !== before.before || now.split !== before.split)
        this.sendView();
      if (CANVAS_KEYS.some((key) => now[key] !== before[key])) viewport.invalidate();
    });
    this.connection = new Connection(() => new WebSocket(socketAddress(location)), {
      opened: () => store.set({ connection: "open" }),
      lost: () => this.handleLoss(),
      message: (message) => this.take(message),
      binary: (bytes) => this.takeBinary(bytes),
    });
  }

  /** Sends a message; false without a connection, or if the page may not send it. */
  send(message: PageMessage): boolean {
    if (!maySend(this.store.now, message)) {
      this.say(READ_ONLY_NOTICE, "warning");
      return false;
    }
    return this.connection.send(message);
  }

  /**
   * The server's answer to a question; null if the question fails (a notice says why) or the connection is
   * lost.
   */
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

  /** Begins a drag of the selected edit; null if the edit cannot be dragged, and a notice says why. */
  beginDrag(dragged = dragTarget(this.store.now)): Drag | null {
    const edit = selectedEdit(this.store.now);
    if (edit === null || this.store.now.connection !== "open") return null;
    const why = dragObstacle(this.store.now, edit);
    if (why !== null) {
      this.say(why, "warning");
      return null;
    }
    this.drags += 1;
    this.drag = new Drag(this.drags, edit, dragged, (message) => this.send(message));
    this.store.set({ limit: null });
    return this.drag;
  }

  /** Moves the drag on; `time` is the time of the mouse event. */
  moveDrag(operation: Operation, time: number): void {
    if (this.drag === null) return;
    this.drag.move(operation);
    this.frames.latency.addMove(this.drag.id, this.drag.seq, time);
    this.store.set({ limit: this.drag.why });
    this.redrawLines();
  }

  /**
   * Redraws the cage of a drag: at once, or under software rendering with the server's next picture, which a redraw
   * of its own would delay.
   */
  private redrawLines(): void {
    const { viewport, page, frames } = this;
    const waits = viewport.software && !page.draws && frames.latency.lastMove < MAX_AWAITED_LATENCY_MS;
    viewport.invalidate(waits ? MAX_LINES_DELAY_MS : 0);
  }

  endDrag(): void {
    this.drag?.end();
    this.viewport.invalidate();
  }

  cancelDrag(): void {
    this.drag?.cancel();
    this.dropDrag();
  }

  /** Forgets the drag; the pointer does nothing more until it is released. */
  private dropDrag(): void {
    this.drag = null;
    this.store.set({ limit: null });
    this.viewport.invalidate();
  }

  /** Switches to Set mode, of a cage with control points to Edit mode, as soon as the requested new edit arrives. */
  expectEdit(): void {
    this.lastEditId = Math.max(0, ...(this.store.now.state?.edits.map((edit) => edit.id) ?? []));
  }

  /**
   * Position of the gizmo between the chosen corners; null without chosen corners, where the pivot is the
   * position.
   */
  get gizmoPosition(): Vector3 | null {
    const { now } = this.store;
    const edit = selectedEdit(now);
    if (edit === null || now.corners.length === 0) return null;
    return new Vector3(...middleOf(targetCage(shownCages(edit, this.drag), dragTarget(now)), now.corners));
  }

  /** Updates lines, handles and the gizmo. */
  arrange(): void {
    const { now } = this.store;
    const edit = selectedEdit(now);
    const eye = this.viewport.camera.position.toArray();
    const lines = now.grid && edit !== null ? this.grid.linesFor(edit, restCages(edit, this.drag)) : [];
    const grid = lines.map((line) => line.map((point) => carryPoint(edit?.carrier ?? null, point)));
    const { segments, dots } = cageOverlay(now, this.drag, grid, eye, this.viewport.forward.toArray());
    this.lines.set(segments);
    this.handles.set(dots);
    const { selection } = now.state ?? { selection: null };
    this.highlight.draw(selection !== null && this.drag === null && now.preview === null && !now.before);
    const hasGizmo = now.tool !== "select" || now.corners.length > 0;
    const isMovable =
      edit !== null && dragObstacle(now, edit) === null && now.selecting === null && !hasPointTool(now);
    if (!isMovable || !showsCages(now) || !hasGizmo) {
      this.gizmo.hide();
      return;
    }
    const cage = targetCage(shownCages(edit, this.drag), dragTarget(now));
    if (this.gizmo.dragging) this.gizmo.moveTo(this.gizmoPosition ?? new Vector3(...cage.pivot));
    else this.gizmo.show(now.tool, now.axes, cage, this.gizmoPosition, carrierRotation(edit.carrier));
    this.gizmo.compile(() => this.viewport.drawUnseen());
  }

  /** The cages of an edit as they are drawn, a drag in progress included. */
  shownCages(edit: EditState): ReturnType<typeof shownCages> {
    return shownCages(edit, this.drag);
  }

  private take(message: ServerMessage): void {
    switch (message.type) {
      case "hello":
        this.takeHello(message);
        break;
      case "state":
        this.takeState(message);
        break;
      case "dragged":
        if (this.drag?.takeAnswer(message)) this.viewport.invalidate();
        if (this.drag?.id === message.drag && !this.drag.ended) this.takeCarriers(message.carried);
        if (this.drag && !this.drag.ended) this.store.set({ limit: this.drag.why });
        break;
      case "drag_over":
        if (this.drag?.id === message.drag) this.dropDrag();
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

  private takeHello(hello: Hello): void {
    const before = this.store.now.hello;
    const isOtherScene = before !== null && before.scene !== hello.scene;
    this.store.set(isOtherScene ? { hello, state: null, corners: [], hover: null, jobs: [] } : { hello });
    this.lines.slack = LINE_SLACK_VOXELS * hello.voxel;
    if (before === null || isOtherScene) {
      const [low, high] = hello.bounds;
      const center = low.map((x, i) => 0.5 * (x + high[i])) as Vec3;
      const c2w = (isOtherScene ? null : recallCamera()) ?? hello.start.c2w;
      this.viewport.lookFrom(c2w, hello.start.fov_y_deg, hello.up, center);
    }
    this.camera.restate();
    this.sendView();
  }

  private takeState(state: State): void {
    const { lastEditId } = this;
    this.frames.lastNews = performance.now();
    const isExpected = lastEditId !== null && state.edits.some((edit) => edit.id > lastEditId);
    if (this.drag?.ended) {
      this.drag = null;
      this.store.set({ limit: null });
    }
    const isOther = state.selected !== this.store.now.state?.selected;
    const before = selectedEdit(this.store.now);
    const now = state.edits.find((edit) => edit.id === state.selected);
    const hasOtherHandles = before?.points?.deformed.length !== now?.points?.deformed.length;
    this.store.set({ state, ...(isOther || hasOtherHandles ? { corners: [], hover: null } : {}) });
    this.viewport.turnUp(upOf(this.store.now));
    if (isExpected) {
      this.lastEditId = null;
      const hasPoints = selectedEdit(this.store.now)?.cage !== "box";
      this.store.set({ mode: hasPoints ? "edit" : "set", cage: "inner" });
    }
  }

  /** Moves the edits that the dragged one carries. */
  private takeCarriers(carried: Carried[]): void {
    const { state } = this.store.now;
    if (state === null || carried.length === 0) return;
    this.store.set({ state: withCarriers(state, carried) });
    this.viewport.invalidate();
  }

  /** Shows the progress of a job, and downloads the finished file of a job that this page started. */
  private takeJob(job: Job): void {
    this.store.set({ jobs: [...this.store.now.jobs.filter((other) => other.job !== job.job), job] });
    if (!isDownload(job) || job.state !== "done" || job.page !== this.store.now.hello?.page) return;
    const link = document.createElement("a");
    link.href = `exports/${job.job}/${encodeURIComponent(job.out)}${location.search}`;
    link.download = job.out;
    link.click();
  }

  private takePreview(preview: Preview): void {
    const { preview: shown } = this.store.now;
    if (preview.on) this.store.set({ preview });
    else if (shown?.page === preview.page && shown.play === preview.play) this.store.set({ preview: null });
    this.player.takePreview(preview);
  }

  private takeBinary(message: ArrayBuffer): void {
    const { header, start } = readHeader(message);
    if (header.type === "highlight") this.highlight.take(header, message.slice(start));
    else if (header.type === "edits") this.page.takeEdits(header, message.slice(start));
    else this.frames.take(message, header, start);
  }

  private handleLoss(): void {
    const wasDragging = this.drag !== null;
    this.drag = null;
    for (const resolve of this.questions.values()) resolve(null);
    this.questions.clear();
    this.grid.clear();
    this.store.set({ connection: "lost", limit: null, preview: null });
    if (wasDragging) this.say("the connection was lost during a drag; the drag is undone", "warning");
    this.viewport.invalidate();
  }

  private sendView(): void {
    const { view, before, split } = this.store.now;
    this.send({ type: "display", view, before, split });
  }
}
