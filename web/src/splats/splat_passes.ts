/**
 * Render passes of splats: projection of each splat into texels, far to near; blending of a quad per splat; final colors
 * and distances from the blended sums.
 */
import { createProgram } from "../field/gl";
import type { Program } from "../field/gl";
import type { Vec3 } from "../field/level";
import type { PinholeCamera } from "../field/march_uniforms";
import { FULL_SCREEN_TRIANGLE } from "../field/present";
import type { RenderTargets } from "../field/targets";
import { QUAD_VERTEX_SHADER, RESOLVE_SHADER, SPLAT_FRAGMENT_SHADER, withDefines } from "./blend_glsl";
import { BlendTarget } from "./blend_target";
import type { BlendFormats } from "./blend_target";
import { projectionShader } from "./project_glsl";
import { ProjectedTextures } from "./projection";
import type { Order } from "./sorter";
import { relativeEye, farDistance, nearDepth } from "./splat_camera";
import type { SplatStore } from "./splat_store";
import type { WordTexture } from "./splat_textures";

type GL = WebGL2RenderingContext;

/**
 * Margin around the image, as a share of its half-size, within which the shape of a splat follows its
 * position.
 */
const SHAPE_MARGIN = 0.3;

/** Input of one image. */
export interface SplatDraw {
  store: SplatStore;
  /** Records of the splats changed by edits. */
  changed: WordTexture | null;
  camera: PinholeCamera;
  near: number;
  order: Order;
  normals: boolean;
  background: Vec3;
  rows: { first: number; count: number };
  columns: { first: number; count: number };
}

export class SplatPasses {
  /** Milliseconds of the last compilation of a shader, and the number of compilations. */
  compileTime = 0;
  compiled = 0;
  private readonly programs = new Map<string, Program>();
  private readonly blendTarget: BlendTarget;
  private readonly projection: ProjectedTextures;
  private readonly vertices: WebGLVertexArrayObject;
  /** The order that is on the GPU. */
  private uploadedOrder: Order | null = null;

  constructor(
    private readonly gl: GL,
    private readonly targets: RenderTargets,
    formats: BlendFormats,
  ) {
    this.blendTarget = new BlendTarget(gl, formats);
    this.projection = new ProjectedTextures(gl);
    this.vertices = gl.createVertexArray();
  }

  /** Draws into the targets. */
  draw(drawing: SplatDraw): void {
    const { gl, blendTarget: gathering } = this;
    const { store, camera, normals, rows, columns } = drawing;
    const count = this.project(drawing);
    gathering.begin(this.targets.width, this.targets.height, normals);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(columns.first, rows.first, columns.count, rows.count);
    const unit = gathering.formats.isByte ? 1 / farDistance(store.header, camera) : 1;
    if (count > 0) this.blend(count, normals, unit);
    this.resolve(normals, unit, drawing.background);
    gl.disable(gl.SCISSOR_TEST);
  }

  /** Binds a vertex array without buffers, for other passes. */
  bindVertices(): void {
    this.gl.bindVertexArray(this.vertices);
  }

  dispose(): void {
    const { gl } = this;
    this.uploadedOrder = null;
    this.blendTarget.dispose();
    this.projection.dispose();
    for (const { program } of this.programs.values()) gl.deleteProgram(program);
    this.programs.clear();
    gl.deleteVertexArray(this.vertices);
  }

  /** Projects the splats in their order; returns the number of quads. */
  private project({ store, changed, camera, near, order, normals }: SplatDraw): number {
    const { gl } = this;
    const { degree, antialiased, steps, log_scales: logs, color_step: colorStep } = store.header;
    const count = order.numbers.length;
    if (count === 0) return 0;
    const { program, uniform } = this.programFor(`project${degree}${antialiased}${normals}`, () => {
      return createProgram(gl, FULL_SCREEN_TRIANGLE, projectionShader({ degree, antialiased, normals }));
    });
    const { projection } = this;
    if (projection.reserve(count, normals) || this.uploadedOrder !== order) projection.put(order.numbers);
    this.uploadedOrder = order;
    projection.bind(count, normals);
    gl.useProgram(program);
    this.bindVertices();
    this.setView(uniform, store, camera, near);
    if (degree > 0) gl.uniform1fv(uniform("steps"), steps);
    gl.uniform1ui(uniform("own"), store.count);
    gl.uniform1f(uniform("logLow"), logs[0]);
    gl.uniform1f(uniform("logStep"), (logs[1] - logs[0]) / 65535);
    gl.uniform1f(uniform("colorStep"), colorStep);
    gl.uniform1ui(uniform("count"), count);
    this.bind(uniform, "order", projection.order, 0);
    this.bind(uniform, "records", store.records.texture, 1);
    this.bind(uniform, "harmonics", store.harmonics.texture, 2);
    this.bind(uniform, "changed", (changed ?? store.records).texture, 3);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return count;
  }

  private blend(count: number, normals: boolean, unit: number): void {
    const { gl } = this;
    const defines = normals ? ["NORMALS"] : [];
    const { program, uniform } = this.programFor(`blend${normals}`, () =>
      createProgram(
        gl,
        withDefines(QUAD_VERTEX_SHADER, defines),
        withDefines(SPLAT_FRAGMENT_SHADER, defines),
      ),
    );
    gl.useProgram(program);
    this.bindVertices();
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

  private resolve(normals: boolean, unit: number, background: Vec3): void {
    const { gl } = this;
    const { program, uniform } = this.programFor(`resolve${normals}`, () =>
      createProgram(gl, FULL_SCREEN_TRIANGLE, withDefines(RESOLVE_SHADER, normals ? ["NORMALS"] : [])),
    );
    this.targets.bind(normals);
    gl.useProgram(program);
    this.bindVertices();
    const { color, distance, normal } = this.blendTarget.textures!;
    this.bind(uniform, "gathered", color, 0);
    this.bind(uniform, "distances", distance, 1);
    if (normal && normals) this.bind(uniform, "axes", normal, 2);
    gl.uniform3f(uniform("background"), ...background);
    gl.uniform1f(uniform("unit"), unit);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private bind(uniform: Program["uniform"], name: string, texture: WebGLTexture | null, unit: number): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(uniform(name), unit);
  }

  private setView(
    uniform: Program["uniform"],
    { header }: SplatStore,
    camera: PinholeCamera,
    near: number,
  ): void {
    const { gl } = this;
    const { width, height } = this.targets;
    const { c2w } = camera;
    const [fx, cx] = [camera.fx, camera.cx].map((value) => (value * width) / camera.width);
    const [fy, cy] = [camera.fy, camera.cy].map((value) => (value * height) / camera.height);
    const [beyondX, beyondY] = [(0.5 * SHAPE_MARGIN * width) / fx, (0.5 * SHAPE_MARGIN * height) / fy];
    gl.uniform3f(uniform("eye"), ...relativeEye(header, camera));
    // Rows of W: the camera's x, minus its y, minus its z.
    const W = [c2w[0], -c2w[1], -c2w[2], c2w[4], -c2w[5], -c2w[6], c2w[8], -c2w[9], -c2w[10]];
    gl.uniformMatrix3fv(uniform("W"), false, W);
    gl.uniform2f(uniform("focal"), fx, fy);
    gl.uniform2f(uniform("center"), cx, cy);
    gl.uniform2f(uniform("size"), width, height);
    gl.uniform4f(
      uniform("limits"),
      -cx / fx - beyondX,
      (width - cx) / fx + beyondX,
      -cy / fy - beyondY,
      (height - cy) / fy + beyondY,
    );
    gl.uniform1f(uniform("near"), nearDepth(header, near));
  }

  private programFor(key: string, make: () => Program): Program {
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
