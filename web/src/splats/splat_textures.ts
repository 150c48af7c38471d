/** Integer textures of records and coefficients of splats, four 32-bit words per texel. */
import { TooLarge } from "../field/atlas";
import { deviceLimit, resetUnpacking, setFilter } from "../field/gl";
import { TEXTURE_WIDTH } from "./project_glsl";

type GL = WebGL2RenderingContext;

/** Number of rows, 4 MB, uploaded between pauses that keep the page responsive. */
const ROWS_PER_UPLOAD = 128;

/** A texture of 32-bit words [RGBA32UI]. */
export class WordTexture {
  readonly texture: WebGLTexture;
  private readonly rows: number;

  constructor(
    private readonly gl: GL,
    words: number,
  ) {
    this.rows = Math.max(1, Math.ceil(words / (4 * TEXTURE_WIDTH)));
    const most = deviceLimit(gl, gl.MAX_TEXTURE_SIZE);
    if (this.rows > most)
      throw new TooLarge(
        `the splats take ${this.rows} rows of a texture, more than the ${most} that the GPU has`,
      );
    while (gl.getError() !== gl.NO_ERROR);
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32UI, TEXTURE_WIDTH, this.rows);
    setFilter(gl, gl.TEXTURE_2D, gl.NEAREST);
    gl.bindTexture(gl.TEXTURE_2D, null);
    if (gl.getError() === gl.OUT_OF_MEMORY) {
      this.dispose();
      throw new Error("the GPU has not enough memory for the splats");
    }
  }

  /** Number of words in a row. */
  readonly stride = 4 * TEXTURE_WIDTH;

  /** Uploads the rows that hold the words `first` to before `end`. */
  async uploadRange(
    words: Uint32Array<ArrayBuffer>,
    first: number,
    end: number,
    wanted: () => boolean,
  ): Promise<void> {
    const { stride } = this;
    for (let row = Math.floor(first / stride); row * stride < end; row += ROWS_PER_UPLOAD) {
      if (row * stride > first) await new Promise((done) => setTimeout(done));
      if (!wanted()) return;
      this.uploadRows(words, row, Math.min(row + ROWS_PER_UPLOAD, Math.ceil(end / stride)));
    }
  }

  /** Uploads rows without pauses. */
  uploadRows(words: Uint32Array<ArrayBuffer>, row: number, end: number): void {
    const { gl, stride } = this;
    let part = words.subarray(row * stride, end * stride);
    if (part.length < (end - row) * stride) {
      const padded = new Uint32Array((end - row) * stride);
      padded.set(part);
      part = padded;
    }
    resetUnpacking(gl);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texSubImage2D(
      gl.TEXTURE_2D,
      0,
      0,
      row,
      TEXTURE_WIDTH,
      end - row,
      gl.RGBA_INTEGER,
      gl.UNSIGNED_INT,
      part,
    );
    gl.bindTexture(gl.TEXTURE_2D, null);
  }

  dispose(): void {
    this.gl.deleteTexture(this.texture);
  }
}
