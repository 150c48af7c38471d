/** Files of splats changed by edits (see `cagefield.pages.page_splat_edits`). */
import { ByteReader, PageFile } from "../field/page_file";
import { decodeAxes, covariancesFromAxes } from "./shapes";
import { decodeMeans, joinHighLowBytes } from "./splat_file";

export const EDITS_MAGIC = "cagesped";
const VERSION = 2;

/**
 * Number of 32-bit words in the record of a changed splat: the floats of the mean, and the splat whose harmonics it has;
 * the floats of the covariance (xx, xy, xz, yy | yz, zz); rotation and opacity; the gain of its color and three unused, or
 * the matrix of a graded color (`encode_colors` in Python).
 */
export const CHANGED_WORDS = 16;

interface EditsHeader {
  /** Number of splats of the edited field. */
  count: number;
  changed: number;
  /** Whether means and shapes are quantized. */
  packed: boolean;
  log_scales: [number, number];
}

export interface SplatEdits {
  count: number;
  /** [count], 1 for a splat that is not drawn in its original state. */
  hidden: Uint8Array<ArrayBuffer>;
  changed: number;
  /** [changed, 3], relative to the field's center. */
  means: Float32Array<ArrayBuffer>;
  /** [changed, CHANGED] */
  records: Uint32Array<ArrayBuffer>;
}

export async function readSplatEdits(source: ArrayBuffer): Promise<SplatEdits> {
  const file = await PageFile.open<EditsHeader>(new ByteReader(source), EDITS_MAGIC, VERSION);
  const { count, changed, packed, log_scales: logs } = file.header;
  const bytes = async (name: string): Promise<Uint8Array> => (await file.read(name)) as Uint8Array;
  const floats = async (name: string): Promise<Float32Array<ArrayBuffer>> =>
    (await file.read(name)) as Float32Array<ArrayBuffer>;
  const hidden = unpackBits(await bytes("hidden"), count);
  const sources = (await file.read("sources")) as Int32Array;
  const means = packed
    ? decodeMeans(await floats("chunks"), await bytes("means"), changed)
    : await floats("means");
  const covariances = packed
    ? covariancesFromAxes(
        decodeAxes(joinHighLowBytes(await bytes("rotations")), joinHighLowBytes(await bytes("scales")), logs),
      )
    : await floats("covariances");
  const opacities = joinHighLowBytes(await bytes("opacities"));
  const turns = joinHighLowBytes(await bytes("turns"));
  const gains = (await file.read("gains")) as Int32Array;
  return {
    count,
    hidden,
    changed,
    means,
    records: encodeChangedRecords(sources, means, covariances, opacities, turns, gains),
  };
}

/** The first `count` bits as 0 or 1, the lowest bit of a byte first. */
export function unpackBits(bits: Uint8Array, count: number): Uint8Array<ArrayBuffer> {
  const out = new Uint8Array(count);
  for (let n = 0; n < count; n++) out[n] = (bits[n >> 3] >> (n & 7)) & 1;
  return out;
}

/**
 * The records of M changed splats: sources [M], means [M, 3], covariances [M, 6], opacities [M], turns [3,
 * M], gains [M], or color matrices [4, M].
 */
export function encodeChangedRecords(
  sources: Int32Array,
  means: Float32Array<ArrayBuffer>,
  covariances: Float32Array<ArrayBuffer>,
  opacities: Uint16Array,
  turns: Uint16Array,
  gains: Int32Array,
): Uint32Array<ArrayBuffer> {
  const changed = sources.length;
  const records = new Uint32Array(CHANGED_WORDS * changed);
  const [mean, covariance] = [new Uint32Array(means.buffer), new Uint32Array(covariances.buffer)];
  for (let n = 0; n < changed; n++) {
    const at = CHANGED_WORDS * n;
    for (let k = 0; k < 3; k++) records[at + k] = mean[3 * n + k];
    records[at + 3] = sources[n];
    for (let k = 0; k < 6; k++) records[at + 4 + k] = covariance[6 * n + k];
    records[at + 10] = turns[n] | (turns[changed + n] << 16);
    records[at + 11] = turns[2 * changed + n] | (opacities[n] << 16);
    for (let k = 0; changed * k < gains.length; k++) records[at + 12 + k] = gains[changed * k + n];
  }
  return records;
}
