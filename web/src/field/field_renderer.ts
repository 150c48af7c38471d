/**
 * Draws a voxel field and its edits with the page's own GPU, in any WebGL2 context; needs no extension.
 *
 *     const renderer = new FieldRenderer(gl);
 *     renderer.setSize(800, 600);
 *     renderer.setCamera({ c2w, fx, fy, cx, cy, width: 800, height: 600 });
 *     await renderer.load(await fetch(url).then((answer) => answer.body), { onLevel: draw });
 *     renderer.render();          // into renderer.colour, renderer.depth (float bits) and, if wanted, renderer.normals
 *     renderer.show();            // onto the canvas
 *
 * It leaves the context's state changed: three.js wants `resetState()` after it.
 */
import { unrolled } from "./edits_glsl";
import { EditsOnGpu } from "./edits_on_gpu";
import { OutOfMemory, programOf } from "./gl";
import type { Program } from "./gl";
import { readLevels } from "./level";
import type { Level, Vec3 } from "./level";
import { fragment } from "./march_glsl";
import type { Variant } from "./march_glsl";
import { reachOf, setField, setView } from "./march_uniforms";
import type { PinholeCamera } from "./march_uniforms";
import { readEdits } from "./page_edits";
import type { PageEdits } from "./page_edits";
import type { PlacedLayer } from "./page_layers";
import type { Bytes } from "./page_file";
import { plainState, unbind, WHOLE } from "./present";
import { ShownField } from "./shown_field";
import type { LoadOptions, RenderOptions, SceneDrawer } from "./scene_drawer";
import { Targets } from "./targets";
import type { Reading } from "./targets";
import { Views } from "./views";
import type { Distances, View } from "./views";

type GL = WebGL2RenderingContext;

/** Bytes of textures that a field may take unless the caller says otherwise. */
const MEMORY = 768 * 2 ** 20;

export class FieldRenderer implements SceneDrawer<PageEdits> {
  background: Vec3 = [1, 1, 1];
  near = 0;
  /** Whether the edits are seen; false shows the field before them. */
  edited = true;
  /** Distance between samples in voxels; null is the file's. */
  step: number | null = null;
  readonly targets: Targets;
  readonly inBands = true;
  readonly inOrder = true;
  readonly editable = true;
  /** Never called: voxels need no depth order. */
  onOrder: (() => void) | null = null;
  /** Milliseconds that the last new shader took to compile. */
  compileTime = 0;
  compiled = 0;
  private shown: ShownField | null = null;
  private readonly onGpu: EditsOnGpu;
  private readonly views: Views;
  private camera: PinholeCamera | null = null;
  private loading = 0;
  private readonly programs = new Map<string, Program>();
  private vertices: WebGLVertexArrayObject;

  constructor(
    private readonly gl: GL,
    private readonly memory = MEMORY,
  ) {
    this.targets = new Targets(gl);
    this.views = new Views(gl, this.targets);
    this.onGpu = new EditsOnGpu(gl);
    this.vertices = gl.createVertexArray();
  }

  /** The level that is drawn. */
  get level(): Level | null {
    return this.shown?.level ?? null;
  }

  /** Bytes of edits that were uploaded, the last time and in all. */
  get uploaded(): { readonly last: number; readonly total: number } {
    return this.onGpu.uploaded;
  }

  /** The edits that are drawn. */
  private get active(): PageEdits | null {
    return this.edited ? this.onGpu.edits : null;
  }

  /** Bytes of the field's textures. */
  get bytes(): number {
    return this.shown?.textures.bytes ?? 0;
  }

  setSize(width: number, height: number): void {
    this.targets.setSize(width, height);
  }

  setCamera(camera: PinholeCamera): void {
    this.camera = camera;
  }

  /** Loads a field; a later call takes the place of one that is under way. Throws `TooLarge` beyond the memory. */
  async load(source: ReadableStream<Bytes> | ArrayBuffer, options: LoadOptions = {}): Promise<void> {
    const turn = ++this.loading;
    const wanted = (): boolean => turn === this.loading;
    let number = 0;
    for await (const level of readLevels(source, options.onArrival)) {
      await this.take(level, wanted);
      if (!wanted()) return;
      options.onLevel?.(++number, level.field.levels.length);
    }
  }

  /** Uploads what was shown again, after the context was lost and restored. */
  async restore(): Promise<void> {
    const { shown } = this;
    const { edits } = this.onGpu;
    this.programs.clear();
    this.vertices = this.gl.createVertexArray();
    this.shown = null;
    for (const part of [this.targets, this.views, this.onGpu]) part.forget();
    const turn = ++this.loading;
    this.setEdits(edits);
    if (shown) await this.take(shown.level, () => turn === this.loading);
  }

  async readEdits(file: ArrayBuffer, before: PageEdits | null): Promise<PageEdits> {
    return await readEdits(file, before);
  }

  /** Edits of voxels need no preparation. */
  async prepare(): Promise<void> {}

  /** The edits that the field is seen through; null for none. Uploads what is other than before. */
  setEdits(edits: PageEdits | null): void {
    this.onGpu.set(edits);
    this.putLayers();
  }

  /** Draws what the camera sees into `targets`; false while there is nothing to draw. */
  render(options: RenderOptions = {}): boolean {
    const { gl, shown, camera, active } = this;
    if (!shown || !camera || gl.isContextLost()) return false;
    const { level, textures } = shown;
    const { width, height } = this.targets;
    const variant: Variant = {
      K: level.header.steps.length,
      contracted: level.field.contracted,
      edited: active !== null,
      edits: active && unrolled(active.edits),
      normals: options.normals ?? false,
      count: options.count ?? false,
    };
    const { program, uniform } = this.program(variant, level.field.brick);
    this.targets.bind(variant.normals);
    gl.useProgram(program);
    gl.bindVertexArray(this.vertices);
    plainState(this.gl);
    const occupancy = active && level.last ? active.occupancy : level.occupancy;
    setField(gl, uniform, level, textures.layout, occupancy, this.step ?? level.field.step);
    setView(gl, uniform, camera, this.targets);
    gl.uniform1f(uniform("near"), this.near);
    gl.uniform3f(uniform("background"), ...this.background);
    let unit = 0;
    const bind = (name: string, target: number, texture: WebGLTexture | null): void => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(target, texture);
      gl.uniform1i(uniform(name), unit++);
    };
    bind("densityAtlas", gl.TEXTURE_3D, textures.density);
    bind("brickIndex", gl.TEXTURE_3D, textures.index);
    bind(
      "bricks",
      gl.TEXTURE_3D,
      active ? (level.last ? this.onGpu.bricks : shown.withoutLeaps) : shown.occupancy,
    );
    textures.colours.forEach((texture, n) => bind(`colourAtlas${n}`, gl.TEXTURE_3D, texture));
    if (active) {
      bind("lattice", gl.TEXTURE_2D, this.onGpu.bind(program));
      gl.uniform1i(uniform("editCount"), active.edits);
      gl.uniform1i(uniform("boxCount"), active.boxes);
      gl.uniform1i(uniform("preserveOpacity"), Number(active.preserveOpacity));
      gl.uniform1i(uniform("layered"), Number(shown.layered));
    }
    const { first, count } = options.rows ?? { first: 0, count: height };
    const across = options.columns ?? { first: 0, count: width };
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(across.first, first, across.count, count);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
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
    gl.bindVertexArray(this.vertices);
    plainState(this.gl);
    this.views.show(view, this.reach, width, height);
    unbind(this.gl);
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

  /** Frees what lies on the GPU. */
  dispose(): void {
    this.loading++;
    this.drop();
    for (const part of [this.targets, this.views, this.onGpu]) part.dispose();
    for (const { program } of this.programs.values()) this.gl.deleteProgram(program);
    this.programs.clear();
    this.gl.deleteVertexArray(this.vertices);
  }

  private async take(level: Level, wanted: () => boolean): Promise<void> {
    const shown = await ShownField.upload(this.gl, this.memory, level, this.layers, wanted);
    if (shown === null) return;
    this.drop();
    this.shown = shown;
    this.putLayers();
  }

  /** The layers that the edits' patches have. */
  private get layers(): readonly PlacedLayer[] {
    return this.onGpu.edits?.layers ?? [];
  }

  private putLayers(): void {
    try {
      if (this.shown) this.onGpu.count(this.shown.putLayers(this.layers));
    } catch (error) {
      // The GPU had no memory for the field's textures with more room, and has those before no more.
      if (error instanceof OutOfMemory) this.drop();
      throw error;
    }
  }

  private drop(): void {
    this.shown?.dispose();
    this.shown = null;
  }

  /** The nearest and farthest distance of the field's box from the camera. */
  private get reach(): [number, number] {
    const { shown, camera } = this;
    if (!shown || !camera) return [0, 1];
    return reachOf(shown.level.field.bounds, camera);
  }

  private program(variant: Variant, brick: number): Program {
    const key = JSON.stringify([variant, brick]);
    let program = this.programs.get(key);
    if (!program) {
      program = programOf(this.gl, WHOLE, fragment(variant, brick));
      this.programs.set(key, program);
      this.compileTime = program.milliseconds;
      this.compiled += 1;
    }
    return program;
  }
}
