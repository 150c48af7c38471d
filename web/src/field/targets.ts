/** Render targets: color, depth as float bits, and normals, in formats that every WebGL2 device draws to. */

type GL = WebGL2RenderingContext;

/** An image read back from the GPU, top row first. */
export interface RenderedImage {
  width: number;
  height: number;
  /** [h, w, 4]: color over the background, and opacity. */
  rgba: Uint8Array;
  /** [h, w]: distances along the rays; infinite for rays that hit nothing. */
  depth: Float32Array;
  /** [h, w, 4]: 127.5 (1 + normal), and opacity; null unless requested. */
  normals: Uint8Array | null;
}

export class RenderTargets {
  width = 1;
  height = 1;
  private textures: { color: WebGLTexture; depth: WebGLTexture; normals: WebGLTexture | null } | null = null;
  private framebuffer: WebGLFramebuffer | null = null;

  constructor(private readonly gl: GL) {}

  /** Color over the background [RGBA8]; null before the first image. */
  get color(): WebGLTexture | null {
    return this.textures?.color ?? null;
  }

  /** 0.5 + 0.5 normal [RGBA8]; null unless the last image has normals. */
  get normals(): WebGLTexture | null {
    return this.textures?.normals ?? null;
  }

  /** Distances [R32UI, bits of floats]. */
  get depth(): WebGLTexture | null {
    return this.textures?.depth ?? null;
  }

  setSize(width: number, height: number): void {
    if (width === this.width && height === this.height) return;
    this.dispose();
    this.width = width;
    this.height = height;
  }

  /** Creates missing targets and binds them for drawing. */
  bind(normals: boolean): void {
    const { gl } = this;
    if (this.textures && normals && !this.textures.normals) this.dispose();
    if (!this.textures) {
      this.textures = {
        color: this.texture(gl.RGBA8, gl.LINEAR),
        depth: this.texture(gl.R32UI, gl.NEAREST),
        normals: normals ? this.texture(gl.RGBA8, gl.NEAREST) : null,
      };
      this.framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
      const { color: color, depth, normals: third } = this.textures;
      for (const [n, texture] of [color, depth, third].entries())
        if (texture)
          gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + n, gl.TEXTURE_2D, texture, 0);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1, ...(normals ? [gl.COLOR_ATTACHMENT2] : [])]);
    gl.viewport(0, 0, this.width, this.height);
  }

  read(normals: boolean): RenderedImage {
    const { gl, width, height } = this;
    const rgba = new Uint8Array(4 * width * height);
    const third = normals && this.textures?.normals ? new Uint8Array(4 * width * height) : null;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.pixelStorei(gl.PACK_ALIGNMENT, 1);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    if (third) {
      gl.readBuffer(gl.COLOR_ATTACHMENT2);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, third);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const depth = flipRows(this.readDepth(), width);
    return {
      width,
      height,
      rgba: flipRows(rgba, 4 * width),
      depth,
      normals: third && flipRows(third, 4 * width),
    };
  }

  /** [h, w]: floats of the bound integer framebuffer, bottom row first. */
  readBits(width: number, height: number): Float32Array {
    const { gl } = this;
    const bits = new Uint32Array(width * height);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.pixelStorei(gl.PACK_ALIGNMENT, 1);
    if (gl.getParameter(gl.IMPLEMENTATION_COLOR_READ_FORMAT) === gl.RED_INTEGER) {
      gl.readPixels(0, 0, width, height, gl.RED_INTEGER, gl.UNSIGNED_INT, bits);
    } else {
      const four = new Uint32Array(4 * width * height);
      gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, four);
      for (let n = 0; n < bits.length; n++) bits[n] = four[4 * n];
    }
    return new Float32Array(bits.buffer);
  }

  /** Waits until the GPU has drawn. */
  wait(): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
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

  private readDepth(): Float32Array {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT1);
    const depth = this.readBits(this.width, this.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return depth;
  }

  private texture(format: number, filter: number): WebGLTexture {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, this.width, this.height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
    gl.bindTexture(gl.TEXTURE_2D, null);
    return texture;
  }
}

/** Reverses the order of rows of `row` numbers, in place. */
function flipRows<T extends Uint8Array | Float32Array>(values: T, row: number): T {
  const rows = values.length / row;
  for (let y = 0; y < rows >> 1; y++) {
    const [low, high] = [y * row, (rows - 1 - y) * row];
    const kept = values.slice(low, low + row);
    values.copyWithin(low, high, high + row);
    values.set(kept, high);
  }
  return values;
}
