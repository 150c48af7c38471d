/**
 * Targets of blending: color, distance and normal, each times alpha. Formats are float16, or float32 for distances, as far
 * as the GPU can blend them; else 8 bits, in which faint splats and distances are coarse.
 */
type GL = WebGL2RenderingContext;

export interface BlendFormats {
  color: number;
  distance: number;
  /** Whether distances must be scaled to [0, 1]. */
  isByte: boolean;
}

export function chooseFormats(gl: GL): BlendFormats {
  const floats = gl.getExtension("EXT_color_buffer_float");
  if (floats && gl.getExtension("EXT_float_blend"))
    return { color: gl.RGBA16F, distance: gl.R32F, isByte: false };
  if (floats ?? gl.getExtension("EXT_color_buffer_half_float"))
    return { color: gl.RGBA16F, distance: gl.RGBA16F, isByte: false };
  return { color: gl.RGBA8, distance: gl.RGBA8, isByte: true };
}

export class BlendTarget {
  textures: { color: WebGLTexture; distance: WebGLTexture; normal: WebGLTexture | null } | null = null;
  private framebuffer: WebGLFramebuffer | null = null;
  private width = 0;
  private height = 0;

  constructor(
    private readonly gl: GL,
    readonly formats: BlendFormats,
  ) {}

  /** Binds the targets for drawing and clears them, created or resized if necessary. */
  begin(width: number, height: number, normals: boolean): void {
    const { gl, formats } = this;
    if (
      this.textures &&
      (width !== this.width || height !== this.height || (normals && !this.textures.normal))
    )
      this.dispose();
    if (!this.textures) {
      this.width = width;
      this.height = height;
      this.textures = {
        color: this.texture(formats.color),
        distance: this.texture(formats.distance),
        normal: normals ? this.texture(formats.color) : null,
      };
      this.framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
      const { color, distance, normal } = this.textures;
      for (const [n, texture] of [color, distance, normal].entries())
        if (texture)
          gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + n, gl.TEXTURE_2D, texture, 0);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1, ...(normals ? [gl.COLOR_ATTACHMENT2] : [])]);
    gl.viewport(0, 0, width, height);
    for (let n = 0; n < (normals ? 3 : 2); n++) gl.clearBufferfv(gl.COLOR, n, [0, 0, 0, 0]);
  }

  /** Drops the objects of a lost context. */
  forget(): void {
    this.textures = this.framebuffer = null;
  }

  dispose(): void {
    const { gl, textures } = this;
    if (textures)
      for (const texture of Object.values<WebGLTexture | null>(textures)) gl.deleteTexture(texture);
    gl.deleteFramebuffer(this.framebuffer);
    this.forget();
  }

  private texture(format: number): WebGLTexture {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, this.width, this.height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.bindTexture(gl.TEXTURE_2D, null);
    return texture;
  }
}
