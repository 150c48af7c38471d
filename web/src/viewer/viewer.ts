/**
 * Viewer of an exported scene: its field and edits, with orbit, before/after and the camera path; it needs no
 * server.
 */
import { AdaptiveResolution, waitForGpu } from "../field/adaptive_resolution";
import type { SceneDrawer } from "../field/scene_drawer";
import type { Distances } from "../field/views";
import { createDrawer, identifyScene, readMagic } from "../splats/drawer_selection";
import { placeAt, viewAt } from "./camera_path";
import type { Path, View } from "./camera_path";
import { poseBetween } from "./flight";
import type { Pose } from "./flight";
import type { Hotspot } from "./hotspots";
import { Orbit } from "./orbit";
import { PathEdits } from "./path_edits";
import { openBeside, openFile, readAll } from "./sources";
import type { FileEntry } from "./sources";
import { SPLAT_PATH_MAGIC, SplatPath } from "./splat_path";
import { listenForMoves } from "./touch_controls";
import type { Vec3 } from "./vectors";

/** Description of the scene in an exported page; `pages.scene_page` writes it. */
export interface SceneHeader {
  start: View;
  up: Vec3;
  center: Vec3;
  background: Vec3 | null;
  path: Path | null;
  /** Points with text; absent without any. */
  hotspots?: Hotspot[];
  /** Scale of the scene; absent where it is unknown. */
  meters_per_unit?: number;
  /** Diagonal of the scene's box, world units. */
  extent: number;
  /** `edits`: those of the scene. `path`: the edits along the camera path. */
  files: { field: FileEntry; edits?: FileEntry; path?: FileEntry };
}

/** Milliseconds after the last motion until the complete frame is drawn. */
const SETTLE_MS = 120;
const MAX_DEVICE_PIXEL_RATIO = 2;
const MIN_FRAME_PIXELS = 8;

/** Number of distances that are read back from an image with hotspots. */
const DISTANCES = 10_000;
const FLIGHT_MS = 2500;

export class SceneViewer {
  /** The renderer of the scene's kind; null before the first bytes of the scene. */
  renderer: SceneDrawer | null = null;
  orbit: Orbit;
  private readonly gl: WebGL2RenderingContext;
  private readonly resolution = new AdaptiveResolution();
  private fov: number;
  private changedAt = performance.now();
  /** The next row of the complete frame; null once the frame is shown. */
  private nextRow: number | null = 0;
  /** Whether a moving frame of the current view has been shown: the complete frame is drawn only then. */
  private previewed = false;
  /** Number of calls of `refresh`. */
  private refreshes = 0;
  /** Number of frames shown. */
  pictures = 0;
  private playStart: number | null = null;
  /** Seconds of the camera path whose edits are shown; null for the whole edits. */
  private editTime: number | null = null;
  private flight: { from: Pose; to: Pose; begun: number; view: View; around: Vec3 } | null = null;
  /** Distances of the last image, read where there are hotspots; null before it. */
  distances: Distances | null = null;
  /** Called before each of the browser's frames in which the view or the image may be another one. */
  onFrame: (() => void) | null = null;
  /** The scene's edits; undefined while they are being loaded. */
  private edits: unknown = undefined;
  private showsEdits = true;
  /** The edits along the camera path; null without them. */
  private pathEdits: PathEdits | SplatPath | null = null;
  canPlay = false;

  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly header: SceneHeader,
    private readonly say: (text: string) => void,
    private readonly progressed: (share: number) => void = () => undefined,
  ) {
    const gl = canvas.getContext("webgl2", {
      alpha: false,
      antialias: false,
      depth: false,
      powerPreference: "high-performance",
    });
    if (!gl) throw new Error("This browser has no WebGL2, which the scene needs.");
    this.gl = gl;
    this.orbit = new Orbit(header.start.c2w, header.up, header.center);
    this.fov = header.start.fov_y_deg;
    listenForMoves(canvas, {
      turn: (x, y) =>
        this.change(() =>
          this.orbit.turn((Math.PI * x) / canvas.clientHeight, (Math.PI * y) / canvas.clientHeight),
        ),
      shift: (x, y) =>
        this.change(() =>
          this.orbit.shift(x / canvas.clientHeight, y / canvas.clientHeight, this.halfTangent),
        ),
      zoom: (factor) => this.change(() => this.orbit.zoom(factor)),
    });
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      void this.renderer?.restore().then(() => this.invalidate());
    });
    new ResizeObserver(() => this.invalidate()).observe(canvas);
  }

  /** Loads the scene, coarse level first, and draws each level as it arrives. */
  async run(): Promise<void> {
    const { files, background } = this.header;
    void this.drawFrames();
    const { kind, source } = await identifyScene(await openFile("field", files.field));
    const renderer = (this.renderer = createDrawer(kind, this.gl));
    renderer.background = background ?? [1, 1, 1];
    renderer.edited = this.showsEdits;
    let edits: Promise<void> | undefined;
    await renderer.load(source, {
      openBeside,
      onDetails: () => this.refresh(),
      onCoarse: (nodes, of) => this.say(`There is no room for the details of ${nodes} of ${of} parts.`),
      onFailure: (reason) => this.say(reason),
      onArrival: (bytes) => this.progressed(Math.min(0.99, bytes / files.field.bytes)),
      onLevel: (number, count) => {
        this.say(number < count ? "Loading detail …" : "");
        edits ??= this.loadEdits(renderer);
        this.invalidate();
      },
    });
    await edits;
    if (files.path) this.pathEdits = await readPath(await readAll(await openFile("path", files.path)));
    this.canPlay = this.header.path !== null;
    this.progressed(1);
  }

  /** Loads the scene's edits, after the first level. */
  private async loadEdits(renderer: SceneDrawer): Promise<void> {
    const { files } = this.header;
    const file = files.edits && (await readAll(await openFile("edits", files.edits)));
    this.edits = file ? await renderer.readEdits(file, null) : null;
    renderer.setEdits(this.edits);
    this.invalidate();
  }

  /** Whether the complete frame of the current view is shown. */
  get whole(): boolean {
    return this.nextRow === null;
  }

  get edited(): boolean {
    return this.showsEdits;
  }

  set edited(on: boolean) {
    this.showsEdits = on;
    if (this.renderer !== null) this.renderer.edited = on;
    this.invalidate();
  }

  get plays(): boolean {
    return this.playStart !== null;
  }

  /** Diagonal of the scene's box, world units. */
  get extent(): number {
    return this.header.extent;
  }

  /** Focal length in CSS pixels. */
  get focal(): number {
    return (0.5 * Math.min(this.canvas.clientWidth, this.canvas.clientHeight)) / this.halfTangent;
  }

  /** Whether the view flies to a hotspot. */
  get flies(): boolean {
    return this.flight !== null;
  }

  /** Flies to a view; then the orbit's center is the point of its axis closest to `around`. */
  flyTo(view: View, around: Vec3): void {
    this.playStart = null;
    this.showWholeEdits();
    const end = new Orbit(view.c2w, this.header.up, around);
    const { eye, target } = this.orbit;
    this.flight = {
      from: { eye, target, fov_y_deg: this.fov },
      to: { eye: end.eye, target: end.target, fov_y_deg: view.fov_y_deg },
      begun: matchMedia("(prefers-reduced-motion: reduce)").matches ? -Infinity : performance.now(),
      view,
      around,
    };
    this.invalidate();
  }

  /** Plays the camera path from its start, or stops. */
  play(on: boolean): void {
    this.playStart = on && this.canPlay ? performance.now() : null;
    this.flight = null;
    this.invalidate();
  }

  /** Shows the view in which the scene opens, with its complete edits. */
  home(): void {
    this.playStart = this.flight = null;
    this.showWholeEdits();
    this.look(this.header.start);
  }

  /** Shows a moment of the camera path. */
  seek(path: Path, seconds: number): void {
    const time = path.loop ? seconds % path.seconds : Math.min(seconds, path.seconds);
    if (this.pathEdits) this.renderer?.setEdits(this.pathEdits.at(time) ?? this.edits ?? null);
    this.editTime = time;
    this.look(viewAt(path, time));
  }

  /** Where the shown edits carry a hotspot. */
  place({ position, along }: Hotspot): Vec3 | null {
    const { path } = this.header;
    if (this.editTime === null || !path || along === undefined) return position;
    return placeAt(along, path, this.editTime);
  }

  private showWholeEdits(): void {
    this.editTime = null;
    if (this.edits !== undefined) this.renderer?.setEdits(this.edits);
  }

  private get halfTangent(): number {
    return Math.tan((this.fov * Math.PI) / 360);
  }

  private look(view: View, around = this.header.center): void {
    this.orbit = new Orbit(view.c2w, this.header.up, around);
    this.fov = view.fov_y_deg;
    this.invalidate();
  }

  private change(action: () => void): void {
    this.playStart = this.flight = null;
    action();
    this.invalidate();
  }

  private invalidate(): void {
    this.changedAt = performance.now();
    this.nextRow = 0;
    this.previewed = false;
  }

  /** Draws the complete frame once more; the one before stays until then. */
  private refresh(): void {
    this.refreshes++;
    this.nextRow = 0;
  }

  private async drawFrames(): Promise<void> {
    for (;;) {
      await new Promise((done) => requestAnimationFrame(done));
      try {
        this.advance();
        this.onFrame?.();
        if (this.renderer !== null) await this.draw(this.renderer);
      } catch (error) {
        this.say(error instanceof Error ? error.message : String(error));
        return;
      }
    }
  }

  /** Moves on along the camera path while it plays. */
  private advance(): void {
    if (this.flight !== null) this.advanceFlight(this.flight);
    const { path } = this.header;
    if (this.playStart === null || !path) return;
    const time = (performance.now() - this.playStart) / 1000;
    this.seek(path, time);
    if (!path.loop && time >= path.seconds) this.playStart = null;
  }

  private advanceFlight({ from, to, begun, view, around }: NonNullable<SceneViewer["flight"]>): void {
    const share = (performance.now() - begun) / FLIGHT_MS;
    if (share >= 1) {
      this.flight = null;
      this.look(view, around);
      return;
    }
    const { eye, target, fov_y_deg } = poseBetween(from, to, share, this.header.up);
    this.orbit.eye = eye;
    this.orbit.target = target;
    this.fov = fov_y_deg;
    this.invalidate();
  }

  /** Draws a moving frame after a change, and bands of the complete frame once the view is still. */
  private async draw(renderer: SceneDrawer): Promise<void> {
    const { canvas, gl, resolution } = this;
    // The finest level is not shown before its edits are loaded.
    if (this.nextRow === null || (renderer.level?.last && this.edits === undefined)) return;
    const ratio = Math.min(devicePixelRatio, MAX_DEVICE_PIXEL_RATIO);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) =>
      Math.max(1, Math.round(n * ratio)),
    );
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const scale = resolution.scale(width, height);
    const isStill = (this.previewed && performance.now() - this.changedAt > SETTLE_MS) || scale === 1;
    const [across, down] = isStill
      ? [width, height]
      : [width, height].map((n) => Math.max(MIN_FRAME_PIXELS, Math.round(n * scale)));
    this.setCamera(renderer, across, down);
    const first = isStill ? this.nextRow : 0;
    const isBand = isStill && renderer.inBands;
    const count = isBand ? Math.min(resolution.bandRows(width, height), height - first) : down;
    const { changedAt, refreshes } = this;
    const sorted = performance.now() - changedAt > SETTLE_MS;
    if (!renderer.render({ rows: { first, count }, sorted })) return;
    const isComplete = first + count >= down;
    if (isComplete) {
      renderer.show(width, height);
      if (this.header.hotspots) this.distances = renderer.distances(DISTANCES);
      this.pictures++;
    }
    resolution.record(across * count, await waitForGpu(gl));
    if (this.changedAt !== changedAt) return;
    this.previewed = true;
    if (this.refreshes !== refreshes) return void (this.nextRow = 0);
    // Splats that were in an older depth order are drawn again.
    if (isStill) this.nextRow = !isComplete ? first + count : renderer.inOrder ? null : 0;
  }

  private setCamera(renderer: SceneDrawer, width: number, height: number): void {
    const focal = (0.5 * Math.min(width, height)) / this.halfTangent;
    const { c2w } = this.orbit;
    renderer.setSize(width, height);
    renderer.setCamera({ c2w, width, height, fx: focal, fy: focal, cx: width / 2, cy: height / 2 });
  }
}

async function readPath(file: ArrayBuffer): Promise<PathEdits | SplatPath> {
  const magic = readMagic(new Uint8Array(file));
  return magic === SPLAT_PATH_MAGIC ? await SplatPath.read(file) : await PathEdits.read(file);
}
