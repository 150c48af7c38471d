/** Textures, which grow on demand, of the order of splats and of the projected splats. */
import { resetUnpacking, setFilter } from "../field/gl";
import { PROJECTED_TEXELS, TEXTURE_WIDTH } from "./project_glsl";

type GL = WebGL2RenderingContext;

export class ProjectedTextures {
  /** Numbers of splats [R32UI]. */
  order: WebGLTexture | null = null;
  /** Texels of the projected splats [RGBA32UI]. */
  outputs: WebGLTexture[] = [];
  private framebuffer: WebGLFramebuffer | null = null;
  private rows = 0;

  constructor(private readonly gl: GL) {}

  /** Makes room for `count` splats, with or without normals; true if the order must be uploaded again. */
  reserve(count: number, normals: boolean): boolean {
    const { gl } = this;
    const rows = Math.ceil(count / TEXTURE_WIDTH);
    const outputs = PROJECTED_TEXELS + (normals ? 1 : 0);
    if (rows <= this.rows && outputs <= this.outputs.length) return false;
    const most = Math.max(outputs, this.outputs.length);
    this.rows = Math.max(rows, this.rows);
    this.drop();
    this.order = this.texture(gl.R32UI);
    this.outputs = Array.from({ length: most }, () => this.texture(gl.RGBA32UI));
    this.framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    for (const [n, texture] of this.outputs.entries())
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + n, gl.TEXTURE_2D, texture, 0);
    return true;
  }

  put(numbers: Uint32Array<ArrayBuffer>): void {
    const { gl } = this;
    const whole = Math.floor(numbers.length / TEXTURE_WIDTH);
    const rest = numbers.length - whole * TEXTURE_WIDTH;
    resetUnpacking(gl);
    gl.bindTexture(gl.TEXTURE_2D, this.order);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, TEXTURE_WIDTH, whole, gl.RED_INTEGER, gl.UNSIGNED_INT, numbers);
    if (rest > 0)
      gl.texSubImage2D(
        gl.TEXTURE_2D,
        0,
        0,
        whole,
        rest,
        1,
        gl.RED_INTEGER,
        gl.UNSIGNED_INT,
        numbers,
        whole * TEXTURE_WIDTH,
      );
    gl.bindTexture(gl.TEXTURE_2D, null);
  }

  /** Binds the textures as the target for `count` splats. */
  bind(count: number, normals: boolean): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.drawBuffers(
      this.outputs.map((_, n) => (n < PROJECTED_TEXELS || normals ? gl.COLOR_ATTACHMENT0 + n : gl.NONE)),
    );
    gl.viewport(0, 0, TEXTURE_WIDTH, Math.ceil(count / TEXTURE_WIDTH));
  }

  dispose(): void {
    this.drop();
    this.rows = 0;
  }

  private drop(): void {
    const { gl } = this;
    for (const texture of [this.order, ...this.outputs]) gl.deleteTexture(texture);
    gl.deleteFramebuffer(this.framebuffer);
    this.order = this.framebuffer = null;
    this.outputs = [];
  }

  private texture(format: number): WebGLTexture {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, TEXTURE_WIDTH, this.rows);
    setFilter(gl, gl.TEXTURE_2D, gl.NEAREST);
    gl.bindTexture(gl.TEXTURE_2D, null);
    return texture;
  }
}
