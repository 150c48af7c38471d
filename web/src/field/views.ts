/** What was drawn, as the editor's views show it (as `render_worker.encoding` does), and its distances read back. */
import { programOf } from "./gl";
import type { Program } from "./gl";
import { WHOLE } from "./present";
import type { Targets } from "./targets";

type GL = WebGL2RenderingContext;

export const VIEWS = ["colour", "depth", "opacity", "normals"] as const;
export type View = (typeof VIEWS)[number];

/** Distances of every so many pixels, top row first, infinite where the picture is half empty. */
export interface Distances {
  width: number;
  height: number;
  values: Float32Array;
}

const SHOW = `#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform sampler2D normals;
uniform vec2 size;
uniform vec2 reach;
uniform int view;
out vec4 colour;
void main() {
  vec2 at = gl_FragCoord.xy / size;
  vec4 c = texture(picture, at);
  if (view == ${VIEWS.indexOf("depth")}) {
    float far = uintBitsToFloat(texelFetch(depthBits, ivec2(at * vec2(textureSize(depthBits, 0))), 0).r);
    float share = (min(far, reach.y) - reach.x) / max(reach.y - reach.x, 1e-9);
    c.rgb = vec3((1.0 - 0.85 * clamp(share, 0.0, 1.0)) * c.a);
  } else if (view == ${VIEWS.indexOf("opacity")}) {
    c.rgb = vec3(c.a);
  } else if (view == ${VIEWS.indexOf("normals")}) {
    c.rgb = texture(normals, at).rgb * c.a;
  }
  colour = vec4(c.rgb, 1.0);
}`;

const DISTANCES = `#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform int stride;
uniform int height;
out uint bits;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) * stride;
  at.y = height - 1 - at.y;
  bits = texelFetch(picture, at, 0).a > 0.5 ? texelFetch(depthBits, at, 0).r : 0x7f800000u;
}`;

export class Views {
  private programs: { show: Program; distances: Program } | null = null;
  private small: {
    texture: WebGLTexture;
    framebuffer: WebGLFramebuffer;
    width: number;
    height: number;
  } | null = null;

  constructor(
    private readonly gl: GL,
    private readonly targets: Targets,
  ) {}

  /** Puts a view of what was drawn into the framebuffer that is bound; `reach` are the distances shown bright and dark. */
  show(view: View, reach: readonly [number, number], width: number, height: number): void {
    const { gl } = this;
    const { program, uniform } = this.cached.show;
    gl.viewport(0, 0, width, height);
    gl.useProgram(program);
    this.bind(uniform);
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, this.targets.normals);
    gl.uniform1i(uniform("normals"), 2);
    gl.uniform2f(uniform("size"), width, height);
    gl.uniform2f(uniform("reach"), ...reach);
    gl.uniform1i(uniform("view"), VIEWS.indexOf(view));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** At most about `most` distances of what was drawn. */
  distances(most: number): Distances {
    const { gl, targets } = this;
    const stride = Math.max(1, Math.ceil(Math.sqrt((targets.width * targets.height) / most)));
    const [width, height] = [Math.ceil(targets.width / stride), Math.ceil(targets.height / stride)];
    this.bindSmall(width, height);
    const { program, uniform } = this.cached.distances;
    gl.viewport(0, 0, width, height);
    gl.useProgram(program);
    this.bind(uniform);
    gl.uniform1i(uniform("stride"), stride);
    gl.uniform1i(uniform("height"), targets.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    return { width, height, values: targets.readBits(width, height) };
  }

  /** Forgets what a lost context had. */
  forget(): void {
    this.programs = this.small = null;
  }

  dispose(): void {
    const { gl } = this;
    for (const { program } of Object.values(this.programs ?? {})) gl.deleteProgram(program);
    gl.deleteTexture(this.small?.texture ?? null);
    gl.deleteFramebuffer(this.small?.framebuffer ?? null);
    this.forget();
  }

  private get cached(): { show: Program; distances: Program } {
    this.programs ??= {
      show: programOf(this.gl, WHOLE, SHOW),
      distances: programOf(this.gl, WHOLE, DISTANCES),
    };
    return this.programs;
  }

  private bind(uniform: Program["uniform"]): void {
    const { gl, targets } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, targets.colour);
    gl.uniform1i(uniform("picture"), 0);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, targets.depth);
    gl.uniform1i(uniform("depthBits"), 1);
  }

  private bindSmall(width: number, height: number): void {
    const { gl } = this;
    if (this.small?.width !== width || this.small.height !== height) {
      gl.deleteTexture(this.small?.texture ?? null);
      gl.deleteFramebuffer(this.small?.framebuffer ?? null);
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R32UI, width, height);
      const framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      this.small = { texture, framebuffer, width, height };
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.small.framebuffer);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0]);
  }
}
