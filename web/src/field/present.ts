/** Full-screen drawing: the triangle, and the state of the context before and after. */
type GL = WebGL2RenderingContext;

/** Vertex shader of a triangle that covers the image, without attributes. */
export const FULL_SCREEN_TRIANGLE = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;

/** Disables blending, tests and masks. */
export function resetState(gl: GL): void {
  for (const what of [gl.BLEND, gl.DEPTH_TEST, gl.CULL_FACE, gl.STENCIL_TEST, gl.SCISSOR_TEST, gl.DITHER])
    gl.disable(what);
  gl.colorMask(true, true, true, true);
  gl.depthMask(false);
}

/** Unbinds textures, buffers and programs. */
export function unbindAll(gl: GL): void {
  for (let unit = 15; unit >= 0; unit--) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.bindTexture(gl.TEXTURE_3D, null);
  }
  gl.bindVertexArray(null);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.useProgram(null);
}
