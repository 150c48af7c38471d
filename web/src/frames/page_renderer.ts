/**
 * Pictures drawn by the page's own GPU: what moves at the display's rate, and whole pictures at rest.
 *
 * The field is loaded once, after the server's first whole picture. From then on the page says with `drawing` what
 * it draws, and is sent the edits each time they are others, those of drags too, in the place of pictures. Whatever
 * it cannot draw, or draws more slowly than the server, the server draws. Of the page's address
 * `?render=server` leaves all to the server, `?render=page` trusts the page's GPU with what moves even where
 * it is software, and `?render=all` with pictures at rest too.
 */
import { Choice, memoryLimit } from "../field/render_location";
import { Pacing } from "../field/adaptive_resolution";
import { RESTS, SETTLES, Still } from "../field/progressive_still";
import { PageScene } from "./page_scene";
import { isFiner, isServed, NOTHING, ownHeader, sameView, sightOf } from "./frame_state";
import { AnyRenderer } from "../splats/any_renderer";
import type { App } from "../app/app";
import type { EditsHeader, PictureHeader } from "../net/protocol";
import type { DrawnHere, Editor } from "../app/store";

/** Milliseconds that one of the page's pictures may take at its smallest; the server's moving pictures take as long. */
const SLOWEST = 120;

/** Pictures in a row that are slower before the server draws for good. */
const PATIENCE = 5;

/** Distances that are read back of a picture, at most. */
const MOST_DISTANCES = 120_000;

export class PageRenderer {
  /** Pictures that the page has drawn. */
  drawn = 0;
  readonly scene: PageScene;
  readonly drawer: AnyRenderer;
  readonly choice = new Choice();
  private readonly wanted: "server" | "page" | "all" | "best";
  private readonly pacing = new Pacing();
  private readonly still = new Still();
  /** Why the server draws for good, or as long as the edits are these. */
  private closed: string | null = null;
  private refused: { why: string; pictured: number | undefined } | null = null;
  /** What the server was told, and of which page. */
  private told: { here: DrawnHere; page: number | null } = { here: "nothing", page: null };
  private seen = NOTHING;
  private slow = 0;
  /** Whether the last picture, or part of one, had its splats in order. */
  private inOrder = true;
  /** Milliseconds that the last picture, or part of one, took. */
  private took = 0;
  /** Edits that were taken and not acknowledged. */
  private taken: number[] = [];

  constructor(private readonly app: App) {
    const given = new URLSearchParams(location.search).get("render");
    this.wanted = given === "page" || given === "server" || given === "all" ? given : "best";
    const { viewport } = app;
    const memory = memoryLimit((navigator as { deviceMemory?: number }).deviceMemory);
    this.drawer = new AnyRenderer(viewport.renderer.getContext() as WebGL2RenderingContext, memory);
    this.drawer.onOrder = () => this.ordered();
    this.scene = new PageScene(this.drawer, {
      changed: () => this.changed(),
      arrived: (share) => this.app.store.set({ loading: share }),
      failed: (why) => this.fail(why),
    });
    if (this.wanted === "server") this.close("the page's address says so");
    else if (this.wanted === "best" && viewport.software) this.close("the page has no GPU");
    app.store.watch(["figures", "state", "hello", "connection"], (now) => this.follow(now));
    viewport.beforeFrame.push(() => this.frame());
    viewport.canvas.addEventListener("webglcontextrestored", () => void this.restore());
  }

  /** Why the server draws, or null where the page does. */
  get why(): string | null {
    return this.closed ?? this.scene.why ?? this.refused?.why ?? null;
  }

  /** Whether pictures of what moves are the page's own now. */
  get draws(): boolean {
    return this.told.here !== "nothing" && this.why === null && this.scene.edits !== null;
  }

  /** Which pictures are the page's own, as the server was told. */
  get here(): DrawnHere {
    return this.told.here;
  }

  /** Whether a picture of the server's shows what is older than what the page shows, or draws itself. */
  outdates(header: PictureHeader): boolean {
    const { edits } = this.scene;
    if (!this.draws || edits === null) return false;
    return this.told.here === "all" || !this.app.camera.resting || header.revision < edits.header.revision;
  }

  /** Takes note of how long the server took for a picture. */
  served({ width, height, full_width, render_ms, encode_ms }: PictureHeader): void {
    this.choice.served(width * height, render_ms + encode_ms, full_width < this.app.viewport.pixels.width);
  }

  /** Takes a message's edits. */
  take(header: EditsHeader, file: ArrayBuffer): void {
    if (header.why !== null) this.refuse(header.why, header.picture);
    else
      this.scene.take(header, file, (why) =>
        why === null ? this.tookEdits(header) : this.refuse(why, header.picture),
      );
  }

  private tookEdits(header: EditsHeader): void {
    this.app.viewport.renderer.resetState();
    this.taken.push(header.picture);
    this.changed();
  }

  private refuse(why: string, picture: number): void {
    this.refused = { why, pictured: this.app.store.now.state?.pictured };
    this.app.send({ type: "presented", picture });
    this.follow(this.app.store.now);
  }

  /** The server draws from now on, and a line says why. */
  private fail(why: string): void {
    this.close(why);
    this.app.say(`${why}; the server draws the pictures`, "warning");
  }

  private close(why: string): void {
    this.closed = why;
    this.drawer.dispose();
    this.changed();
    this.follow(this.app.store.now);
  }

  private changed(): void {
    const { app } = this;
    app.viewport.renderer.resetState();
    this.follow(app.store.now);
    app.viewport.invalidate();
  }

  /** Loads what is missing once the server's first whole picture is there, and tells the server who draws. */
  private follow(now: Editor): void {
    if (now.connection !== "open") this.told = { here: "nothing", page: null };
    if (now.hello === null || now.state === null || now.connection !== "open") return;
    if (this.closed === null && now.figures.final) this.scene.load(now.hello.field, now.hello.page);
    if (this.refused !== null && this.refused.pictured !== now.state.pictured) this.refused = null;
    if (this.told.page !== now.hello.page) this.told = { here: "nothing", page: now.hello.page };
    const { mode } = this;
    if (mode === this.told.here) return;
    this.told = { here: mode, page: now.hello.page };
    if (mode === "nothing") this.app.camera.restate();
    this.app.send({ type: "drawing", here: mode });
  }

  /** What the page can draw and does better. */
  private get mode(): DrawnHere {
    if (this.why !== null) return "nothing";
    if (this.drawer.level?.last !== true) return "moving";
    if (this.wanted === "all") return "all";
    const { width, height } = this.app.viewport.pixels;
    return !this.app.viewport.software && this.choice.whole(width * height) ? "all" : "moving";
  }

  /** Splats have been sorted for the camera: the view is drawn anew. */
  private ordered(): void {
    this.seen = NOTHING;
    this.app.viewport.invalidate();
  }

  private async restore(): Promise<void> {
    if (this.closed !== null) return;
    await this.drawer.restore();
    this.seen = NOTHING;
    this.changed();
  }

  private frame(): void {
    if (this.draws) this.draw();
    const { taken } = this;
    this.taken = [];
    if (taken.length > 0) this.app.presenter.acknowledge(taken);
  }

  /** Draws the view where it is other than before; at rest, the next part of the whole picture. */
  private draw(): void {
    const { app } = this;
    const seen = sightOf(app, this.drawer.level, this.scene.edits);
    const moved = seen.edits !== this.seen.edits || !sameView(seen, this.seen);
    const waits = moved && this.stays && isFiner(seen, this.seen);
    this.seen = seen;
    if (waits || isServed(app, seen.edits, this.told.here === "all")) return;
    if (moved) this.drawMoved();
    else if (this.drawsStills) this.drawStill();
    if (this.drawsStills && !this.still.whole) app.viewport.invalidate();
  }

  /** Whether whole pictures are the page's own: all are, or a drag goes on, during which the server draws none for it. */
  private get drawsStills(): boolean {
    return this.told.here === "all" || this.scene.edits?.header.final === false;
  }

  /** Draws the view as large as its time allows. */
  private drawMoved(): void {
    const { width, height } = this.app.viewport.pixels;
    const scale = this.pacing.scale(width, height);
    const size = [width, height].map((n) => Math.max(16, Math.round(scale * n)));
    const drawn = this.paint(size[0], size[1], { first: 0, count: size[1] }, false);
    this.still.moved(performance.now(), drawn && scale === 1 && this.inOrder);
    if (drawn) this.present(size[0], size[1]);
    else this.seen = NOTHING;
  }

  /** Draws the next rows of the whole picture; where all are there, says so once the camera rests. */
  private drawStill(): void {
    const { app, still } = this;
    const { width, height } = app.viewport.pixels;
    if (still.whole) {
      const last = app.presenter.last;
      if (app.camera.resting && last?.picture === 0 && last.camera !== app.camera.seq)
        app.presenter.drew(this.header(width, height), 0, 0);
      return;
    }
    const most = this.drawer.inBands ? this.pacing.rows(width, height) : height;
    const settles = this.told.here === "all" || this.drawer.inBands ? SETTLES : RESTS;
    const rows = still.next(performance.now(), height, most, settles);
    if (rows !== null && this.paint(width, height, rows, true) && still.drew(rows, height))
      this.present(width, height);
  }

  /** Whether a whole picture of the page's own stays until the server's is there. */
  private get stays(): boolean {
    return !this.drawsStills && this.still.whole && this.app.presenter.last?.picture === 0;
  }

  /** Draws rows of the view, splats `sorted` for it or as they were; false where there is nothing to draw. */
  private paint(
    width: number,
    height: number,
    rows: { first: number; count: number },
    sorted: boolean,
  ): boolean {
    const { drawer, app } = this;
    const { view, before, split } = app.store.now;
    const { viewport } = app;
    const focal = (0.5 * height) / Math.tan((viewport.camera.fov * Math.PI) / 360);
    drawer.setSize(width, height);
    drawer.setCamera({
      c2w: viewport.c2w,
      width,
      height,
      fx: focal,
      fy: focal,
      cx: 0.5 * width,
      cy: 0.5 * height,
    });
    const { compiled } = drawer;
    const began = performance.now();
    const left = before || split === null ? 0 : Math.round(split * width);
    const normals = view === "normals";
    let drew = true;
    this.inOrder = true;
    for (const [edited, first, end] of [
      [false, 0, left],
      [!before, left, width],
    ] as const) {
      if (first === end) continue;
      drawer.edited = edited;
      drew = drawer.render({ normals, sorted, rows, columns: { first, count: end - first } }) && drew;
      this.inOrder &&= drawer.inOrder;
    }
    if (drew) drawer.wait();
    viewport.renderer.resetState();
    if (!drew) return false;
    this.took = performance.now() - began;
    // What had to wait for a shader says nothing of pictures to come.
    if (drawer.compiled === compiled)
      this.measured(width * rows.count, this.took, height === viewport.pixels.height);
    return true;
  }

  /** Puts what was drawn on the screen, and says so. */
  private present(width: number, height: number): void {
    const { app, drawer } = this;
    const { view } = app.store.now;
    const distances = drawer.distances(MOST_DISTANCES);
    app.pictures.showOwn(distances, (framebuffer, across, down) =>
      drawer.show(across, down, framebuffer, view),
    );
    this.drawn += 1;
    const { edits } = this.scene;
    app.presenter.drew(this.header(width, height), edits?.received ?? 0, edits?.taken ?? 0);
  }

  private measured(pixels: number, took: number, isWhole: boolean): void {
    this.pacing.took(pixels, took);
    this.choice.drew(pixels, took);
    const { width, height } = this.app.viewport.pixels;
    this.slow = took > SLOWEST && !isWhole && pixels < 0.05 * width * height ? this.slow + 1 : 0;
    if (this.wanted !== "best") return;
    if (this.slow >= PATIENCE) this.close("the page's GPU is too slow");
    else if (this.choice.serverIsFaster) this.close(`the server is faster: ${this.choice.words}`);
  }

  private header(width: number, height: number): PictureHeader {
    const whole = this.drawsStills && this.still.whole && width === this.app.viewport.pixels.width;
    return ownHeader(this.app, this.scene.edits, [width, height], whole, this.took);
  }
}
