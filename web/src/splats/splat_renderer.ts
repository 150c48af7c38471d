/**
 * WebGL2 renderer of splats and their edits, with the methods of `FieldRenderer`. Images equal those of
 * `rendering.splats.rasterizer`.
 *
 * A worker sorts large sets: an image of a moving camera may have an earlier order, and `onOrder` is called when a redraw
 * improves it. Edits are sorted before they are shown (`prepare`).
 */
import { TooLarge } from "../field/atlas";
import type { Vec3 } from "../field/level";
import { distanceRange } from "../field/march_uniforms";
import type { PinholeCamera } from "../field/march_uniforms";
import type { Bytes } from "../field/page_file";
import { resetState, unbindAll } from "../field/present";
import type { LoadOptions, RenderOptions, SceneDrawer } from "../field/scene_drawer";
import { RenderTargets } from "../field/targets";
import type { RenderedImage } from "../field/targets";
import { ViewPasses } from "../field/views";
import type { Distances, View } from "../field/views";
import type { SplatSet } from "./depth_order";
import { chooseFormats } from "./blend_target";
import type { BlendFormats } from "./blend_target";
import { readEditsInWorker } from "./edits_reader";
import { haveSameDepths, Sorter } from "./sorter";
import { sortDepths } from "./splat_camera";
import { CHANGED_WORDS } from "./splat_edits";
import type { SplatEdits } from "./splat_edits";
import { NodeLoader } from "./node_loader";
import { readSplatLevels } from "./splat_file";
import type { SplatNode } from "./splat_file";
import { SplatPasses } from "./splat_passes";
import { PROJECTED_BYTES, SplatStore } from "./splat_store";
import { WordTexture } from "./splat_textures";

type GL = WebGL2RenderingContext;

/** Default limit of the GPU memory of splats, in bytes. */
const DEFAULT_MEMORY_BYTES = 768 * 2 ** 20;

interface ChangedSplats {
  edits: SplatEdits;
  texture: WordTexture;
  /** The set of drawn splats with these edits, and the set of the field that it derives from. */
  set: SplatSet | null;
  own: SplatSet | null;
}

export class SplatRenderer implements SceneDrawer<SplatEdits> {
  background: Vec3 = [1, 1, 1];
  near = 0;
  /** Whether the edits are applied; false draws the splats before the edits. */
  edited = true;
  readonly targets: RenderTargets;
  readonly inBands = false;
  inOrder = true;
  level: SceneDrawer["level"] = null;
  readonly uploaded = { last: 0, total: 0 };
  private readonly viewPasses: ViewPasses;
  /** Sorters of the splats before and after the edits: a split view needs both. */
  private readonly sorters = { before: new Sorter(), after: new Sorter() };
  private passes: SplatPasses;
  private store: SplatStore | null = null;
  /** Loader of details that are not all stored; null before the first view is complete, and without details. */
  private loader: NodeLoader | null = null;
  private changed: ChangedSplats | null = null;
  /** The sorted set of the edits that are shown next. */
  private prepared: { edits: SplatEdits; set: SplatSet; own: SplatSet } | null = null;
  private camera: PinholeCamera | null = null;
  private loading = 0;
  constructor(
    private readonly gl: GL,
    private readonly memory = DEFAULT_MEMORY_BYTES,
    formats: BlendFormats | null = null,
  ) {
    this.targets = new RenderTargets(gl);
    this.viewPasses = new ViewPasses(gl, this.targets);
    this.passes = new SplatPasses(gl, this.targets, formats ?? chooseFormats(gl));
  }

  /** Called when the splats have been sorted for the camera, so that a redraw improves the image. */
  set onOrder(call: (() => void) | null) {
    for (const sorter of Object.values(this.sorters)) sorter.onOrder = call;
  }

  get editable(): boolean {
    return this.count > 0;
  }

  /** Number of loaded splats, without edits. */
  get count(): number {
    return this.store?.count ?? 0;
  }

  get bytes(): number {
    return this.store?.bytes ?? 0;
  }

  /** Milliseconds of the last compilation of a shader. */
  get compileTime(): number {
    return this.passes.compileTime;
  }

  get compiled(): number {
    return this.passes.compiled;
  }

  /** Number of orders for which the page has waited. */
  get sortedHere(): number {
    return this.sorters.before.sortedHere + this.sorters.after.sortedHere;
  }

  setSize(width: number, height: number): void {
    this.targets.setSize(width, height);
  }

  setCamera(camera: PinholeCamera): void {
    this.camera = camera;
    this.loader?.look(camera);
  }

  /** Loads splats; a later call replaces one in progress. Throws `TooLarge` beyond the memory limit. */
  async load(source: ReadableStream<Bytes> | ArrayBuffer, options: LoadOptions = {}): Promise<void> {
    const turn = ++this.loading;
    this.loader = null;
    const wanted = (): boolean => turn === this.loading;
    let number = 0;
    let store: SplatStore | null = null;
    let coarseBytes = 0;
    const begin = (header: SplatStore["header"]): void => {
      if (wanted()) store = new SplatStore(this.gl, header, this.memory);
    };
    try {
      const arrive = (bytes: number): void => {
        coarseBytes = bytes;
        options.onArrival?.(bytes);
      };
      for await (const level of readSplatLevels(source, begin, arrive)) {
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
      const whole = store as SplatStore | null;
      if (whole?.header.nodes && options.openBeside)
        await this.loadNodes(whole, whole.header.nodes, options.openBeside, coarseBytes, options, wanted);
    } finally {
      const own = store as SplatStore | null;
      if (own !== null && this.store !== own) own.dispose();
    }
  }

  /** Loads details, nodes that the camera sees largest first, each in place of its coarse splats. */
  private async loadNodes(
    store: SplatStore,
    nodes: readonly SplatNode[],
    open: NonNullable<LoadOptions["openBeside"]>,
    coarseBytes: number,
    options: LoadOptions,
    wanted: () => boolean,
  ): Promise<void> {
    const apply = (): Promise<void> => this.applyNodes(store, wanted);
    const loader = new NodeLoader(store, nodes, open, apply, options, wanted, coarseBytes);
    await loader.load(() => this.camera);
    if (!wanted()) return;
    this.loader = loader;
    this.level = { field: { background: store.header.background }, last: true };
    options.onLevel?.(2, 2);
  }

  /** Shows the stored nodes, once they are in order: no image has both a node and its coarse splats. */
  private async applyNodes(store: SplatStore, wanted: () => boolean): Promise<void> {
    const set = store.setWithNodes();
    if (set === null) return;
    const { camera } = this;
    if (camera !== null) await this.sorters.before.prepare(set, sortDepths(store.header, camera, this.near));
    if (wanted()) store.set = set;
  }

  /** Uploads the splats again after the context was lost and restored. */
  async restore(): Promise<void> {
    const { gl, store, changed } = this;
    this.changed = null;
    this.targets.forget();
    this.viewPasses.forget();
    this.passes = new SplatPasses(gl, this.targets, chooseFormats(gl));
    const turn = ++this.loading;
    const { loader } = this;
    const wanted = (): boolean => turn === this.loading;
    this.loader = null;
    await store?.restore(wanted);
    if (loader !== null && wanted()) {
      loader.wanted = wanted;
      this.loader = loader;
    }
    this.setEdits(changed?.edits ?? null);
  }

  /** Edits of splats: a file holds all of them, whatever was there before. */
  async readEdits(file: ArrayBuffer): Promise<SplatEdits> {
    return await readEditsInWorker(file);
  }

  /** Sorts the splats of edits, so that `setEdits` with the same edits need not wait for a sort. */
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
    const set = combineSets(edits, store);
    this.prepared = { edits, set, own: store.set };
    await this.sorters.after.prepare(set, sortDepths(store.header, camera, this.near));
  }

  /**
   * Replaces the edits; null for none. Throws for edits of other splats, and `TooLarge` beyond the memory
   * limit.
   */
  setEdits(edits: SplatEdits | null): void {
    const { prepared } = this;
    this.changed?.texture.dispose();
    this.changed = this.prepared = null;
    this.uploaded.last = 0;
    if (edits === null || (edits.changed === 0 && !edits.hidden.includes(1))) return;
    if (this.store !== null && edits.count !== this.store.header.count)
      throw new Error(`edits of ${edits.count} splats, the page has ${this.store.header.count}; reload it`);
    const bytes = this.bytes + (4 * CHANGED_WORDS + PROJECTED_BYTES) * edits.changed;
    if (bytes > this.memory)
      throw new TooLarge(
        `the edited splats take ${mebibytes(bytes)} MiB of the GPU, more than the ${mebibytes(this.memory)} allowed`,
      );
    const texture = new WordTexture(this.gl, edits.records.length);
    if (edits.changed > 0)
      texture.uploadRows(edits.records, 0, Math.ceil(edits.records.length / texture.stride));
    const { set, own } = prepared?.edits === edits ? prepared : { set: null, own: null };
    this.changed = { edits, texture, set, own };
    this.uploaded.last = edits.changed > 0 ? edits.records.byteLength : 0;
    this.uploaded.total += this.uploaded.last;
  }

  /** Draws the camera's image into `targets`; false while there is nothing to draw. */
  render(options: RenderOptions = {}): boolean {
    const { gl, store, camera, background, near } = this;
    if (!store || store.count === 0 || !camera || gl.isContextLost()) return false;
    const { width, height } = this.targets;
    const set = this.shownSet(store);
    const depths = sortDepths(store.header, camera, near);
    const sorter = set === store.set ? this.sorters.before : this.sorters.after;
    const order = sorter.orderFor(set, depths, options.sorted ?? false);
    this.inOrder = haveSameDepths(order.depths, depths);
    resetState(gl);
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
    unbindAll(gl);
    return true;
  }

  /** Draws a view of the image on the canvas, or into a framebuffer, of a size. */
  show(
    width: number,
    height: number,
    framebuffer: WebGLFramebuffer | null = null,
    view: View = "color",
  ): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    this.passes.bindVertices();
    resetState(gl);
    this.viewPasses.show(view, this.reach, width, height);
    unbindAll(gl);
  }

  /** The drawn image, top row first. */
  read(normals = false): RenderedImage {
    return this.targets.read(normals);
  }

  /** At most about `most` distances of the drawn image, top row first. */
  distances(most: number): Distances {
    this.passes.bindVertices();
    resetState(this.gl);
    const found = this.viewPasses.distances(most);
    unbindAll(this.gl);
    return found;
  }

  wait(): void {
    this.targets.wait();
  }

  /** Frees all GPU objects, and ends the workers. */
  dispose(): void {
    this.loading++;
    this.setEdits(null);
    this.store?.dispose();
    this.store = this.level = null;
    for (const sorter of Object.values(this.sorters)) sorter.dispose();
    this.viewPasses.dispose();
    this.targets.dispose();
    this.passes.dispose();
  }

  /** The drawn splats; an unchanged set is an identical object. */
  private shownSet(store: SplatStore): SplatSet {
    const { changed } = this;
    if (!this.edited || changed === null) return store.set;
    if (changed.set === null || changed.own !== store.set) {
      changed.own = store.set;
      changed.set = combineSets(changed.edits, store);
    }
    return changed.set;
  }

  /** The smallest and the largest distance of the field's box from the camera. */
  private get reach(): [number, number] {
    const { store, camera } = this;
    if (!store || !camera) return [0, 1];
    return distanceRange(store.header.bounds, camera);
  }
}

const mebibytes = (bytes: number): number => Math.ceil(bytes / 2 ** 20);

function combineSets(edits: SplatEdits, store: SplatStore): SplatSet {
  return { means: store.set.means, hidden: edits.hidden, changed: meansOfArrived(edits, store) };
}

/** The means of changed splats [M, 3]; NaN for a splat whose source has not arrived. */
function meansOfArrived({ means, records, changed }: SplatEdits, store: SplatStore): Float32Array {
  if (store.isWhole) return means;
  const out = Float32Array.from(means);
  for (let n = 0; n < changed; n++) if (records[CHANGED_WORDS * n + 3] >= store.count) out[3 * n] = NaN;
  return out;
}
