/** Storage of the loaded splats: in memory, for sorting and restoring, and on the GPU. */
import { TooLarge } from "../field/atlas";
import type { SplatSet } from "./depth_order";
import { PROJECTED_TEXELS } from "./project_glsl";
import { harmonicWords, RECORD_WORDS } from "./splat_file";
import type { SplatHeader, SplatLevel } from "./splat_file";
import { WordTexture } from "./splat_textures";

type GL = WebGL2RenderingContext;

/** Bytes of a projected splat with its normal, and of its number in the order. */
export const PROJECTED_BYTES = 16 * (PROJECTED_TEXELS + 1) + 4;

export class SplatStore {
  /** The splats without edits. */
  set: SplatSet;
  records: WordTexture;
  harmonics: WordTexture;
  /** Bytes of GPU memory for all splats of the file, loaded and drawn. */
  readonly bytes: number;
  /** Number of splats that fit. */
  readonly capacity: number;
  /** Number of splats that are stored; those of nodes are drawn from the next `applyNodes` on. */
  private stored = 0;
  /** Mask of the coarse splats that nodes have replaced; null without any. */
  private hidden: Uint8Array<ArrayBuffer> | null = null;
  /** Coarse splats of nodes that are stored and not drawn yet. */
  private readonly waiting: [number, number][] = [];
  private readonly means: Float32Array<ArrayBuffer>;
  private readonly words: Uint32Array<ArrayBuffer>;
  private readonly harmonicWords: Uint32Array<ArrayBuffer>;

  /** Throws `TooLarge` if the splats need more than `limit` bytes of GPU memory. */
  constructor(
    private readonly gl: GL,
    readonly header: SplatHeader,
    limit: number,
  ) {
    const { degree } = header;
    const coefficients = harmonicWords(degree);
    const splatBytes = 4 * (RECORD_WORDS + coefficients) + PROJECTED_BYTES;
    // Nodes without room stay coarse.
    const count = header.nodes ? Math.min(header.count, Math.floor(limit / splatBytes)) : header.count;
    this.capacity = count;
    this.bytes = splatBytes * count;
    if (this.bytes > limit)
      throw new TooLarge(
        `the splats take ${Math.ceil(this.bytes / 2 ** 20)} MiB of the GPU, more than the ${Math.floor(limit / 2 ** 20)} allowed`,
      );
    this.means = new Float32Array(3 * count);
    this.words = new Uint32Array(RECORD_WORDS * count);
    this.harmonicWords = new Uint32Array(coefficients * count);
    this.set = { means: this.means.subarray(0, 0), hidden: null, changed: null };
    this.records = new WordTexture(gl, this.words.length);
    this.harmonics = new WordTexture(gl, this.harmonicWords.length);
  }

  /** Number of splats that can be drawn. */
  get count(): number {
    return this.set.means.length / 3;
  }

  get isWhole(): boolean {
    return this.count === this.header.count;
  }

  /** Adds the splats of a level, unless `wanted` is false after the upload. */
  async take(level: SplatLevel, wanted: () => boolean): Promise<void> {
    this.means.set(level.means, 3 * level.first);
    this.words.set(level.records, RECORD_WORDS * level.first);
    this.harmonicWords.set(level.harmonics, harmonicWords(level.header.degree) * level.first);
    await this.upload(level.first, level.first + level.count, wanted);
  }

  /** Whether a node fits beside those that are stored. */
  hasRoomFor(count: number): boolean {
    return this.stored + count <= this.capacity;
  }

  /** Stores the splats of a node; `applyNodes` draws them in place of its coarse ones. */
  async storeNode(level: SplatLevel, coarse: [number, number], wanted: () => boolean): Promise<void> {
    const first = this.stored;
    const coefficients = harmonicWords(level.header.degree);
    this.means.set(level.means, 3 * first);
    this.words.set(level.records, RECORD_WORDS * first);
    this.harmonicWords.set(level.harmonics, coefficients * first);
    const end = first + level.count;
    await this.records.uploadRange(this.words, RECORD_WORDS * first, RECORD_WORDS * end, wanted);
    await this.harmonics.uploadRange(this.harmonicWords, coefficients * first, coefficients * end, wanted);
    this.stored = end;
    this.waiting.push(coarse);
  }

  /** The set with all stored nodes in place of their coarse splats; null where none is new. */
  setWithNodes(): SplatSet | null {
    if (this.waiting.length === 0) return null;
    const hidden = new Uint8Array(this.stored);
    if (this.hidden) hidden.set(this.hidden);
    for (const [first, end] of this.waiting.splice(0)) hidden.fill(1, first, end);
    this.hidden = hidden;
    return { means: this.means.subarray(0, 3 * this.stored), hidden, changed: null };
  }

  /** Uploads the splats again after the context was lost and restored. */
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
    await this.records.uploadRange(this.words, RECORD_WORDS * first, RECORD_WORDS * end, wanted);
    if (wanted())
      await this.harmonics.uploadRange(this.harmonicWords, coefficients * first, coefficients * end, wanted);
    if (!wanted()) return;
    this.stored = Math.max(this.stored, end);
    this.set = {
      means: this.means.subarray(0, 3 * end),
      hidden: this.hidden?.slice(0, end) ?? null,
      changed: null,
    };
  }
}
