/** What pictures are drawn with: a triangle, and the context's state before and after. */
type GL = WebGL2RenderingContext;

/** A triangle that covers the picture, without attributes. */
export const WHOLE = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;

/** Nothing is blended, tested or left out. */
export function plainState(gl: GL): void {
  for (const what of [gl.BLEND, gl.DEPTH_TEST, gl.CULL_FACE, gl.STENCIL_TEST, gl.SCISSOR_TEST, gl.DITHER])
    gl.disable(what);
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
