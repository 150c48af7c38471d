/**
 * Renderer of a voxel field and its edits for any WebGL2 context, without extensions.
 *
 *     const renderer = new FieldRenderer(gl);
 *     renderer.setSize(800, 600);
 *     renderer.setCamera({ c2w, fx, fy, cx, cy, width: 800, height: 600 });
 *     await renderer.load(await fetch(url).then((answer) => answer.body), { onLevel: draw });
 *     renderer.render();          // into renderer.color, renderer.depth (float bits) and, on request, renderer.normals
 *     renderer.show();            // onto the canvas
 *
 * Drawing changes the state of the context: three.js needs `resetState()` afterwards.
 */
import { isBent, isGraded, unrolledEdits } from "./edits_glsl";
import { EditTextures } from "./edits_on_gpu";
import { OutOfMemory, createProgram } from "./gl";
import type { Program } from "./gl";
import { readLevels } from "./level";
import type { Level, Vec3 } from "./level";
import { marchShader } from "./march_glsl";
import type { MarchVariant } from "./march_glsl";
import { distanceRange, setFieldUniforms, setCameraUniforms } from "./march_uniforms";
import type { PinholeCamera } from "./march_uniforms";
import { readEdits } from "./page_edits";
import type { PageEdits } from "./page_edits";
import type { PlacedLayer } from "./page_layers";
import type { Bytes } from "./page_file";
import { resetState, unbindAll, FULL_SCREEN_TRIANGLE } from "./present";
import { ShownField } from "./shown_field";
import type { LoadOptions, RenderOptions, SceneDrawer } from "./scene_drawer";
import { RenderTargets } from "./targets";
import type { RenderedImage } from "./targets";
import { ViewPasses } from "./views";
import type { Distances, View } from "./views";

type GL = WebGL2RenderingContext;

/** Default limit of the bytes of a field's textures. */
const DEFAULT_MEMORY_BYTES = 768 * 2 ** 20;

export class FieldRenderer implements SceneDrawer<PageEdits> {
  background: Vec3 = [1, 1, 1];
  near = 0;
  /** Whether the edits are applied; false draws the field before the edits. */
  edited = true;
  /** Distance between samples in voxels; null for that of the file. */
  step: number | null = null;
  readonly targets: RenderTargets;
  readonly inBands = true;
  readonly inOrder = true;
  readonly editable = true;
  /** Never called: voxels need no depth order. */
  onOrder: (() => void) | null = null;
  /** Milliseconds of the last compilation of a shader. */
  compileTime = 0;
  compiled = 0;
  private shownField: ShownField | null = null;
  private readonly editTextures: EditTextures;
  private readonly viewPasses: ViewPasses;
  private camera: PinholeCamera | null = null;
  private loading = 0;
  private readonly programs = new Map<string, Program>();
  private vertices: WebGLVertexArrayObject;

  constructor(
    private readonly gl: GL,
    private readonly memory = DEFAULT_MEMORY_BYTES,
  ) {
    this.targets = new RenderTargets(gl);
    this.viewPasses = new ViewPasses(gl, this.targets);
    this.editTextures = new EditTextures(gl);
    this.vertices = gl.createVertexArray();
  }

  /** The level that is drawn. */
  get level(): Level | null {
    return this.shownField?.level ?? null;
  }

  /** Bytes of edits uploaded by the last `setEdits`, and by all. */
  get uploaded(): { readonly last: number; readonly total: number } {
    return this.editTextures.uploaded;
  }

  /** The edits that are drawn. */
  private get activeEdits(): PageEdits | null {
    return this.edited ? this.editTextures.edits : null;
  }

  /** Bytes of the field's textures. */
  get bytes(): number {
    return this.shownField?.textures.bytes ?? 0;
  }

  setSize(width: number, height: number): void {
    this.targets.setSize(width, height);
  }

  setCamera(camera: PinholeCamera): void {
    this.camera = camera;
  }

  /** Loads a field; a later call replaces one in progress. Throws `TooLarge` beyond the memory limit. */
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

  /** Uploads the field again after the context was lost and restored. */
  async restore(): Promise<void> {
    const { shownField: shown } = this;
    const { edits } = this.editTextures;
    this.programs.clear();
    this.vertices = this.gl.createVertexArray();
    this.shownField = null;
    for (const part of [this.targets, this.viewPasses, this.editTextures]) part.forget();
    const turn = ++this.loading;
    this.setEdits(edits);
    if (shown) await this.take(shown.level, () => turn === this.loading);
  }

  async readEdits(file: ArrayBuffer, before: PageEdits | null): Promise<PageEdits> {
    return await readEdits(file, before);
  }

  /** Edits of voxels need no preparation. */
  async prepare(): Promise<void> {}

  /** Replaces the edits; null for none. Uploads the changed parts. */
  setEdits(edits: PageEdits | null): void {
    this.editTextures.set(edits);
    this.putLayers();
  }

  /** Draws the camera's image into `targets`; false while there is nothing to draw. */
  render(options: RenderOptions = {}): boolean {
    const { gl, shownField: shown, camera, activeEdits: active } = this;
    if (!shown || !camera || gl.isContextLost()) return false;
    const { level, textures } = shown;
    const { width, height } = this.targets;
    const variant: MarchVariant = {
      K: level.header.steps.length,
      contracted: level.field.contracted,
      edited: active !== null,
      edits: active && unrolledEdits(active.edits),
      normals: options.normals ?? false,
      graded: active !== null && isGraded(active.rows, active.edits),
      bent: active !== null && isBent(active.rows, active.edits),
      count: options.count ?? false,
    };
    const { program, uniform } = this.program(variant, level.field.brick);
    this.targets.bind(variant.normals);
    gl.useProgram(program);
    gl.bindVertexArray(this.vertices);
    resetState(this.gl);
    const occupancy = active && level.last ? active.occupancy : level.occupancy;
    setFieldUniforms(gl, uniform, level, textures.layout, occupancy, this.step ?? level.field.step);
    setCameraUniforms(gl, uniform, camera, this.targets);
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
      active ? (level.last ? this.editTextures.bricks : shown.fullOccupancy) : shown.occupancy,
    );
    textures.colors.forEach((texture, n) => bind(`colorAtlas${n}`, gl.TEXTURE_3D, texture));
    if (active) {
      bind("lattice", gl.TEXTURE_2D, this.editTextures.bind(program));
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
    gl.bindVertexArray(this.vertices);
    resetState(this.gl);
    this.viewPasses.show(view, this.reach, width, height);
    unbindAll(this.gl);
  }

  /** The drawn image, top row first. */
  read(normals = false): RenderedImage {
    return this.targets.read(normals);
  }

  /** At most about `most` distances of the drawn image, top row first. */
  distances(most: number): Distances {
    this.gl.bindVertexArray(this.vertices);
    resetState(this.gl);
    const found = this.viewPasses.distances(most);
    unbindAll(this.gl);
    return found;
  }

  wait(): void {
    this.targets.wait();
  }

  /** Frees all GPU objects. */
  dispose(): void {
    this.loading++;
    this.drop();
    for (const part of [this.targets, this.viewPasses, this.editTextures]) part.dispose();
    for (const { program } of this.programs.values()) this.gl.deleteProgram(program);
    this.programs.clear();
    this.gl.deleteVertexArray(this.vertices);
  }

  private async take(level: Level, wanted: () => boolean): Promise<void> {
    const shown = await ShownField.upload(this.gl, this.memory, level, this.layers, wanted);
    if (shown === null) return;
    this.drop();
    this.shownField = shown;
    this.putLayers();
  }

  /** The layers of the edits' patches. */
  private get layers(): readonly PlacedLayer[] {
    return this.editTextures.edits?.layers ?? [];
  }

  private putLayers(): void {
    try {
      if (this.shownField) this.editTextures.countUpload(this.shownField.putLayers(this.layers));
    } catch (error) {
      // The GPU lacks memory for larger textures of the field, and the former ones are freed.
      if (error instanceof OutOfMemory) this.drop();
      throw error;
    }
  }

  private drop(): void {
    this.shownField?.dispose();
    this.shownField = null;
  }

  /** The smallest and the largest distance of the field's box from the camera. */
  private get reach(): [number, number] {
    const { shownField: shown, camera } = this;
    if (!shown || !camera) return [0, 1];
    return distanceRange(shown.level.field.bounds, camera);
  }

  private program(variant: MarchVariant, brick: number): Program {
    const key = JSON.stringify([variant, brick]);
    let program = this.programs.get(key);
    if (!program) {
      program = createProgram(this.gl, FULL_SCREEN_TRIANGLE, marchShader(variant, brick));
      this.programs.set(key, program);
      this.compileTime = program.milliseconds;
      this.compiled += 1;
    }
    return program;
  }
}
