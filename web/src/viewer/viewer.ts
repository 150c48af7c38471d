/** An exported scene: its field and edits, with orbit, before/after and the camera path; no server of its own. */
import { finished, Pacing } from "../field/adaptive_resolution";
import { AnyRenderer, magicOf, readAnyEdits } from "../splats/any_renderer";
import type { AnyEdits } from "../splats/any_renderer";
import { listen } from "./touch_controls";
import { Orbit } from "./orbit";
import { viewAt } from "./camera_path";
import type { Path, View } from "./camera_path";
import { PathEdits } from "./path_edits";
import { open, whole } from "./sources";
import type { FileEntry } from "./sources";
import { SPLAT_PATH, SplatPath } from "./splat_path";
import type { Vec3 } from "./vectors";

/** What an exported file says of its scene. */
export interface SceneHeader {
  start: View;
  up: Vec3;
  centre: Vec3;
  background: Vec3 | null;
  path: Path | null;
  /** `edits`: those of the scene. `path`: how far they have gone along the camera path. */
  files: { field: FileEntry; edits?: FileEntry; path?: FileEntry };
}

/** Milliseconds after the last motion until the picture is drawn whole. */
const STILL = 120;
const MOST_PIXELS_PER_POINT = 2;

export class SceneViewer {
  readonly renderer: AnyRenderer;
  orbit: Orbit;
  private readonly gl: WebGL2RenderingContext;
  private readonly pacing = new Pacing();
  private fov: number;
  private moved = performance.now();
  /** The next row of the whole picture; null where it is shown. */
  private row: number | null = 0;
  /** Whether what is to be seen has been shown at all, if small: only then is the whole picture drawn. */
  private sketched = false;
  /** Pictures that have been shown. */
  pictures = 0;
  private playing: number | null = null;
  /** The scene's edits; undefined while they are on their way. */
  private edits: AnyEdits | null | undefined;
  /** The edits along the path, and whether it can be played. */
  private along: PathEdits | SplatPath | null = null;
  canPlay = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly header: SceneHeader,
    private readonly say: (text: string) => void,
    private readonly arrived: (share: number) => void = () => undefined,
  ) {
    const gl = canvas.getContext("webgl2", {
      alpha: false,
      antialias: false,
      depth: false,
      powerPreference: "high-performance",
    });
    if (!gl) throw new Error("This browser has no WebGL2, which the scene is drawn with.");
    this.gl = gl;
    this.renderer = new AnyRenderer(gl);
    this.renderer.background = header.background ?? [1, 1, 1];
    this.orbit = new Orbit(header.start.c2w, header.up, header.centre);
    this.fov = header.start.fov_y_deg;
    listen(canvas, {
      turn: (x, y) =>
        this.change(() =>
          this.orbit.turn((Math.PI * x) / canvas.clientHeight, (Math.PI * y) / canvas.clientHeight),
        ),
      shift: (x, y) =>
        this.change(() => this.orbit.shift(x / canvas.clientHeight, y / canvas.clientHeight, this.tangent)),
      zoom: (by) => this.change(() => this.orbit.zoom(by)),
    });
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener(
      "webglcontextrestored",
      () => void this.renderer.restore().then(() => this.touch()),
    );
    new ResizeObserver(() => this.touch()).observe(canvas);
  }

  /** Loads the scene, coarse level first, and draws it from then on. */
  async run(): Promise<void> {
    const { files } = this.header;
    void this.draw();
    const field = await open("field", files.field);
    let edits: Promise<void> | undefined;
    await this.renderer.load(field, {
      onArrival: (bytes) => this.arrived(Math.min(0.99, bytes / files.field.bytes)),
      onLevel: (number, of) => {
        this.say(number < of ? "Loading detail …" : "");
        edits ??= this.loadEdits();
        this.touch();
      },
    });
    await edits;
    if (files.path) this.along = await readPath(await whole(await open("path", files.path)));
    this.canPlay = this.header.path !== null;
    this.arrived(1);
  }

  /** Loads the scene's edits, once there is something to see. */
  private async loadEdits(): Promise<void> {
    const { files } = this.header;
    this.edits = files.edits ? await readAnyEdits(await whole(await open("edits", files.edits)), null) : null;
    this.renderer.setEdits(this.edits);
    this.touch();
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

  /** Plays the camera path from its begin, or stops where it is. */
  play(on: boolean): void {
    this.playing = on && this.canPlay ? performance.now() : null;
    this.touch();
  }

  /** Goes back to where the scene opens, with its edits whole. */
  home(): void {
    this.playing = null;
    if (this.edits !== undefined) this.renderer.setEdits(this.edits);
    this.look(this.header.start);
  }

  /** Shows a moment of the camera path. */
  seek(path: Path, seconds: number): void {
    const time = path.loop ? seconds % path.seconds : Math.min(seconds, path.seconds);
    if (this.along) this.renderer.setEdits(this.along.at(time) ?? this.edits ?? null);
    this.look(viewAt(path, time));
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
    this.sketched = false;
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
      this.seek(path, time);
      if (!path.loop && time >= path.seconds) this.playing = null;
    }
    // The full level is not shown before its edits are there.
    if (this.row === null || (renderer.level?.last && this.edits === undefined)) return;
    const dense = Math.min(devicePixelRatio, MOST_PIXELS_PER_POINT);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) =>
      Math.max(1, Math.round(n * dense)),
    );
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const scale = pacing.scale(width, height);
    const still = (this.sketched && performance.now() - this.moved > STILL) || scale === 1;
    const size = still ? [width, height] : [width, height].map((n) => Math.max(8, Math.round(n * scale)));
    this.aim(size[0], size[1]);
    const first = still ? this.row : 0;
    const count = still && renderer.inBands ? Math.min(pacing.rows(width, height), height - first) : size[1];
    const moved = this.moved;
    const sorted = performance.now() - moved > STILL;
    if (!renderer.render({ rows: { first, count }, sorted })) return;
    const whole = first + count >= size[1];
    if (whole) {
      renderer.show(width, height);
      this.pictures++;
    }
    pacing.took(size[0] * count, await finished(gl));
    if (this.moved !== moved) return;
    this.sketched = true;
    // Splats in the order of a moment ago are drawn anew.
    if (still) this.row = !whole ? first + count : renderer.inOrder ? null : 0;
  }

  private aim(width: number, height: number): void {
    const focal = (0.5 * Math.min(width, height)) / this.tangent;
    this.renderer.setSize(width, height);
    this.renderer.setCamera({
      c2w: this.orbit.c2w,
      width,
      height,
      fx: focal,
      fy: focal,
      cx: width / 2,
      cy: height / 2,
    });
  }
}

async function readPath(file: ArrayBuffer): Promise<PathEdits | SplatPath> {
  return magicOf(new Uint8Array(file)) === SPLAT_PATH
    ? await SplatPath.read(file)
    : await PathEdits.read(file);
}
