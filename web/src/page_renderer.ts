/**
 * Pictures drawn by the page's own GPU while the view is turned, so that they come at the display's rate.
 *
 * The field is loaded once, after the server's first whole picture; the edits each time they are others. Whatever
 * the page cannot draw, or draws more slowly than the server, the server draws: drags, normals and depth, NeRFs,
 * discs of 2DGS, pictures at rest. `?render=server` leaves it all to the server, `?render=page` trusts the page's GPU even
 * where it is software.
 */
import { Pacing } from "./field/pacing";
import { AnyRenderer, readAnyEdits } from "./splats/any_renderer";
import type { App } from "./app";
import type { Editor } from "./store";

/** Milliseconds that one of the page's pictures may take at its smallest; the server's moving pictures take as long. */
const SLOWEST = 120;

/** Pictures in a row that are slower before the server draws for good. */
const PATIENCE = 5;

const EVERY = 300;

export class PageRenderer {
  /** Why the server draws, or null where the page does. */
  why: string | null = "the field is not loaded yet";
  /** Pictures that the page has drawn. */
  drawn = 0;
  private readonly wanted: "page" | "server" | "best";
  private readonly renderer: AnyRenderer;
  private readonly pacing = new Pacing();
  private loading: Promise<void> | null = null;
  private isLoaded = false;
  /** The scene whose field is loaded, or being loaded. */
  private scene: string | null = null;
  /** The revision whose edits the renderer has, and the one that was last asked for. */
  private edits = -1;
  private asked = -1;
  private slow = 0;
  private times: number[] = [];
  private figured = -Infinity;
  private isClosed = false;

  constructor(private readonly app: App) {
    const given = new URLSearchParams(location.search).get("render");
    this.wanted = given === "page" || given === "server" ? given : "best";
    const { viewport } = app;
    this.renderer = new AnyRenderer(viewport.renderer.getContext() as WebGL2RenderingContext);
    this.renderer.onOrder = () => viewport.invalidate();
    if (this.wanted === "server") this.close("the page's address says so");
    else if (this.wanted === "best" && viewport.software) this.close("the page has no GPU");
    app.store.watch(["figures", "state", "hello"], (now) => this.follow(now));
    viewport.beforeFrame.push(() => this.draw());
    viewport.canvas.addEventListener("webglcontextrestored", () => void this.restore());
  }

  /** Whether pictures of the moving view are the page's own now. */
  get draws(): boolean {
    const { now } = this.app.store;
    return (
      this.why === null &&
      this.app.drag === null &&
      now.preview === null &&
      now.view === "colour" &&
      now.split === null &&
      (now.before || this.edits === now.state?.pictured)
    );
  }

  private close(why: string): void {
    this.why = why;
    this.isClosed = true;
    this.renderer.dispose();
    this.app.viewport.renderer.resetState();
  }

  /** Loads what is missing, once the server's first whole picture is there. */
  private follow(now: Editor): void {
    if (this.isClosed || now.state === null || now.hello === null) return;
    if (this.scene !== now.hello.scene) this.forget(now.hello.scene);
    if (now.figures.final) this.loading ??= this.load(now.hello.scene);
    const { pictured } = now.state;
    if (this.isLoaded && this.app.drag === null && this.asked !== pictured) void this.loadEdits(pictured);
  }

  /** Lets go of a field that is no longer the editor's. */
  private forget(scene: string): void {
    this.scene = scene;
    this.loading = null;
    this.isLoaded = false;
    this.edits = this.asked = -1;
    this.why = "the field is not loaded yet";
    this.renderer.setEdits(null);
    this.app.viewport.renderer.resetState();
  }

  private async load(scene: string): Promise<void> {
    try {
      const answer = await fetch(`field${location.search}`);
      if (scene !== this.scene) return;
      if (!answer.ok || answer.body === null) {
        this.why = await answer.text();
        return;
      }
      await this.renderer.load(answer.body);
      this.app.viewport.renderer.resetState();
      if (scene !== this.scene) return;
      this.renderer.background = this.renderer.fileBackground ?? [0, 0, 0];
      this.isLoaded = true;
      this.why = null;
      this.follow(this.app.store.now);
    } catch (error) {
      this.close(error instanceof Error ? error.message : String(error));
    }
  }

  private async loadEdits(revision: number): Promise<void> {
    this.asked = revision;
    try {
      const answer = await fetch(`edits${location.search}`);
      if (!answer.ok) return;
      const answered = Number(answer.headers.get("X-Revision"));
      const bytes = await answer.arrayBuffer();
      const { state } = this.app.store.now;
      if (this.asked !== revision || state?.pictured !== revision) return;
      if (answered !== state.revision) {
        // Of another revision than the page's: the next state asks again.
        this.asked = -1;
        return;
      }
      this.renderer.setEdits(await readAnyEdits(bytes));
      this.app.viewport.renderer.resetState();
      this.edits = revision;
    } catch {
      // Without edits that fit, the server draws.
      this.asked = -1;
    }
  }

  private async restore(): Promise<void> {
    if (this.isClosed) return;
    await this.renderer.restore();
    this.app.viewport.renderer.resetState();
    this.app.viewport.invalidate();
  }

  /** Draws the view as it is, where it moves. */
  private draw(): void {
    const { app, renderer } = this;
    if (!this.draws || app.camera.resting) return;
    const { viewport } = app;
    const { width, height } = viewport.pixels;
    const scale = this.pacing.scale(width, height);
    const [w, h] = [Math.max(16, Math.round(scale * width)), Math.max(16, Math.round(scale * height))];
    const began = performance.now();
    const focal = (0.5 * h) / Math.tan((viewport.camera.fov * Math.PI) / 360);
    renderer.setSize(w, h);
    renderer.edited = !app.store.now.before;
    renderer.setCamera({ c2w: viewport.c2w, width: w, height: h, fx: focal, fy: focal, cx: 0.5 * w, cy: 0.5 * h });
    if (!renderer.render()) return;
    const depth = renderer.readDepth();
    const took = performance.now() - began;
    app.pictures.showOwn(w, h, depth, (framebuffer, across, down) => renderer.show(across, down, framebuffer));
    this.pacing.took(w * h, took);
    this.drawn += 1;
    this.figures(w, h, took);
    this.slow = took > SLOWEST && w * h < 0.05 * width * height ? this.slow + 1 : 0;
    if (this.slow >= PATIENCE && this.wanted === "best") this.close("the page's GPU is slower than the server");
  }

  private figures(width: number, height: number, took: number): void {
    const now = performance.now();
    this.times = [...this.times.filter((time) => now - time < 2000), now];
    if (now - this.figured < EVERY) return;
    this.figured = now;
    const perSecond = 0.5 * this.times.length;
    this.app.store.set({ figures: { perSecond, renderMs: took, encodeMs: 0, width, height, final: false, page: true } });
  }
}
