/**
 * The passes of a picture of splats: each is projected once, into texels of a texture, in the order from far to near;
 * then each is a quad that is blended over what is there; then colours and distances are made of what was gathered.
 */
import { programOf } from "../field/gl";
import type { Program } from "../field/gl";
import type { Vec3 } from "../field/level";
import type { PinholeCamera } from "../field/march_uniforms";
import { WHOLE } from "../field/present";
import type { Targets } from "../field/targets";
import { QUADS, RESOLVE, SPLAT, withDefines } from "./blend_glsl";
import { Gathering } from "./blend_target";
import type { Formats } from "./blend_target";
import { projecting } from "./project_glsl";
import { Projection } from "./projection";
import type { Order } from "./sorter";
import { eyeOf, farthest, nearestOf } from "./splat_camera";
import type { SplatStore } from "./splat_store";
import type { WordTexture } from "./splat_textures";

type GL = WebGL2RenderingContext;

/** How far outside the picture, in shares of its half-size, a splat's shape still follows where it is. */
const OUTSIDE = 0.3;

/** What a picture is drawn of. */
export interface Drawing {
  store: SplatStore;
  /** Splats that edits changed. */
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
  /** Milliseconds that the last shader took, and how many were compiled. */
  compileTime = 0;
  compiled = 0;
  private readonly programs = new Map<string, Program>();
  private readonly gathering: Gathering;
  private readonly projection: Projection;
  private readonly vertices: WebGLVertexArrayObject;
  /** The order whose numbers lie on the GPU. */
  private ordered: Order | null = null;

  constructor(
    private readonly gl: GL,
    private readonly targets: Targets,
    formats: Formats,
  ) {
    this.gathering = new Gathering(gl, formats);
    this.projection = new Projection(gl);
    this.vertices = gl.createVertexArray();
  }

  /** Draws into the targets. */
  draw(drawing: Drawing): void {
    const { gl, gathering } = this;
    const { store, camera, normals, rows, columns } = drawing;
    const count = this.project(drawing);
    gathering.begin(this.targets.width, this.targets.height, normals);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(columns.first, rows.first, columns.count, rows.count);
    const unit = gathering.formats.isByte ? 1 / farthest(store.header, camera) : 1;
    if (count > 0) this.blend(count, normals, unit);
    this.resolve(normals, unit, drawing.background);
    gl.disable(gl.SCISSOR_TEST);
  }

  /** For passes of others, which take their vertices from no buffer. */
  bindVertices(): void {
    this.gl.bindVertexArray(this.vertices);
  }

  dispose(): void {
    const { gl } = this;
    this.ordered = null;
    this.gathering.dispose();
    this.projection.dispose();
    for (const { program } of this.programs.values()) gl.deleteProgram(program);
    this.programs.clear();
    gl.deleteVertexArray(this.vertices);
  }

  /** Projects splats in an order into the buffer of quads; how many there are. */
  private project({ store, changed, camera, near, order, normals }: Drawing): number {
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
    this.bindVertices();
    this.setView(uniform, store, camera, near);
    if (degree > 0) gl.uniform1fv(uniform("steps"), steps);
    gl.uniform1ui(uniform("own"), store.count);
    gl.uniform1f(uniform("logLow"), logs[0]);
    gl.uniform1f(uniform("logStep"), (logs[1] - logs[0]) / 65535);
    gl.uniform1f(uniform("colourStep"), colourStep);
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
    const { program, uniform } = this.cached(`blend${normals}`, () =>
      programOf(gl, withDefines(QUADS, defines), withDefines(SPLAT, defines)),
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
    const { program, uniform } = this.cached(`resolve${normals}`, () =>
      programOf(gl, WHOLE, withDefines(RESOLVE, normals ? ["NORMALS"] : [])),
    );
    this.targets.bind(normals);
    gl.useProgram(program);
    this.bindVertices();
    const { colour, distance, normal } = this.gathering.textures!;
    this.bind(uniform, "gathered", colour, 0);
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
    const [beyondX, beyondY] = [(0.5 * OUTSIDE * width) / fx, (0.5 * OUTSIDE * height) / fy];
    gl.uniform3f(uniform("eye"), ...eyeOf(header, camera));
    // Rows of W: the camera's x, minus its y, minus its z; read as columns of it where it is not transposed.
    const W = [c2w[0], -c2w[1], -c2w[2], c2w[4], -c2w[5], -c2w[6], c2w[8], -c2w[9], -c2w[10]];
    gl.uniformMatrix3fv(uniform("W"), false, W);
    gl.uniform2f(uniform("focal"), fx, fy);
    gl.uniform2f(uniform("centre"), cx, cy);
    gl.uniform2f(uniform("size"), width, height);
    gl.uniform4f(
      uniform("limits"),
      -cx / fx - beyondX,
      (width - cx) / fx + beyondX,
      -cy / fy - beyondY,
      (height - cy) / fy + beyondY,
    );
    gl.uniform1f(uniform("near"), nearestOf(header, near));
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
