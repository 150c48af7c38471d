/** Splats that edits changed, as they come over the wire (see `cagefield.pages.page_splat_edits`). */
import { ByteReader, PageFile } from "../field/page_file";
import { axesOf, covariancesOf } from "./shapes";
import { meansOf, wholes } from "./splat_file";

export const EDITS_MAGIC = "cagesped";
const VERSION = 2;

/**
 * Words of a changed splat's record: the mean's floats, whose harmonics it has; its covariance's floats (xx, xy, xz,
 * yy | yz, zz); its turn and opacity; what its colour is multiplied by, and three that say nothing.
 */
export const CHANGED = 16;

interface EditsHeader {
  /** Splats of the field that was edited. */
  count: number;
  changed: number;
  /** Whether means and shapes are quantised. */
  packed: boolean;
  log_scales: [number, number];
}

export interface SplatEdits {
  count: number;
  /** [count], 1 where a splat is not shown at its own place. */
  hidden: Uint8Array<ArrayBuffer>;
  changed: number;
  /** [changed, 3], less the field's centre. */
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
  const hidden = unpackedBits(await bytes("hidden"), count);
  const sources = (await file.read("sources")) as Int32Array;
  const means = packed
    ? meansOf(await floats("chunks"), await bytes("means"), changed)
    : await floats("means");
  const covariances = packed
    ? covariancesOf(axesOf(wholes(await bytes("rotations")), wholes(await bytes("scales")), logs))
    : await floats("covariances");
  const opacities = wholes(await bytes("opacities"));
  const turns = wholes(await bytes("turns"));
  const gains = (await file.read("gains")) as Int32Array;
  return {
    count,
    hidden,
    changed,
    means,
    records: changedRecords(sources, means, covariances, opacities, turns, gains),
  };
}

/** The first `count` bits, 0 or 1, the lowest of a byte first. */
export function unpackedBits(bits: Uint8Array, count: number): Uint8Array<ArrayBuffer> {
  const out = new Uint8Array(count);
  for (let n = 0; n < count; n++) out[n] = (bits[n >> 3] >> (n & 7)) & 1;
  return out;
}

/** The records of M changed splats: sources [M], means [M, 3], covariances [M, 6], opacities [M], turns [3, M], gains [M]. */
export function changedRecords(
  sources: Int32Array,
  means: Float32Array<ArrayBuffer>,
  covariances: Float32Array<ArrayBuffer>,
  opacities: Uint16Array,
  turns: Uint16Array,
  gains: Int32Array,
): Uint32Array<ArrayBuffer> {
  const changed = sources.length;
  const records = new Uint32Array(CHANGED * changed);
  const [mean, covariance] = [new Uint32Array(means.buffer), new Uint32Array(covariances.buffer)];
  for (let n = 0; n < changed; n++) {
    const at = CHANGED * n;
    for (let k = 0; k < 3; k++) records[at + k] = mean[3 * n + k];
    records[at + 3] = sources[n];
    for (let k = 0; k < 6; k++) records[at + 4 + k] = covariance[6 * n + k];
    records[at + 10] = turns[n] | (turns[changed + n] << 16);
    records[at + 11] = turns[2 * changed + n] | (opacities[n] << 16);
    records[at + 12] = gains[n];
  }
  return records;
}
