/** The splats that have arrived: on the page, to sort and to restore them, and on the GPU. */
import { TooLarge } from "../field/atlas";
import type { SplatSet } from "./depth_order";
import { OUTPUTS } from "./project_glsl";
import { harmonicWords, RECORD } from "./splat_file";
import type { SplatHeader, SplatLevel } from "./splat_file";
import { WordTexture } from "./splat_textures";

type GL = WebGL2RenderingContext;

/** Bytes of a projected splat, with its normal, and of its number in the order. */
export const PROJECTED = 16 * (OUTPUTS + 1) + 4;

export class SplatStore {
  /** The splats as they are without edits. */
  set: SplatSet;
  records: WordTexture;
  harmonics: WordTexture;
  /** Bytes that they take of the GPU when all are there, drawn. */
  readonly bytes: number;
  private readonly means: Float32Array<ArrayBuffer>;
  private readonly words: Uint32Array<ArrayBuffer>;
  private readonly harmonicWords: Uint32Array<ArrayBuffer>;

  /** Throws `TooLarge` where the splats take more than `limit` bytes of the GPU. */
  constructor(
    private readonly gl: GL,
    readonly header: SplatHeader,
    limit: number,
  ) {
    const { count, degree } = header;
    const coefficients = harmonicWords(degree);
    this.bytes = (4 * (RECORD + coefficients) + PROJECTED) * count;
    if (this.bytes > limit)
      throw new TooLarge(
        `the splats take ${Math.ceil(this.bytes / 2 ** 20)} MiB of the GPU, more than the ${Math.floor(limit / 2 ** 20)} allowed`,
      );
    this.means = new Float32Array(3 * count);
    this.words = new Uint32Array(RECORD * count);
    this.harmonicWords = new Uint32Array(coefficients * count);
    this.set = { means: this.means.subarray(0, 0), hidden: null, changed: null };
    this.records = new WordTexture(gl, this.words.length);
    this.harmonics = new WordTexture(gl, this.harmonicWords.length);
  }

  /** Splats that can be drawn. */
  get count(): number {
    return this.set.means.length / 3;
  }

  get isWhole(): boolean {
    return this.count === this.header.count;
  }

  /** Adds the splats of a level; nothing where it is not wanted any more when it lies on the GPU. */
  async take(level: SplatLevel, wanted: () => boolean): Promise<void> {
    this.means.set(level.means, 3 * level.first);
    this.words.set(level.records, RECORD * level.first);
    this.harmonicWords.set(level.harmonics, harmonicWords(level.header.degree) * level.first);
    await this.upload(level.first, level.first + level.count, wanted);
  }

  /** Uploads the splats again, after the context was lost and restored. */
  async restore(wanted: () => boolean): Promise<void> {
    const { count } = this;
    this.records = new WordTexture(this.gl, this.words.length);
    this.harmonics = new WordTexture(this.gl, this.harmonicWords.length);
    this.set = { ...this.set, means: this.means.subarray(0, 0) };
    await this.upload(0, count, wanted);
  }

  dispose(): void {
    this.records.dispose();
    this.harmonics.dispose();
  }

  private async upload(first: number, end: number, wanted: () => boolean): Promise<void> {
    const coefficients = harmonicWords(this.header.degree);
    await this.records.put(this.words, RECORD * first, RECORD * end, wanted);
    if (wanted())
      await this.harmonics.put(this.harmonicWords, coefficients * first, coefficients * end, wanted);
    if (wanted()) this.set = { means: this.means.subarray(0, 3 * end), hidden: null, changed: null };
  }
}
