/** What a picture is drawn into: colour, depth as the bits of floats, and normals; formats that every WebGL2 draws to. */

type GL = WebGL2RenderingContext;

/** A picture read back, top row first. */
export interface Reading {
  width: number;
  height: number;
  /** [h, w, 4]: colour over the background, and opacity. */
  rgba: Uint8Array;
  /** [h, w]: distances along the rays, infinite where nothing is. */
  depth: Float32Array;
  /** [h, w, 4]: 127.5 (1 + normal), and opacity; null unless wanted. */
  normals: Uint8Array | null;
}

export class Targets {
  width = 1;
  height = 1;
  private textures: { colour: WebGLTexture; depth: WebGLTexture; normals: WebGLTexture | null } | null = null;
  private framebuffer: WebGLFramebuffer | null = null;

  constructor(private readonly gl: GL) {}

  /** Colour over the background [RGBA8]; null before the first picture. */
  get colour(): WebGLTexture | null {
    return this.textures?.colour ?? null;
  }

  /** 0.5 + 0.5 normal [RGBA8]; null unless the last picture had them. */
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

  /** Makes the targets if they are not there, and draws into them from now on. */
  bind(normals: boolean): void {
    const { gl } = this;
    if (this.textures && normals && !this.textures.normals) this.dispose();
    if (!this.textures) {
      this.textures = {
        colour: this.texture(gl.RGBA8, gl.LINEAR),
        depth: this.texture(gl.R32UI, gl.NEAREST),
        normals: normals ? this.texture(gl.RGBA8, gl.NEAREST) : null,
      };
      this.framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
      const { colour, depth, normals: third } = this.textures;
      for (const [n, texture] of [colour, depth, third].entries())
        if (texture)
          gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + n, gl.TEXTURE_2D, texture, 0);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1, ...(normals ? [gl.COLOR_ATTACHMENT2] : [])]);
    gl.viewport(0, 0, this.width, this.height);
  }

  read(normals: boolean): Reading {
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
    const depth = flipped(this.readDepth(), width);
    return {
      width,
      height,
      rgba: flipped(rgba, 4 * width),
      depth,
      normals: third && flipped(third, 4 * width),
    };
  }

  /** [h, w]: floats of the integer framebuffer that is bound, of its size, bottom row first. */
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

  /** Waits until what was drawn is there. */
  wait(): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** Forgets what a lost context had. */
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

/** Rows of so many numbers, put into the opposite order in place. */
function flipped<T extends Uint8Array | Float32Array>(values: T, row: number): T {
  const rows = values.length / row;
  for (let y = 0; y < rows >> 1; y++) {
    const [low, high] = [y * row, (rows - 1 - y) * row];
    const kept = values.slice(low, low + row);
    values.copyWithin(low, high, high + row);
    values.set(kept, high);
  }
  return values;
}
