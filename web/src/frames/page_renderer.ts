/**
 * Rendering by the page's own GPU: moving frames at the display's rate, and complete frames of a still view.
 *
 * The field is loaded once, after the server's first complete frame. From then on the page announces with `drawing`
 * which frames it draws, and receives edits, those of drags included, in place of images. The server draws whatever the
 * page cannot draw, or draws more slowly than the server. The states are those of `render_state`.
 */
import type { PerspectiveCamera } from "three";
import type { DrawnHere, Editor, Store } from "../app/store";
import { AdaptiveResolution } from "../field/adaptive_resolution";
import { ProgressiveStill, SETTLE_MS, UNBANDED_SETTLE_MS } from "../field/progressive_still";
import type { Band } from "../field/progressive_still";
import { RenderLocation } from "../field/render_location";
import type { SceneDrawer } from "../field/scene_drawer";
import type { EditsHeader, PageMessage, PictureHeader } from "../net/protocol";
import type { SceneKind } from "../splats/drawer_selection";
import { currentFrame, hasSameView, isRefined, isServed, NO_FRAME, ownHeader } from "./frame_state";
import type { CameraState, ViewSource } from "./frame_state";
import { PageScene } from "./page_scene";
import type { Pictures } from "./pictures";
import { drawnHere, IDLE, nextState, reasonOf } from "./render_state";
import type { RenderState } from "./render_state";

/** Milliseconds that a frame of the smallest size may take; the server's moving frames take as long. */
const MAX_FRAME_MS = 120;

/** Number of consecutive slower frames after which the server draws for good. */
const MAX_SLOW_FRAMES = 5;

/** Share of the canvas below which a frame counts as one of the smallest size. */
const SMALL_FRAME_SHARE = 0.05;

/** Number of distances that are read back of a frame. */
const MAX_DISTANCES = 120_000;

const MIN_FRAME_PIXELS = 16;

/**
 * Frames that the page's address leaves to the page: `?render=server` none, `?render=page` moving ones even if its GPU
 * is software, `?render=all` complete ones too; without the parameter the faster of page and server draws.
 */
export type RenderRequest = "server" | "page" | "all" | "fastest";

export function renderRequest(search: string): RenderRequest {
  const given = new URLSearchParams(search).get("render");
  return given === "page" || given === "server" || given === "all" ? given : "fastest";
}

/** The parts of the editor that the renderer uses. */
export interface RenderHost extends ViewSource {
  readonly store: Store;
  readonly viewport: ViewSource["viewport"] & {
    readonly software: boolean;
    readonly renderer: { resetState(): void };
    readonly camera: Pick<PerspectiveCamera, "fov">;
    readonly c2w: number[];
    readonly canvas: Pick<HTMLCanvasElement, "addEventListener">;
    beforeFrame: (() => void)[];
    invalidate(): void;
  };
  readonly pictures: Pick<Pictures, "showOwn">;
  readonly camera: CameraState & { restate(): void };
  readonly frames: FrameQueue;
  send(message: PageMessage): boolean;
  say(text: string, level: "warning"): void;
}

/** The part of `FramePacer` that the renderer uses. */
export interface FrameQueue {
  /** Header of the frame shown last, the page's own (number 0) or the server's. */
  readonly last: PictureHeader | null;
  add(header: PictureHeader, received: number, decoded: number): void;
  acknowledge(numbers: number[]): void;
}

export class PageRenderer {
  /** Number of frames drawn by the page. */
  drawn = 0;
  readonly scene: PageScene;
  readonly location = new RenderLocation();
  private state: RenderState = IDLE;
  /** The frames that the server knows the page to draw, and the page's number on that server. */
  private announced: { here: DrawnHere; page: number } | null = null;
  private readonly resolution = new AdaptiveResolution();
  private readonly still = new ProgressiveStill();
  /** The state of the frame drawn last. */
  private frame = NO_FRAME;
  private slowFrames = 0;
  /** Whether the splats of the last frame or band were in depth order. */
  private sorted = true;
  /** Milliseconds of the last frame or band. */
  private renderMs = 0;
  /** Numbers of applied edits that are not acknowledged yet. */
  private applied: number[] = [];

  constructor(
    private readonly host: RenderHost,
    private readonly request: RenderRequest,
    createDrawer: (kind: SceneKind) => SceneDrawer,
  ) {
    const { viewport, store } = host;
    const create = (kind: SceneKind): SceneDrawer => {
      const drawer = createDrawer(kind);
      drawer.onOrder = () => this.redraw();
      return drawer;
    };
    this.scene = new PageScene(create, {
      changed: () => this.refresh(),
      progressed: (share) => store.set({ loading: share }),
      failed: (why) => this.fail(why),
    });
    if (request === "server") this.close("the page's address says so");
    else if (request === "fastest" && viewport.software) this.close("the page has no GPU");
    store.watch(["figures", "state", "hello", "connection"], (now) => this.follow(now));
    viewport.beforeFrame.push(() => this.drawFrame());
    viewport.canvas.addEventListener("webglcontextrestored", () => void this.restore());
  }

  /** Reason why the server draws; null where the page does. */
  get why(): string | null {
    const reason = reasonOf(this.state);
    return this.state.name === "closed" ? reason : (this.scene.obstacle ?? reason);
  }

  /** Whether moving frames are the page's own now. */
  get draws(): boolean {
    return this.here !== "nothing" && this.scene.obstacle === null && this.scene.edits !== null;
  }

  /** The frames that the page draws, as announced to the server. */
  get here(): DrawnHere {
    return drawnHere(this.state);
  }

  /** Bytes of edits uploaded to the GPU, by the last change and by all. */
  get uploaded(): SceneDrawer["uploaded"] {
    return this.scene.drawer?.uploaded ?? { last: 0, total: 0 };
  }

  /** Whether a frame of the server is older than the page's own, or one that the page draws itself. */
  supersedes(header: PictureHeader): boolean {
    const { edits } = this.scene;
    if (!this.draws || edits === null) return false;
    return this.here === "all" || !this.host.camera.resting || header.revision < edits.header.revision;
  }

  /** Records the time that the server took for a frame. */
  recordServerFrame({ width, height, full_width, render_ms, encode_ms }: PictureHeader): void {
    const moving = full_width < this.host.viewport.pixels.width;
    this.location.recordServer(width * height, render_ms + encode_ms, moving);
  }

  /** Applies the edits of a message, or takes the server's word that the page cannot draw them. */
  takeEdits(header: EditsHeader, file: ArrayBuffer): void {
    if (header.why !== null) {
      this.refuse(header.why, header.picture);
      return;
    }
    this.scene.take(header, file, (why) => {
      if (why === null) this.confirmEdits(header);
      else this.refuse(why, header.picture);
    });
  }

  private confirmEdits(header: EditsHeader): void {
    this.host.viewport.renderer.resetState();
    this.applied.push(header.picture);
    this.refresh();
  }

  private refuse(why: string, picture: number): void {
    if (this.state.name !== "closed")
      this.state = { name: "refused", why, pictured: this.host.store.now.state?.pictured };
    this.host.send({ type: "presented", picture });
    this.follow(this.host.store.now);
  }

  private fail(why: string): void {
    this.close(why);
    this.host.say(`${why}; the server draws the pictures`, "warning");
  }

  private close(why: string): void {
    this.state = { name: "closed", why };
    this.scene.dispose();
    this.refresh();
  }

  private refresh(): void {
    const { viewport, store } = this.host;
    viewport.renderer.resetState();
    this.follow(store.now);
    viewport.invalidate();
  }

  /**
   * Loads the scene once the server's first complete frame is there, and announces each change of the state.
   */
  private follow(now: Editor): void {
    const { hello, state, connection, figures } = now;
    const connected = hello !== null && state !== null && connection === "open";
    if (connected && this.state.name !== "closed" && figures.final) this.scene.load(hello.field, hello.page);
    this.state = nextState(this.state, {
      connected,
      pictured: state?.pictured,
      requested: this.scene.requested,
      drawable: this.scene.obstacle === null,
      drawsAll: this.drawsAll,
    });
    if (!connected) {
      if (connection !== "open") this.announced = null;
      return;
    }
    const { page } = hello;
    const before = this.announced?.page === page ? this.announced.here : "nothing";
    this.announced = { here: this.here, page };
    if (this.here === before) return;
    if (this.here === "nothing") this.host.camera.restate();
    this.host.send({ type: "drawing", here: this.here });
  }

  private get drawsAll(): boolean {
    if (this.scene.drawer?.level?.last !== true) return false;
    if (this.request === "all") return true;
    const { software, pixels } = this.host.viewport;
    return !software && this.location.chooseComplete(pixels.width * pixels.height);
  }

  /** Has the current view drawn anew. */
  private redraw(): void {
    this.frame = NO_FRAME;
    this.host.viewport.invalidate();
  }

  private async restore(): Promise<void> {
    if (this.state.name === "closed") return;
    await this.scene.drawer?.restore();
    this.frame = NO_FRAME;
    this.refresh();
  }

  private drawFrame(): void {
    const { drawer } = this.scene;
    if (this.draws && drawer !== null) this.update(drawer);
    const { applied } = this;
    this.applied = [];
    if (applied.length > 0) this.host.frames.acknowledge(applied);
  }

  /** Draws the view after a change; without one, the next band of the still frame. */
  private update(drawer: SceneDrawer): void {
    const { host, scene } = this;
    const frame = currentFrame(host, drawer.level, scene.edits);
    const changed = frame.edits !== this.frame.edits || !hasSameView(frame, this.frame);
    const waits = changed && this.awaitsServer && isRefined(frame, this.frame);
    this.frame = frame;
    if (waits || isServed(host.frames.last, host.camera, host.store, frame.edits, this.here === "all"))
      return;
    if (changed) this.drawMoving(drawer);
    else if (this.drawsStills) this.drawStill(drawer);
    if (this.drawsStills && !this.still.isComplete) host.viewport.invalidate();
  }

  /**
   * Whether complete frames are the page's own: always in the state `all`, and while the edits of a drag are
   * shown.
   */
  private get drawsStills(): boolean {
    return this.here === "all" || this.scene.edits?.header.final === false;
  }

  /** Draws the view at the size that the time of a frame allows. */
  private drawMoving(drawer: SceneDrawer): void {
    const { width, height } = this.host.viewport.pixels;
    const scale = this.resolution.scale(width, height);
    const [across, down] = [width, height].map((n) => Math.max(MIN_FRAME_PIXELS, Math.round(scale * n)));
    const drawn = this.render(drawer, across, down, { first: 0, count: down }, false);
    this.still.restart(performance.now(), drawn && scale === 1 && this.sorted);
    if (drawn) this.present(drawer, across, down);
    else this.frame = NO_FRAME;
  }

  /** Draws the next band of the complete frame; reports a frame that is complete once the camera rests. */
  private drawStill(drawer: SceneDrawer): void {
    const { host, still } = this;
    const { width, height } = host.viewport.pixels;
    if (still.isComplete) {
      const { last } = host.frames;
      if (host.camera.resting && last?.picture === 0 && last.camera !== host.camera.seq)
        host.frames.add(this.header(width, height), 0, 0);
      return;
    }
    const maxRows = drawer.inBands ? this.resolution.bandRows(width, height) : height;
    const settleMs = this.here === "all" || drawer.inBands ? SETTLE_MS : UNBANDED_SETTLE_MS;
    const band = still.nextBand(performance.now(), height, maxRows, settleMs);
    if (band === null || !this.render(drawer, width, height, band, true)) return;
    if (still.finishBand(band, height)) this.present(drawer, width, height);
  }

  /** Whether a complete frame of the page's own stays on the screen until the server's arrives. */
  private get awaitsServer(): boolean {
    return !this.drawsStills && this.still.isComplete && this.host.frames.last?.picture === 0;
  }

  /**
   * Draws a band of the view, with splats `sorted` for it or as they are; false where there is nothing to
   * draw.
   */
  private render(drawer: SceneDrawer, width: number, height: number, rows: Band, sorted: boolean): boolean {
    const { view, before, split } = this.host.store.now;
    const { viewport } = this.host;
    const focal = (0.5 * height) / Math.tan((viewport.camera.fov * Math.PI) / 360);
    const [cx, cy] = [0.5 * width, 0.5 * height];
    drawer.setSize(width, height);
    drawer.setCamera({ c2w: viewport.c2w, width, height, fx: focal, fy: focal, cx, cy });
    const { compiled } = drawer;
    const began = performance.now();
    const boundary = before || split === null ? 0 : Math.round(split * width);
    const parts = [
      { edited: false, first: 0, end: boundary },
      { edited: !before, first: boundary, end: width },
    ];
    const normals = view === "normals";
    let drew = true;
    this.sorted = true;
    for (const { edited, first, end } of parts) {
      if (first === end) continue;
      drawer.edited = edited;
      drew = drawer.render({ normals, sorted, rows, columns: { first, count: end - first } }) && drew;
      this.sorted &&= drawer.inOrder;
    }
    if (drew) drawer.wait();
    viewport.renderer.resetState();
    if (!drew) return false;
    this.renderMs = performance.now() - began;
    // The time of a frame that waited for a shader says nothing of later frames.
    if (drawer.compiled === compiled)
      this.recordFrame(width * rows.count, this.renderMs, height === viewport.pixels.height);
    return true;
  }

  /** Puts the drawn frame on the screen, unless its time has just left rendering to the server. */
  private present(drawer: SceneDrawer, width: number, height: number): void {
    const { host, scene } = this;
    if (this.state.name === "closed") return;
    const { view } = host.store.now;
    const distances = drawer.distances(MAX_DISTANCES);
    host.pictures.showOwn(distances, (framebuffer, across, down) =>
      drawer.show(across, down, framebuffer, view),
    );
    this.drawn += 1;
    host.frames.add(this.header(width, height), scene.edits?.received ?? 0, scene.edits?.decoded ?? 0);
  }

  /**
   * Takes note of the time of a frame or band, and leaves rendering to the server where the page is too slow.
   */
  private recordFrame(pixels: number, milliseconds: number, isFullSize: boolean): void {
    this.resolution.record(pixels, milliseconds);
    this.location.recordPage(pixels, milliseconds);
    const { width, height } = this.host.viewport.pixels;
    const isSmall = !isFullSize && pixels < SMALL_FRAME_SHARE * width * height;
    this.slowFrames = milliseconds > MAX_FRAME_MS && isSmall ? this.slowFrames + 1 : 0;
    if (this.request !== "fastest") return;
    if (this.slowFrames >= MAX_SLOW_FRAMES) this.close("the page's GPU is too slow");
    else if (this.location.serverIsFaster) this.close(`the server is faster: ${this.location.summary}`);
  }

  private header(width: number, height: number): PictureHeader {
    const { camera, store, viewport } = this.host;
    const complete = this.drawsStills && this.still.isComplete && width === viewport.pixels.width;
    return ownHeader(camera, store, this.scene.edits, [width, height], complete, this.renderMs);
  }
}
