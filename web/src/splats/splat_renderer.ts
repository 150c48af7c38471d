/**
 * Draws splats and what edits changed of them with the page's own GPU, with the methods of `FieldRenderer`. Pictures are
 * those of `rendering.splat_rasterizer`.
 *
 * Splats are projected once a picture, each into texels of a texture, in the order from far to near; then each is a quad
 * that is blended over what is there. The order of many splats comes from a worker: while the view is turned a
 * picture has the order of a moment ago, and `onOrder` says when it is worth drawing again.
 */
import { TooLarge } from "../field/atlas";
import type { LoadOptions, Picture } from "../field/field_renderer";
import { programOf } from "../field/gl";
import type { Program } from "../field/gl";
import type { Vec3 } from "../field/level";
import { reachOf } from "../field/march_uniforms";
import type { PinholeCamera } from "../field/march_uniforms";
import type { Bytes } from "../field/page_file";
import { plainState, unbind, WHOLE } from "../field/present";
import type { SceneDrawer } from "../field/scene_drawer";
import { Targets } from "../field/targets";
import type { Reading } from "../field/targets";
import { Views } from "../field/views";
import type { Distances, View } from "../field/views";
import { QUADS, RESOLVE, SPLAT, withDefines } from "./blend_glsl";
import type { Depths, SplatSet } from "./depth_order";
import { formatsOf, Gathering } from "./gathering";
import type { Formats } from "./gathering";
import { projecting } from "./project_glsl";
import { Projection } from "./projection";
import { same, Sorter } from "./sorter";
import type { Order } from "./sorter";
import { CHANGED } from "./splat_edits";
import type { SplatEdits } from "./splat_edits";
import { readSplatLevels } from "./splat_file";
import { PROJECTED, SplatStore } from "./splat_store";
import { WordTexture } from "./splat_textures";

type GL = WebGL2RenderingContext;

/** Bytes that splats may take of the GPU unless the caller says otherwise. */
const MEMORY = 768 * 2 ** 20;

/** How far outside the picture, in shares of its half-size, a splat's shape still follows where it is. */
const OUTSIDE = 0.3;

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
  compileTime = 0;
  compiled = 0;
  private readonly views: Views;
  /** Of the splats before the edits and under them: a split view wants both. */
  private readonly sorters = { before: new Sorter(), after: new Sorter() };
  private readonly formats: Formats;
  private gathering: Gathering;
  private store: SplatStore | null = null;
  private changed: Changed | null = null;
  /** Splats of edits that are to be shown next. */
  private prepared: { edits: SplatEdits; set: SplatSet; own: SplatSet } | null = null;
  private camera: PinholeCamera | null = null;
  private loading = 0;
  private readonly programs = new Map<string, Program>();
  private projection: Projection;
  private vertices: WebGLVertexArrayObject;
  /** The order whose numbers lie on the GPU. */
  private ordered: Order | null = null;

  constructor(
    private readonly gl: GL,
    private readonly memory = MEMORY,
    formats: Formats | null = null,
  ) {
    this.targets = new Targets(gl);
    this.views = new Views(gl, this.targets);
    this.vertices = gl.createVertexArray();
    this.formats = formats ?? formatsOf(gl);
    this.gathering = new Gathering(gl, this.formats);
    this.projection = new Projection(gl);
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
          this.ordered = null;
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
    this.programs.clear();
    this.vertices = gl.createVertexArray();
    this.ordered = this.changed = null;
    this.projection = new Projection(gl);
    this.targets.forget();
    this.views.forget();
    this.gathering = new Gathering(gl, formatsOf(gl));
    const turn = ++this.loading;
    await store?.restore(() => turn === this.loading);
    this.setEdits(changed?.edits ?? null);
  }

  /** Has the splats of edits sorted, and is done when `setEdits` with the same edits need not wait for that. */
  async prepare(edits: SplatEdits): Promise<void> {
    const { store, camera } = this;
    if (store === null || camera === null || !this.edited || edits.changed === 0 || edits.count !== store.header.count) return;
    const set = changedSet(edits, store);
    this.prepared = { edits, set, own: store.set };
    await this.sorters.after.prepare(set, this.depths(store, camera));
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
      throw new TooLarge(`the edited splats take ${mebibytes(bytes)} MiB of the GPU, more than the ${mebibytes(this.memory)} allowed`);
    const texture = new WordTexture(this.gl, edits.records.length);
    if (edits.changed > 0) texture.putRows(edits.records, 0, Math.ceil(edits.records.length / texture.stride));
    const { set, own } = prepared?.edits === edits ? prepared : { set: null, own: null };
    this.changed = { edits, texture, set, own };
    this.uploaded.last = edits.changed > 0 ? edits.records.byteLength : 0;
    this.uploaded.total += this.uploaded.last;
  }

  /** Draws what the camera sees into `targets`; false while there is nothing to draw. */
  render(picture: Picture = {}): boolean {
    const { gl, store, camera, gathering } = this;
    if (!store || store.count === 0 || !camera || gl.isContextLost()) return false;
    const { width, height } = this.targets;
    const normals = picture.normals ?? false;
    const set = this.shown(store);
    const depths = this.depths(store, camera);
    const sorter = set === store.set ? this.sorters.before : this.sorters.after;
    const order = sorter.of(set, depths, picture.sorted ?? false);
    this.inOrder = same(order.depths, depths);
    plainState(gl);
    const count = this.project(store, camera, order, normals);
    const { first, count: rows } = picture.rows ?? { first: 0, count: height };
    const across = picture.columns ?? { first: 0, count: width };
    gathering.begin(width, height, normals);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(across.first, first, across.count, rows);
    const unit = gathering.formats.isByte ? 1 / this.farthest(store, camera) : 1;
    if (count > 0) this.blend(count, normals, unit);
    this.resolve(normals, unit);
    gl.disable(gl.SCISSOR_TEST);
    unbind(gl);
    return true;
  }

  /** Puts a view of what was drawn on the canvas, or in a framebuffer, of this size. */
  show(width: number, height: number, framebuffer: WebGLFramebuffer | null = null, view: View = "colour"): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.bindVertexArray(this.vertices);
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
    this.gl.bindVertexArray(this.vertices);
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
    const { gl } = this;
    this.loading++;
    this.setEdits(null);
    this.store?.dispose();
    this.store = this.ordered = this.level = null;
    for (const sorter of Object.values(this.sorters)) sorter.dispose();
    this.views.dispose();
    this.targets.dispose();
    this.gathering.dispose();
    this.projection.dispose();
    for (const { program } of this.programs.values()) gl.deleteProgram(program);
    this.programs.clear();
    gl.deleteVertexArray(this.vertices);
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

  /** Orders that the page has made itself, and waited for. */
  get sortedHere(): number {
    return this.sorters.before.sortedHere + this.sorters.after.sortedHere;
  }

  private eye(store: SplatStore, { c2w }: PinholeCamera): Vec3 {
    const { centre } = store.header;
    return [c2w[3] - centre[0], c2w[7] - centre[1], c2w[11] - centre[2]];
  }

  private depths(store: SplatStore, camera: PinholeCamera): Depths {
    const { c2w } = camera;
    const [x, y, z] = this.eye(store, camera);
    const axis: Vec3 = [-c2w[2], -c2w[6], -c2w[10]];
    return { axis, offset: -(axis[0] * x + axis[1] * y + axis[2] * z), near: Math.max(this.near, store.header.near) };
  }

  /** A distance beyond the box of interest. */
  private farthest(store: SplatStore, camera: PinholeCamera): number {
    const [low, high] = store.header.bounds;
    return Math.hypot(...this.eye(store, camera)) + Math.hypot(...high.map((value, axis) => value - low[axis]));
  }

  /** The nearest and farthest distance of the field's box from the camera. */
  private get reach(): [number, number] {
    const { store, camera } = this;
    if (!store || !camera) return [0, 1];
    return reachOf(store.header.bounds, camera);
  }

  /** Projects splats in an order into the buffer of quads; how many there are. */
  private project(store: SplatStore, camera: PinholeCamera, order: Order, normals: boolean): number {
    const { gl } = this;
    const { degree, antialiased, steps, log_scales: logs, colour_step: colourStep } = store.header;
    const count = order.numbers.length;
    if (count === 0) return 0;
    const { program, uniform } = this.cached(`project${degree}${antialiased}${normals}`, () => {
      return programOf(gl, WHOLE, projecting({ degree, antialiased, normals }));
    });
    const { projection } = this;
    if (projection.reserve(count, normals) || this.ordered !== order) projection.put(order.numbers);
    this.ordered = order;
    projection.bind(count, normals);
    gl.useProgram(program);
    gl.bindVertexArray(this.vertices);
    this.setView(uniform, store, camera);
    if (degree > 0) gl.uniform1fv(uniform("steps"), steps);
    gl.uniform1ui(uniform("own"), store.count);
    gl.uniform1f(uniform("logLow"), logs[0]);
    gl.uniform1f(uniform("logStep"), (logs[1] - logs[0]) / 65535);
    gl.uniform1f(uniform("colourStep"), colourStep);
    gl.uniform1ui(uniform("count"), count);
    this.bind(uniform, "order", projection.order, 0);
    this.bind(uniform, "records", store.records.texture, 1);
    this.bind(uniform, "harmonics", store.harmonics.texture, 2);
    this.bind(uniform, "changed", (this.changed?.texture ?? store.records).texture, 3);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return count;
  }

  private blend(count: number, normals: boolean, unit: number): void {
    const { gl } = this;
    const defines = normals ? ["NORMALS"] : [];
    const { program, uniform } = this.cached(`blend${normals}`, () =>
      programOf(gl, withDefines(QUADS, defines), withDefines(SPLAT, defines)),
    );
    gl.useProgram(program);
    gl.bindVertexArray(this.vertices);
    const names = ["places", "shapes", "tints", ...(normals ? ["normals"] : [])];
    names.forEach((name, n) => this.bind(uniform, name, this.projection.outputs[n], n));
    gl.uniform2f(uniform("size"), this.targets.width, this.targets.height);
    gl.uniform1f(uniform("unit"), unit);
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.FUNC_ADD);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawArrays(gl.TRIANGLES, 0, 6 * count);
    gl.disable(gl.BLEND);
  }

  private resolve(normals: boolean, unit: number): void {
    const { gl } = this;
    const { program, uniform } = this.cached(`resolve${normals}`, () =>
      programOf(gl, WHOLE, withDefines(RESOLVE, normals ? ["NORMALS"] : [])),
    );
    this.targets.bind(normals);
    gl.useProgram(program);
    gl.bindVertexArray(this.vertices);
    const { colour, distance, normal } = this.gathering.textures!;
    this.bind(uniform, "gathered", colour, 0);
    this.bind(uniform, "distances", distance, 1);
    if (normal && normals) this.bind(uniform, "axes", normal, 2);
    gl.uniform3f(uniform("background"), ...this.background);
    gl.uniform1f(uniform("unit"), unit);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private bind(uniform: Program["uniform"], name: string, texture: WebGLTexture | null, unit: number): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(uniform(name), unit);
  }

  private setView(uniform: Program["uniform"], store: SplatStore, camera: PinholeCamera): void {
    const { gl } = this;
    const { width, height } = this.targets;
    const { c2w } = camera;
    const [fx, cx] = [camera.fx, camera.cx].map((value) => (value * width) / camera.width);
    const [fy, cy] = [camera.fy, camera.cy].map((value) => (value * height) / camera.height);
    const [beyondX, beyondY] = [(0.5 * OUTSIDE * width) / fx, (0.5 * OUTSIDE * height) / fy];
    gl.uniform3f(uniform("eye"), ...this.eye(store, camera));
    // Rows of W: the camera's x, minus its y, minus its z; read as columns of it where it is not transposed.
    const W = [c2w[0], -c2w[1], -c2w[2], c2w[4], -c2w[5], -c2w[6], c2w[8], -c2w[9], -c2w[10]];
    gl.uniformMatrix3fv(uniform("W"), false, W);
    gl.uniform2f(uniform("focal"), fx, fy);
    gl.uniform2f(uniform("centre"), cx, cy);
    gl.uniform2f(uniform("size"), width, height);
    gl.uniform4f(uniform("limits"), -cx / fx - beyondX, (width - cx) / fx + beyondX, -cy / fy - beyondY, (height - cy) / fy + beyondY);
    gl.uniform1f(uniform("near"), Math.max(this.near, store.header.near));
  }

  private cached(key: string, make: () => Program): Program {
    let program = this.programs.get(key);
    if (!program) {
      program = make();
      this.programs.set(key, program);
      this.compileTime = program.milliseconds;
      this.compiled += 1;
    }
    return program;
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
