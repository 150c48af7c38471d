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
import { LATTICE_WIDTH, MOST_ROWS, unrolled } from "./edits_glsl";
import { deleteField, uploadLevel, uploadOccupancy } from "./field_textures";
import type { FieldTextures } from "./field_textures";
import { plainUnpacking, programOf, setFilter } from "./gl";
import type { Program } from "./gl";
import { readLevels } from "./level";
import type { Level, Vec3 } from "./level";
import { fragment } from "./march_glsl";
import type { Variant } from "./march_glsl";
import type { PageEdits } from "./page_edits";
import type { Bytes, OnArrival } from "./page_file";
import { plainState, show, showProgram, unbind, WHOLE } from "./present";
import { Targets } from "./targets";
import type { Reading } from "./targets";

type GL = WebGL2RenderingContext;

/** A pinhole camera: pose camera-to-world row by row (OpenGL axes), intrinsics in pixels of its size. */
export interface PinholeCamera {
  c2w: readonly number[];
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
}

export interface LoadOptions {
  onArrival?: OnArrival;
  /** Called when a level can be drawn: the coarse one, then the full one. */
  onLevel?: (number: number, of: number) => void;
}

export interface Picture {
  normals?: boolean;
  /** Counts of samples and texture reads in place of depth. */
  count?: boolean;
  /** Rows from the bottom that are drawn: a picture in parts keeps slow GPUs responsive. */
  rows?: { first: number; count: number };
}

interface Shown {
  level: Level;
  textures: FieldTextures;
  occupancy: WebGLTexture;
}

interface EditsOnGpu {
  edits: PageEdits;
  buffer: WebGLBuffer;
  lattice: WebGLTexture;
  occupancy: WebGLTexture;
}

/** Bytes of textures that a field may take unless the caller says otherwise. */
const MEMORY = 768 * 2 ** 20;

export class FieldRenderer {
  background: Vec3 = [1, 1, 1];
  near = 0;
  /** Whether the edits are seen; false shows the field before them. A coarse level is shown without. */
  edited = true;
  /** Distance between samples in voxels; null is the file's. */
  step: number | null = null;
  readonly targets: Targets;
  /** Milliseconds that the last new shader took to compile. */
  compileTime = 0;
  private shown: Shown | null = null;
  private onGpu: EditsOnGpu | null = null;
  private camera: PinholeCamera | null = null;
  private loading = 0;
  private readonly programs = new Map<string, Program>();
  private vertices: WebGLVertexArrayObject;

  constructor(
    private readonly gl: GL,
    private readonly memory = MEMORY,
  ) {
    this.targets = new Targets(gl);
    this.vertices = gl.createVertexArray();
  }

  /** The level that is drawn. */
  get level(): Level | null {
    return this.shown?.level ?? null;
  }

  /** The edits that are drawn: their occupancy is that of the full level. */
  private get active(): EditsOnGpu | null {
    return this.edited && this.shown?.level.last ? this.onGpu : null;
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
    const { shown, onGpu } = this;
    this.programs.clear();
    this.vertices = this.gl.createVertexArray();
    this.shown = this.onGpu = null;
    this.targets.forget();
    const turn = ++this.loading;
    if (shown) await this.take(shown.level, () => turn === this.loading);
    this.setEdits(onGpu?.edits ?? null);
  }

  /** The edits that the field is seen through; null for none. */
  setEdits(edits: PageEdits | null): void {
    const { gl } = this;
    if (this.onGpu) {
      gl.deleteBuffer(this.onGpu.buffer);
      gl.deleteTexture(this.onGpu.lattice);
      gl.deleteTexture(this.onGpu.occupancy);
      this.onGpu = null;
    }
    if (edits === null || edits.edits === 0) return;
    if (edits.rows.length > 4 * MOST_ROWS) throw new Error("more edits than the page's shader holds");
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.UNIFORM_BUFFER, buffer);
    gl.bufferData(gl.UNIFORM_BUFFER, 16 * MOST_ROWS, gl.STATIC_DRAW);
    gl.bufferSubData(gl.UNIFORM_BUFFER, 0, edits.rows);
    gl.bindBuffer(gl.UNIFORM_BUFFER, null);
    this.onGpu = { edits, buffer, lattice: this.uploadLattice(edits), occupancy: uploadOccupancy(gl, edits.occupancy) };
  }

  /** Draws what the camera sees into `targets`; false while there is nothing to draw. */
  render(picture: Picture = {}): boolean {
    const { gl, shown, camera, active: onGpu } = this;
    if (!shown || !camera || gl.isContextLost()) return false;
    const { level, textures } = shown;
    const { width, height } = this.targets;
    const variant: Variant = {
      K: level.header.steps.length,
      contracted: level.field.contracted,
      edited: onGpu !== null,
      edits: onGpu && unrolled(onGpu.edits.edits),
      normals: picture.normals ?? false,
      count: picture.count ?? false,
    };
    const { program, uniform } = this.program(variant, level.field.brick);
    this.targets.bind(variant.normals);
    gl.useProgram(program);
    gl.bindVertexArray(this.vertices);
    plainState(gl);
    this.setField(uniform, shown);
    this.setView(uniform, camera);
    let unit = 0;
    const bind = (name: string, target: number, texture: WebGLTexture): void => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(target, texture);
      gl.uniform1i(uniform(name), unit++);
    };
    bind("densityAtlas", gl.TEXTURE_3D, textures.density);
    bind("brickIndex", gl.TEXTURE_3D, textures.index);
    bind("bricks", gl.TEXTURE_3D, onGpu?.occupancy ?? shown.occupancy);
    textures.colours.forEach((texture, n) => bind(`colourAtlas${n}`, gl.TEXTURE_3D, texture));
    if (onGpu) {
      bind("lattice", gl.TEXTURE_2D, onGpu.lattice);
      gl.uniform1i(uniform("editCount"), onGpu.edits.edits);
      gl.uniform1i(uniform("boxCount"), onGpu.edits.boxes);
      gl.uniform1i(uniform("preserveOpacity"), Number(onGpu.edits.preserveOpacity));
      gl.uniformBlockBinding(program, gl.getUniformBlockIndex(program, "Edits"), 0);
      gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, onGpu.buffer);
    }
    const { first, count } = picture.rows ?? { first: 0, count: height };
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, first, width, count);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
    unbind(gl);
    return true;
  }

  /** Puts the colour that was drawn on the canvas, or in a framebuffer, of this size. */
  show(width: number, height: number, framebuffer: WebGLFramebuffer | null = null): void {
    const { gl } = this;
    gl.bindVertexArray(this.vertices);
    show(gl, this.cached("show", () => showProgram(gl)), this.targets.colour, width, height, framebuffer);
    unbind(gl);
  }

  /** What was drawn, top row first. */
  read(normals = false): Reading {
    return this.targets.read(normals);
  }

  /** Distances of what was drawn, top row first. */
  readDepth(): Float32Array {
    return this.targets.readDepth();
  }

  /** Frees what lies on the GPU. */
  dispose(): void {
    this.loading++;
    this.setEdits(null);
    this.drop();
    this.targets.dispose();
    for (const { program } of this.programs.values()) this.gl.deleteProgram(program);
    this.programs.clear();
    this.gl.deleteVertexArray(this.vertices);
  }

  private async take(level: Level, wanted: () => boolean): Promise<void> {
    const textures = await uploadLevel(this.gl, level, this.memory, wanted);
    if (textures === null) return;
    this.drop();
    this.shown = { level, textures, occupancy: uploadOccupancy(this.gl, level.occupancy) };
  }

  private drop(): void {
    if (!this.shown) return;
    deleteField(this.gl, this.shown.textures);
    this.gl.deleteTexture(this.shown.occupancy);
    this.shown = null;
  }

  private uploadLattice({ lattice }: PageEdits): WebGLTexture {
    const { gl } = this;
    const rows = Math.max(1, Math.ceil(lattice.length / (3 * LATTICE_WIDTH)));
    const data = new Uint16Array(3 * LATTICE_WIDTH * rows);
    data.set(lattice);
    plainUnpacking(gl);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGB16F, LATTICE_WIDTH, rows);
    setFilter(gl, gl.TEXTURE_2D, gl.NEAREST);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, LATTICE_WIDTH, rows, gl.RGB, gl.HALF_FLOAT, data);
    gl.bindTexture(gl.TEXTURE_2D, null);
    return texture;
  }

  private program(variant: Variant, brick: number): Program {
    return this.cached(JSON.stringify([variant, brick]), () => {
      const program = programOf(this.gl, WHOLE, fragment(variant, brick));
      this.compileTime = program.milliseconds;
      return program;
    });
  }

  private cached(key: string, make: () => Program): Program {
    let program = this.programs.get(key);
    if (!program) {
      program = make();
      this.programs.set(key, program);
    }
    return program;
  }

  private setField(uniform: Program["uniform"], { level, textures }: Shown): void {
    const { gl, active } = this;
    const { bounds, contracted } = level.field;
    const { resolution, unit, steps } = level.header;
    const { across, edge, dims } = textures.layout;
    const size = bounds[1].map((high, axis) => high - bounds[0][axis]);
    const scale = size.map((length, axis) => (contracted ? 2 / length : (resolution[axis] - 1) / length));
    const lower = bounds[0].map((low, axis) => (contracted ? 0.5 * (low + bounds[1][axis]) : low));
    const { origin, dims: bricks } = active?.edits.occupancy ?? level.occupancy;
    const step = this.step ?? level.field.step;
    gl.uniform3f(uniform("atlasScale"), 1 / (across[0] * edge), 1 / (across[1] * edge), 1 / (across[2] * edge));
    gl.uniform3i(uniform("indexDims"), ...dims);
    gl.uniform3i(uniform("bricksOrigin"), ...origin);
    gl.uniform3i(uniform("bricksDims"), ...bricks);
    gl.uniform3i(uniform("resolution"), ...resolution);
    gl.uniform3fv(uniform("lower"), lower);
    gl.uniform3fv(uniform("scale"), scale);
    gl.uniform3fv(uniform("halfGrid"), resolution.map((n) => (n - 1) / 4)); // prettier-ignore
    gl.uniform1f(uniform("unit"), unit);
    gl.uniform1f(uniform("marchStep"), contracted ? step : step / Math.max(...scale));
    gl.uniform1fv(uniform("coefficientSteps"), steps);
  }

  private setView(uniform: Program["uniform"], camera: PinholeCamera): void {
    const { gl } = this;
    const { width, height } = this.targets;
    const { c2w } = camera;
    const across = width / camera.width;
    const down = height / camera.height;
    gl.uniform3f(uniform("eye"), c2w[3], c2w[7], c2w[11]);
    gl.uniformMatrix3fv(uniform("rotation"), true, [c2w[0], c2w[1], c2w[2], c2w[4], c2w[5], c2w[6], c2w[8], c2w[9], c2w[10]]);
    gl.uniform4f(uniform("lens"), camera.fx * across, camera.fy * down, camera.cx * across, camera.cy * down);
    gl.uniform1f(uniform("height"), height);
    gl.uniform1f(uniform("near"), this.near);
    gl.uniform3f(uniform("background"), ...this.background);
  }
}
