/** A picture of a renderer's targets put on the canvas, and the context's state before and after. */
import { programOf } from "./gl";
import type { Program } from "./gl";

type GL = WebGL2RenderingContext;

/** A triangle that covers the picture, without attributes. */
export const WHOLE = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;

const SHOW = `#version 300 es
precision highp float;
uniform sampler2D picture;
uniform vec2 size;
out vec4 colour;
void main() { colour = vec4(texture(picture, gl_FragCoord.xy / size).rgb, 1.0); }`;

export function showProgram(gl: GL): Program {
  return programOf(gl, WHOLE, SHOW);
}

/** Draws a colour texture onto the canvas, or into a framebuffer, of this size. */
export function show(gl: GL, program: Program, colour: WebGLTexture | null, width: number, height: number, framebuffer: WebGLFramebuffer | null): void {
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.viewport(0, 0, width, height);
  gl.useProgram(program.program);
  plainState(gl);
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, colour);
  gl.uniform1i(program.uniform("picture"), 0);
  gl.uniform2f(program.uniform("size"), width, height);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
}

/** Nothing is blended, tested or left out. */
export function plainState(gl: GL): void {
  for (const what of [gl.BLEND, gl.DEPTH_TEST, gl.CULL_FACE, gl.STENCIL_TEST, gl.SCISSOR_TEST, gl.DITHER]) gl.disable(what);
  gl.colorMask(true, true, true, true);
  gl.depthMask(false);
}

/** Lets go of textures, buffers and programs that are bound. */
export function unbind(gl: GL): void {
  for (let unit = 15; unit >= 0; unit--) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.bindTexture(gl.TEXTURE_3D, null);
  }
  gl.bindVertexArray(null);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.useProgram(null);
}
