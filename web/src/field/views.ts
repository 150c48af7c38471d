/**
 * Passes after rendering: the editor's views, equal to `render_worker.encoding`, and the readback of
 * distances.
 */
import { createProgram } from "./gl";
import type { Program } from "./gl";
import { FULL_SCREEN_TRIANGLE } from "./present";
import type { RenderTargets } from "./targets";

type GL = WebGL2RenderingContext;

export const VIEWS = ["color", "depth", "opacity", "normals"] as const;
export type View = (typeof VIEWS)[number];

/** Subsampled distances of an image, top row first; infinite at an opacity up to .5. */
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
out vec4 color;
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
  color = vec4(c.rgb, 1.0);
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

export class ViewPasses {
  private programs: { show: Program; distances: Program } | null = null;
  private distanceTarget: {
    texture: WebGLTexture;
    framebuffer: WebGLFramebuffer;
    width: number;
    height: number;
  } | null = null;

  constructor(
    private readonly gl: GL,
    private readonly targets: RenderTargets,
  ) {}

  /** Draws a view of the image into the bound framebuffer; depths are shown from white to dark over `reach`. */
  show(view: View, reach: readonly [number, number], width: number, height: number): void {
    const { gl } = this;
    const { program, uniform } = this.compiledPrograms.show;
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

  /** At most about `most` distances of the drawn image. */
  distances(most: number): Distances {
    const { gl, targets } = this;
    const stride = Math.max(1, Math.ceil(Math.sqrt((targets.width * targets.height) / most)));
    const [width, height] = [Math.ceil(targets.width / stride), Math.ceil(targets.height / stride)];
    this.bindDistanceTarget(width, height);
    const { program, uniform } = this.compiledPrograms.distances;
    gl.viewport(0, 0, width, height);
    gl.useProgram(program);
    this.bind(uniform);
    gl.uniform1i(uniform("stride"), stride);
    gl.uniform1i(uniform("height"), targets.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    return { width, height, values: targets.readBits(width, height) };
  }

  /** Drops the objects of a lost context. */
  forget(): void {
    this.programs = this.distanceTarget = null;
  }

  dispose(): void {
    const { gl } = this;
    for (const { program } of Object.values(this.programs ?? {})) gl.deleteProgram(program);
    gl.deleteTexture(this.distanceTarget?.texture ?? null);
    gl.deleteFramebuffer(this.distanceTarget?.framebuffer ?? null);
    this.forget();
  }

  private get compiledPrograms(): { show: Program; distances: Program } {
    this.programs ??= {
      show: createProgram(this.gl, FULL_SCREEN_TRIANGLE, SHOW),
      distances: createProgram(this.gl, FULL_SCREEN_TRIANGLE, DISTANCES),
    };
    return this.programs;
  }

  private bind(uniform: Program["uniform"]): void {
    const { gl, targets } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, targets.color);
    gl.uniform1i(uniform("picture"), 0);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, targets.depth);
    gl.uniform1i(uniform("depthBits"), 1);
  }

  private bindDistanceTarget(width: number, height: number): void {
    const { gl } = this;
    if (this.distanceTarget?.width !== width || this.distanceTarget.height !== height) {
      gl.deleteTexture(this.distanceTarget?.texture ?? null);
      gl.deleteFramebuffer(this.distanceTarget?.framebuffer ?? null);
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R32UI, width, height);
      const framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      this.distanceTarget = { texture, framebuffer, width, height };
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.distanceTarget.framebuffer);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0]);
  }
}
