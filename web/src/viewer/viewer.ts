/** Viewer of an exported scene: field and edits, with orbit, before/after and the camera path, without a server. */
import { AdaptiveResolution, waitForGpu } from "../field/adaptive_resolution";
import type { SceneDrawer } from "../field/scene_drawer";
import { createDrawer, identifyScene, readMagic } from "../splats/drawer_selection";
import { listen } from "./touch_controls";
import { Orbit } from "./orbit";
import { viewAt } from "./camera_path";
import type { Path, View } from "./camera_path";
import { PathEdits } from "./path_edits";
import { open, whole } from "./sources";
import type { FileEntry } from "./sources";
import { SPLAT_PATH, SplatPath } from "./splat_path";
import type { Vec3 } from "./vectors";

/** Description of a scene in an exported page. */
export interface SceneHeader {
  start: View;
  up: Vec3;
  centre: Vec3;
  background: Vec3 | null;
  path: Path | null;
  /** `edits`: the edits of the scene; `path`: the edits at moments of the camera path. */
  files: { field: FileEntry; edits?: FileEntry; path?: FileEntry };
}

/** Milliseconds after the last motion until a complete frame is drawn. */
const SETTLE_MS = 120;
const MAX_PIXELS_PER_POINT = 2;
const MIN_FRAME_PIXELS = 8;

export class SceneViewer {
  /** The renderer of the scene's kind; null until the first bytes of the field file have arrived. */
  renderer: SceneDrawer | null = null;
  orbit: Orbit;
  private readonly gl: WebGL2RenderingContext;
  private readonly resolution = new AdaptiveResolution();
  private fov: number;
  private moved = performance.now();
  /** The next row of the complete frame; null once the complete frame is shown. */
  private row: number | null = 0;
  /** Whether the current view has been shown at least at a low resolution; the complete frame comes after that. */
  private sketched = false;
  /** Number of frames shown. */
  pictures = 0;
  private playing: number | null = null;
  /** The scene's edits; undefined until they are loaded. */
  private edits: unknown;
  private showsEdits = true;
  /** The edits at moments of the camera path. */
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
      () => void this.renderer?.restore().then(() => this.touch()),
    );
    new ResizeObserver(() => this.touch()).observe(canvas);
  }

  /** Loads the scene, coarse level first, and draws it from then on. */
  async run(): Promise<void> {
    const { files } = this.header;
    void this.draw();
    const { kind, source } = await identifyScene(await open("field", files.field));
    const renderer = (this.renderer = createDrawer(kind, this.gl));
    renderer.background = this.header.background ?? [1, 1, 1];
    renderer.edited = this.showsEdits;
    let edits: Promise<void> | undefined;
    await renderer.load(source, {
      onArrival: (bytes) => this.arrived(Math.min(0.99, bytes / files.field.bytes)),
      onLevel: (number, count) => {
        this.say(number < count ? "Loading detail …" : "");
        edits ??= this.loadEdits(renderer);
        this.touch();
      },
    });
    await edits;
    if (files.path) this.along = await readPath(await whole(await open("path", files.path)));
    this.canPlay = this.header.path !== null;
    this.arrived(1);
  }

  /** Loads the scene's edits, after the first level of the field. */
  private async loadEdits(renderer: SceneDrawer): Promise<void> {
    const { files } = this.header;
    this.edits = files.edits
      ? await renderer.readEdits(await whole(await open("edits", files.edits)), null)
      : null;
    renderer.setEdits(this.edits);
    this.touch();
  }

  /** Whether the complete frame of the current view is shown. */
  get whole(): boolean {
    return this.row === null;
  }

  get edited(): boolean {
    return this.showsEdits;
  }

  set edited(on: boolean) {
    this.showsEdits = on;
    if (this.renderer) this.renderer.edited = on;
    this.touch();
  }

  get plays(): boolean {
    return this.playing !== null;
  }

  /** Plays the camera path from its start, or stops the playback. */
  play(on: boolean): void {
    this.playing = on && this.canPlay ? performance.now() : null;
    this.touch();
  }

  /** Returns to the first view of the scene, with the complete edits. */
  home(): void {
    this.playing = null;
    if (this.edits !== undefined) this.renderer?.setEdits(this.edits);
    this.look(this.header.start);
  }

  /** Shows a moment of the camera path. */
  seek(path: Path, seconds: number): void {
    const time = path.loop ? seconds % path.seconds : Math.min(seconds, path.seconds);
    if (this.along) this.renderer?.setEdits(this.along.at(time) ?? this.edits ?? null);
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
    const { canvas, gl, renderer, resolution } = this;
    const { path } = this.header;
    if (this.playing !== null && path) {
      const time = (performance.now() - this.playing) / 1000;
      this.seek(path, time);
      if (!path.loop && time >= path.seconds) this.playing = null;
    }
    // The full level is not shown before its edits are loaded.
    if (renderer === null || this.row === null || (renderer.level?.last && this.edits === undefined)) return;
    const dense = Math.min(devicePixelRatio, MAX_PIXELS_PER_POINT);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) =>
      Math.max(1, Math.round(n * dense)),
    );
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const scale = resolution.scale(width, height);
    const still = (this.sketched && performance.now() - this.moved > SETTLE_MS) || scale === 1;
    const size = still
      ? [width, height]
      : [width, height].map((n) => Math.max(MIN_FRAME_PIXELS, Math.round(n * scale)));
    this.aim(renderer, size[0], size[1]);
    const first = still ? this.row : 0;
    const count =
      still && renderer.inBands ? Math.min(resolution.bandRows(width, height), height - first) : size[1];
    const moved = this.moved;
    const sorted = performance.now() - moved > SETTLE_MS;
    if (!renderer.render({ rows: { first, count }, sorted })) return;
    const whole = first + count >= size[1];
    if (whole) {
      renderer.show(width, height);
      this.pictures++;
    }
    resolution.record(size[0] * count, await waitForGpu(gl));
    if (this.moved !== moved) return;
    this.sketched = true;
    // Splats in the depth order of an earlier camera are drawn anew.
    if (still) this.row = !whole ? first + count : renderer.inOrder ? null : 0;
  }

  private aim(renderer: SceneDrawer, width: number, height: number): void {
    const focal = (0.5 * Math.min(width, height)) / this.tangent;
    const [cx, cy] = [width / 2, height / 2];
    renderer.setSize(width, height);
    renderer.setCamera({ c2w: this.orbit.c2w, width, height, fx: focal, fy: focal, cx, cy });
  }
}

async function readPath(file: ArrayBuffer): Promise<PathEdits | SplatPath> {
  return readMagic(new Uint8Array(file)) === SPLAT_PATH
    ? await SplatPath.read(file)
    : await PathEdits.read(file);
}
