/** An exported scene: its field and edits, with orbit, before/after and the camera path; no server, no network. */
import { FieldRenderer } from "../field/field_renderer";
import { finished, Pacing } from "../field/pacing";
import { readEdits } from "../field/page_edits";
import { listen } from "./fingers";
import { Orbit } from "./orbit";
import { viewAt } from "./path";
import type { Path, View } from "./path";
import type { Vec3 } from "./vectors";

/** What an exported file says of its scene. */
export interface SceneHeader {
  start: View;
  up: Vec3;
  centre: Vec3;
  background: Vec3 | null;
  path: Path | null;
}

/** Milliseconds after the last motion until the picture is drawn whole. */
const STILL = 120;
const MOST_PIXELS_PER_POINT = 2;

export class SceneViewer {
  readonly renderer: FieldRenderer;
  orbit: Orbit;
  private readonly gl: WebGL2RenderingContext;
  private readonly pacing = new Pacing();
  private fov: number;
  private moved = performance.now();
  /** The next row of the whole picture; null where it is shown. */
  private row: number | null = 0;
  private playing: number | null = null;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly header: SceneHeader,
    private readonly say: (text: string) => void,
  ) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("This browser has no WebGL2, which the scene is drawn with.");
    this.gl = gl;
    this.renderer = new FieldRenderer(gl);
    this.renderer.background = header.background ?? [1, 1, 1];
    this.orbit = new Orbit(header.start.c2w, header.up, header.centre);
    this.fov = header.start.fov_y_deg;
    listen(canvas, {
      turn: (x, y) => this.change(() => this.orbit.turn((Math.PI * x) / canvas.clientHeight, (Math.PI * y) / canvas.clientHeight)),
      shift: (x, y) => this.change(() => this.orbit.shift(x / canvas.clientHeight, y / canvas.clientHeight, this.tangent)),
      zoom: (by) => this.change(() => this.orbit.zoom(by)),
    });
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => void this.renderer.restore().then(() => this.touch()));
    new ResizeObserver(() => this.touch()).observe(canvas);
  }

  /** Loads the scene, and draws it from then on. */
  async run(field: ArrayBuffer, edits: ArrayBuffer | null): Promise<void> {
    if (edits) this.renderer.setEdits(await readEdits(edits));
    void this.draw();
    await this.renderer.load(field, {
      onLevel: (number, of) => {
        this.say(number < of ? "Loading detail …" : "");
        this.touch();
      },
    });
  }

  /** Whether the whole picture of what is to be seen is shown. */
  get whole(): boolean {
    return this.row === null;
  }

  get edited(): boolean {
    return this.renderer.edited;
  }

  set edited(on: boolean) {
    this.renderer.edited = on;
    this.touch();
  }

  get plays(): boolean {
    return this.playing !== null;
  }

  /** Plays the camera path from its begin, or stops. */
  play(on: boolean): void {
    this.playing = on && this.header.path ? performance.now() : null;
    this.touch();
  }

  /** Goes back to where the scene opens. */
  home(): void {
    this.look(this.header.start);
    this.playing = null;
  }

  private get tangent(): number {
    return Math.tan((this.fov * Math.PI) / 360);
  }

  private look(view: View): void {
    this.orbit = new Orbit(view.c2w, this.header.up, this.header.centre);
    this.fov = view.fov_y_deg;
    this.touch();
  }

  private change(action: () => void): void {
    this.playing = null;
    action();
    this.touch();
  }

  private touch(): void {
    this.moved = performance.now();
    this.row = 0;
  }

  private async draw(): Promise<void> {
    for (;;) {
      await new Promise((done) => requestAnimationFrame(done));
      try {
        await this.frame();
      } catch (error) {
        this.say(error instanceof Error ? error.message : String(error));
        return;
      }
    }
  }

  private async frame(): Promise<void> {
    const { canvas, gl, renderer, pacing } = this;
    const { path } = this.header;
    if (this.playing !== null && path) {
      const time = (performance.now() - this.playing) / 1000;
      this.look(viewAt(path, time));
      if (!path.loop && time >= path.seconds) this.playing = null;
    }
    if (this.row === null) return;
    const dense = Math.min(devicePixelRatio, MOST_PIXELS_PER_POINT);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, Math.round(n * dense)));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const scale = pacing.scale(width, height);
    const still = performance.now() - this.moved > STILL || scale === 1;
    const size = still ? [width, height] : [width, height].map((n) => Math.max(8, Math.round(n * scale)));
    this.aim(size[0], size[1]);
    const first = still ? this.row : 0;
    const count = still ? Math.min(pacing.rows(width, height), height - first) : size[1];
    const moved = this.moved;
    if (!renderer.render({ rows: { first, count } })) return;
    const whole = first + count >= size[1];
    if (whole) renderer.show(width, height);
    pacing.took(size[0] * count, await finished(gl));
    if (this.moved !== moved) return;
    if (still) this.row = whole ? null : first + count;
  }

  private aim(width: number, height: number): void {
    const focal = (0.5 * Math.min(width, height)) / this.tangent;
    this.renderer.setSize(width, height);
    this.renderer.setCamera({ c2w: this.orbit.c2w, width, height, fx: focal, fy: focal, cx: width / 2, cy: height / 2 });
  }
}
