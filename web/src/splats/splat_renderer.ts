/**
 * Draws splats and what edits changed of them with the page's own GPU, with the methods of `FieldRenderer`. Pictures are
 * those of `rendering.splats.rasterizer`.
 *
 * The order of many splats comes from a worker: while the view is turned a picture has the order of a moment ago, and
 * `onOrder` says when it is worth drawing again; edits are sorted before they are shown (`prepare`).
 */
import { TooLarge } from "../field/atlas";
import type { Vec3 } from "../field/level";
import { reachOf } from "../field/march_uniforms";
import type { PinholeCamera } from "../field/march_uniforms";
import type { Bytes } from "../field/page_file";
import { plainState, unbind } from "../field/present";
import type { LoadOptions, RenderOptions, SceneDrawer } from "../field/scene_drawer";
import { Targets } from "../field/targets";
import type { Reading } from "../field/targets";
import { Views } from "../field/views";
import type { Distances, View } from "../field/views";
import type { SplatSet } from "./depth_order";
import { formatsOf } from "./blend_target";
import type { Formats } from "./blend_target";
import { readEditsBeside } from "./edits_reader";
import { same, Sorter } from "./sorter";
import { depthsOf } from "./splat_camera";
import { CHANGED } from "./splat_edits";
import type { SplatEdits } from "./splat_edits";
import { readSplatLevels } from "./splat_file";
import { SplatPasses } from "./splat_passes";
import { PROJECTED, SplatStore } from "./splat_store";
import { WordTexture } from "./splat_textures";

type GL = WebGL2RenderingContext;

/** Bytes that splats may take of the GPU unless the caller says otherwise. */
const MEMORY = 768 * 2 ** 20;

interface Changed {
  edits: SplatEdits;
  texture: WordTexture;
  /** The splats that are drawn with these edits, and those of the field they were made of. */
  set: SplatSet | null;
  own: SplatSet | null;
}

export class SplatRenderer implements SceneDrawer<SplatEdits> {
  background: Vec3 = [1, 1, 1];
  near = 0;
  /** Whether the edits are seen, of the splats that are there; false shows those before them. */
  edited = true;
  readonly targets: Targets;
  readonly inBands = false;
  inOrder = true;
  level: SceneDrawer["level"] = null;
  readonly uploaded = { last: 0, total: 0 };
  private readonly views: Views;
  /** Of the splats before the edits and under them: a split view wants both. */
  private readonly sorters = { before: new Sorter(), after: new Sorter() };
  private passes: SplatPasses;
  private store: SplatStore | null = null;
  private changed: Changed | null = null;
  /** Splats of edits that are to be shown next. */
  private prepared: { edits: SplatEdits; set: SplatSet; own: SplatSet } | null = null;
  private camera: PinholeCamera | null = null;
  private loading = 0;
  constructor(
    private readonly gl: GL,
    private readonly memory = MEMORY,
    formats: Formats | null = null,
  ) {
    this.targets = new Targets(gl);
    this.views = new Views(gl, this.targets);
    this.passes = new SplatPasses(gl, this.targets, formats ?? formatsOf(gl));
  }

  /** Called when splats have been sorted for the camera, so that another picture would be better. */
  set onOrder(call: (() => void) | null) {
    for (const sorter of Object.values(this.sorters)) sorter.onOrder = call;
  }

  get editable(): boolean {
    return this.count > 0;
  }

  /** Splats that can be drawn, without edits. */
  get count(): number {
    return this.store?.count ?? 0;
  }

  get bytes(): number {
    return this.store?.bytes ?? 0;
  }

  /** Milliseconds that the last shader took to compile, and how many were. */
  get compileTime(): number {
    return this.passes.compileTime;
  }

  get compiled(): number {
    return this.passes.compiled;
  }

  /** Orders that the page has made itself, and waited for. */
  get sortedHere(): number {
    return this.sorters.before.sortedHere + this.sorters.after.sortedHere;
  }

  setSize(width: number, height: number): void {
    this.targets.setSize(width, height);
  }

  setCamera(camera: PinholeCamera): void {
    this.camera = camera;
  }

  /** Loads splats; a later call takes the place of one that is under way. Throws `TooLarge` beyond the memory. */
  async load(source: ReadableStream<Bytes> | ArrayBuffer, options: LoadOptions = {}): Promise<void> {
    const turn = ++this.loading;
    const wanted = (): boolean => turn === this.loading;
    let number = 0;
    let store: SplatStore | null = null;
    const begin = (header: SplatStore["header"]): void => {
      if (wanted()) store = new SplatStore(this.gl, header, this.memory);
    };
    try {
      for await (const level of readSplatLevels(source, begin, options.onArrival)) {
        const own = store as SplatStore | null;
        if (!wanted() || own === null) return;
        await own.take(level, wanted);
        if (!wanted()) return;
        if (this.store !== own) {
          this.store?.dispose();
          this.store = own;
        }
        this.level = { field: { background: level.header.background }, last: level.last };
        options.onLevel?.(++number, level.header.levels.length);
      }
    } finally {
      const own = store as SplatStore | null;
      if (own !== null && this.store !== own) own.dispose();
    }
  }

  /** Uploads what was shown again, after the context was lost and restored. */
  async restore(): Promise<void> {
    const { gl, store, changed } = this;
    this.changed = null;
    this.targets.forget();
    this.views.forget();
    this.passes = new SplatPasses(gl, this.targets, formatsOf(gl));
    const turn = ++this.loading;
    await store?.restore(() => turn === this.loading);
    this.setEdits(changed?.edits ?? null);
  }

  /** Edits of splats: a file holds all of them, whatever was there before. */
  async readEdits(file: ArrayBuffer): Promise<SplatEdits> {
    return await readEditsBeside(file);
  }

  /** Has the splats of edits sorted, and is done when `setEdits` with the same edits need not wait for that. */
  async prepare(edits: SplatEdits): Promise<void> {
    const { store, camera } = this;
    if (
      store === null ||
      camera === null ||
      !this.edited ||
      edits.changed === 0 ||
      edits.count !== store.header.count
    )
      return;
    const set = changedSet(edits, store);
    this.prepared = { edits, set, own: store.set };
    await this.sorters.after.prepare(set, depthsOf(store.header, camera, this.near));
  }

  /** What edits changed; null for nothing. Throws where it is of other splats, `TooLarge` beyond the memory. */
  setEdits(edits: SplatEdits | null): void {
    const { prepared } = this;
    this.changed?.texture.dispose();
    this.changed = this.prepared = null;
    this.uploaded.last = 0;
    if (edits === null || (edits.changed === 0 && !edits.hidden.includes(1))) return;
    if (this.store !== null && edits.count !== this.store.header.count)
      throw new Error(`edits of ${edits.count} splats, the page has ${this.store.header.count}; reload it`);
    const bytes = this.bytes + (4 * CHANGED + PROJECTED) * edits.changed;
    if (bytes > this.memory)
      throw new TooLarge(
        `the edited splats take ${mebibytes(bytes)} MiB of the GPU, more than the ${mebibytes(this.memory)} allowed`,
      );
    const texture = new WordTexture(this.gl, edits.records.length);
    if (edits.changed > 0)
      texture.putRows(edits.records, 0, Math.ceil(edits.records.length / texture.stride));
    const { set, own } = prepared?.edits === edits ? prepared : { set: null, own: null };
    this.changed = { edits, texture, set, own };
    this.uploaded.last = edits.changed > 0 ? edits.records.byteLength : 0;
    this.uploaded.total += this.uploaded.last;
  }

  /** Draws what the camera sees into `targets`; false while there is nothing to draw. */
  render(options: RenderOptions = {}): boolean {
    const { gl, store, camera, background, near } = this;
    if (!store || store.count === 0 || !camera || gl.isContextLost()) return false;
    const { width, height } = this.targets;
    const set = this.shown(store);
    const depths = depthsOf(store.header, camera, near);
    const sorter = set === store.set ? this.sorters.before : this.sorters.after;
    const order = sorter.of(set, depths, options.sorted ?? false);
    this.inOrder = same(order.depths, depths);
    plainState(gl);
    const rows = options.rows ?? { first: 0, count: height };
    const columns = options.columns ?? { first: 0, count: width };
    const changed = this.changed?.texture ?? null;
    this.passes.draw({
      store,
      changed,
      camera,
      near,
      order,
      normals: options.normals ?? false,
      background,
      rows,
      columns,
    });
    unbind(gl);
    return true;
  }

  /** Puts a view of what was drawn on the canvas, or in a framebuffer, of this size. */
  show(
    width: number,
    height: number,
    framebuffer: WebGLFramebuffer | null = null,
    view: View = "colour",
  ): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    this.passes.bindVertices();
    plainState(gl);
    this.views.show(view, this.reach, width, height);
    unbind(gl);
  }

  /** What was drawn, top row first. */
  read(normals = false): Reading {
    return this.targets.read(normals);
  }

  /** At most about `most` distances of what was drawn, top row first. */
  distances(most: number): Distances {
    this.passes.bindVertices();
    plainState(this.gl);
    const found = this.views.distances(most);
    unbind(this.gl);
    return found;
  }

  wait(): void {
    this.targets.wait();
  }

  /** Frees what lies on the GPU, and ends the worker. */
  dispose(): void {
    this.loading++;
    this.setEdits(null);
    this.store?.dispose();
    this.store = this.level = null;
    for (const sorter of Object.values(this.sorters)) sorter.dispose();
    this.views.dispose();
    this.targets.dispose();
    this.passes.dispose();
  }

  /** The splats that are drawn: the same object while they are the same. */
  private shown(store: SplatStore): SplatSet {
    const { changed } = this;
    if (!this.edited || changed === null) return store.set;
    if (changed.set === null || changed.own !== store.set) {
      changed.own = store.set;
      changed.set = changedSet(changed.edits, store);
    }
    return changed.set;
  }

  /** The nearest and farthest distance of the field's box from the camera. */
  private get reach(): [number, number] {
    const { store, camera } = this;
    if (!store || !camera) return [0, 1];
    return reachOf(store.header.bounds, camera);
  }
}

const mebibytes = (bytes: number): number => Math.ceil(bytes / 2 ** 20);

function changedSet(edits: SplatEdits, store: SplatStore): SplatSet {
  return { means: store.set.means, hidden: edits.hidden, changed: arrivedOf(edits, store) };
}

/** The means of changed splats, NaN where those whose colours they have are not there yet. */
function arrivedOf({ means, records, changed }: SplatEdits, store: SplatStore): Float32Array {
  if (store.isWhole) return means;
  const out = Float32Array.from(means);
  for (let n = 0; n < changed; n++) if (records[CHANGED * n + 3] >= store.count) out[3 * n] = NaN;
  return out;
}
