/** Splats on the GPU: records and coefficients in textures of whole numbers, four words a texel. */
import { TooLarge } from "../field/atlas";
import { largest, plainUnpacking, setFilter } from "../field/gl";
import { WIDTH } from "./project_glsl";

type GL = WebGL2RenderingContext;

/** Rows that are uploaded before the page may breathe: 4 MB. */
const ROWS = 128;

/** Rows of whole numbers [RGBA32UI]. */
export class WordTexture {
  readonly texture: WebGLTexture;
  private readonly rows: number;

  constructor(
    private readonly gl: GL,
    words: number,
  ) {
    this.rows = Math.max(1, Math.ceil(words / (4 * WIDTH)));
    const most = largest(gl, gl.MAX_TEXTURE_SIZE);
    if (this.rows > most)
      throw new TooLarge(
        `the splats take ${this.rows} rows of a texture, more than the ${most} that the GPU has`,
      );
    while (gl.getError() !== gl.NO_ERROR);
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32UI, WIDTH, this.rows);
    setFilter(gl, gl.TEXTURE_2D, gl.NEAREST);
    gl.bindTexture(gl.TEXTURE_2D, null);
    if (gl.getError() === gl.OUT_OF_MEMORY) {
      this.dispose();
      throw new Error("the GPU has not enough memory for the splats");
    }
  }

  /** Words of a row. */
  readonly stride = 4 * WIDTH;

  /** Uploads the rows that hold words from `first` to `end` of all words. */
  async put(
    words: Uint32Array<ArrayBuffer>,
    first: number,
    end: number,
    wanted: () => boolean,
  ): Promise<void> {
    const { stride } = this;
    for (let row = Math.floor(first / stride); row * stride < end; row += ROWS) {
      if (row * stride > first) await new Promise((done) => setTimeout(done));
      if (!wanted()) return;
      this.putRows(words, row, Math.min(row + ROWS, Math.ceil(end / stride)));
    }
  }

  /** Uploads rows at once. */
  putRows(words: Uint32Array<ArrayBuffer>, row: number, end: number): void {
    const { gl, stride } = this;
    let part = words.subarray(row * stride, end * stride);
    if (part.length < (end - row) * stride) {
      const padded = new Uint32Array((end - row) * stride);
      padded.set(part);
      part = padded;
    }
    plainUnpacking(gl);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, WIDTH, end - row, gl.RGBA_INTEGER, gl.UNSIGNED_INT, part);
    gl.bindTexture(gl.TEXTURE_2D, null);
  }

  dispose(): void {
    this.gl.deleteTexture(this.texture);
  }
}
