/** Storage of the loaded splats: in memory, for sorting and restoring, and on the GPU. */
import { TooLarge } from "../field/atlas";
import type { SplatSet } from "./depth_order";
import { PROJECTED_TEXELS } from "./project_glsl";
import { harmonicWords, RECORD_WORDS } from "./splat_file";
import type { SplatHeader, SplatLevel, SplatNode } from "./splat_file";
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
  /** Mask of the coarse splats that nodes have replaced, and of places without a node; null before any. */
  private hidden: Uint8Array<ArrayBuffer> | null = null;
  /** First and last splat, exclusive, of each stored node. */
  private readonly places = new Map<SplatNode, [number, number]>();
  /** Whether the stored nodes are others than those of the last set. */
  private isOutdated = false;
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
    const room = Math.min(Math.floor(limit / splatBytes), header.budget ?? Infinity);
    const count = header.nodes ? Math.min(header.count, room) : header.count;
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

  /** Stores the splats of a node from `first` on; `setWithNodes` has them in place of its coarse ones. */
  async storeNode(level: SplatLevel, first: number, node: SplatNode, wanted: () => boolean): Promise<void> {
    const coefficients = harmonicWords(level.header.degree);
    this.means.set(level.means, 3 * first);
    this.words.set(level.records, RECORD_WORDS * first);
    this.harmonicWords.set(level.harmonics, coefficients * first);
    const end = first + level.count;
    await this.records.uploadRange(this.words, RECORD_WORDS * first, RECORD_WORDS * end, wanted);
    await this.harmonics.uploadRange(this.harmonicWords, coefficients * first, coefficients * end, wanted);
    this.stored = Math.max(this.stored, end);
    this.places.set(node, [first, end]);
    this.isOutdated = true;
  }

  /** Leaves a node out: `setWithNodes` has its coarse splats again. Its place may be used once that is drawn. */
  dropNode(node: SplatNode): void {
    this.isOutdated = this.places.delete(node) || this.isOutdated;
  }

  /** The set with all stored nodes in place of their coarse splats; null where it has not changed. */
  setWithNodes(): SplatSet | null {
    if (!this.isOutdated) return null;
    this.isOutdated = false;
    const hidden = new Uint8Array(this.stored);
    hidden.fill(1, this.header.levels[this.header.levels.length - 1]);
    for (const [node, [first, end]] of this.places) {
      hidden.fill(1, ...node.coarse);
      hidden.fill(0, first, end);
    }
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
