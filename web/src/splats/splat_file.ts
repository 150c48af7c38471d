/** Files of splats (see `cagefield.pages.page_splats`), converted to the records of the GPU. */
import type { Vec3 } from "../field/level";
import { ByteReader, PageFile } from "../field/page_file";
import type { Bytes, OnArrival } from "../field/page_file";

export const MAGIC = "cagespla";
const VERSION = 1;

const CHUNK_SPLATS = 256;

/**
 * Number of 32-bit words in a splat's record: the floats of the mean, base color, rotation, opacity, scales.
 */
export const RECORD_WORDS = 8;

/** Splats near each other in a file of their own; see `cagefield.pages.page_nodes`. */
export interface SplatNode {
  count: number;
  /** The splats [first, end) of the coarse level that stand for the node until it has arrived. */
  coarse: [number, number];
  bounds: [Vec3, Vec3];
  url: string;
  bytes: number;
}

export interface SplatHeader {
  count: number;
  degree: number;
  antialiased: boolean;
  bounds: [Vec3, Vec3];
  /** The point to which means are relative. */
  center: Vec3;
  /** The smallest depth at which splats are drawn. */
  near: number;
  background: Vec3 | null;
  /** Logarithms of scales for the codes 0 and 65535. */
  log_scales: [number, number];
  color_step: number;
  /** Color coefficient of one step of the 8-bit values, from degree 1 on. */
  steps: number[];
  /** Number of splats up to the end of each level. */
  levels: number[];
  /** Nodes with the details of the coarse level; absent without levels of detail. */
  nodes?: SplatNode[];
  /** Maximum number of splats in memory, the coarse level's too; absent where the GPU's memory alone limits it. */
  budget?: number;
}

/** The splats of a level, numbered from `first` on. */
export interface SplatLevel {
  header: SplatHeader;
  first: number;
  count: number;
  last: boolean;
  /** [count, 3] */
  means: Float32Array<ArrayBuffer>;
  /** [count, RECORD] */
  records: Uint32Array<ArrayBuffer>;
  /** [count, harmonicWords(degree)]: coefficient k of channel c from degree 1 on is byte 3 (k - 1) + c. */
  harmonics: Uint32Array<ArrayBuffer>;
}

/** Number of 32-bit words for a splat's coefficients from degree 1 on, padded to texels of four. */
export function harmonicWords(degree: number): number {
  return 4 * Math.ceil((3 * ((degree + 1) ** 2 - 1)) / 16);
}

/** The levels of a file in the order of their arrival; each adds splats to the earlier ones. */
export async function* readSplatLevels(
  source: ReadableStream<Bytes> | ArrayBuffer,
  onHeader: (header: SplatHeader) => void,
  onArrival?: OnArrival,
): AsyncGenerator<SplatLevel> {
  const reader = new ByteReader(source, onArrival);
  try {
    const file = await PageFile.open<SplatHeader>(reader, MAGIC, VERSION);
    const { header } = file;
    onHeader(header);
    let first = 0;
    for (const [number, end] of header.levels.entries()) {
      const count = end - first;
      const bytes = async (name: string): Promise<Uint8Array> =>
        (await file.read(`${number}.${name}`)) as Uint8Array;
      const chunks = (await file.read(`${number}.chunks`)) as Float32Array;
      const means = decodeMeans(chunks, await bytes("means"), count);
      const rotations = await bytes("rotations");
      const scales = await bytes("scales");
      const opacities = await bytes("opacities");
      const colors = await bytes("colors");
      const records = encodeRecords(
        means,
        joinHighLowBytes(rotations),
        joinHighLowBytes(scales),
        joinHighLowBytes(opacities),
        joinHighLowBytes(colors),
      );
      const harmonics = packHarmonics(await bytes("sh"), count, header.degree);
      yield {
        header,
        first,
        count,
        last: number === header.levels.length - 1 && !header.nodes,
        means,
        records,
        harmonics,
      };
      first = end;
    }
  } finally {
    reader.cancel();
  }
}

/** 16-bit numbers from a plane of high bytes and a plane of low bytes. */
export function joinHighLowBytes(planes: Uint8Array): Uint16Array {
  const count = planes.length / 2;
  const out = new Uint16Array(count);
  for (let n = 0; n < count; n++) out[n] = (planes[n] << 8) | planes[count + n];
  return out;
}

/** Means [count, 3] from the bounds [C, 2, 3] of chunks and bytes [B, 3, count], high bytes first. */
export function decodeMeans(
  chunks: Float32Array,
  planes: Uint8Array,
  count: number,
): Float32Array<ArrayBuffer> {
  const bytes = planes.length / (3 * count);
  const most = 256 ** bytes - 1;
  const out = new Float32Array(3 * count);
  for (let n = 0; n < count; n++) {
    const chunk = 6 * Math.floor(n / CHUNK_SPLATS);
    for (let axis = 0; axis < 3; axis++) {
      let whole = 0;
      for (let byte = 0; byte < bytes; byte++) whole = 256 * whole + planes[(3 * byte + axis) * count + n];
      const low = chunks[chunk + axis];
      out[3 * n + axis] = low + ((chunks[chunk + 3 + axis] - low) * whole) / most;
    }
  }
  return out;
}

function encodeRecords(
  means: Float32Array<ArrayBuffer>,
  rotations: Uint16Array,
  scales: Uint16Array,
  opacities: Uint16Array,
  colors: Uint16Array,
): Uint32Array<ArrayBuffer> {
  const count = opacities.length;
  const bits = new Uint32Array(means.buffer);
  const out = new Uint32Array(RECORD_WORDS * count);
  for (let n = 0; n < count; n++) {
    const at = RECORD_WORDS * n;
    out[at] = bits[3 * n];
    out[at + 1] = bits[3 * n + 1];
    out[at + 2] = bits[3 * n + 2];
    out[at + 3] = colors[n] | (colors[count + n] << 16);
    out[at + 4] = rotations[n] | (rotations[count + n] << 16);
    out[at + 5] = rotations[2 * count + n] | (opacities[n] << 16);
    out[at + 6] = scales[n] | (scales[count + n] << 16);
    out[at + 7] = scales[2 * count + n] | (colors[2 * count + n] << 16);
  }
  return out;
}

function packHarmonics(rows: Uint8Array, count: number, degree: number): Uint32Array<ArrayBuffer> {
  const stride = 4 * harmonicWords(degree);
  const out = new Uint8Array(stride * count);
  const terms = 3 * ((degree + 1) ** 2 - 1);
  for (let term = 0; term < terms; term++) {
    for (let n = 0; n < count; n++) out[stride * n + term] = rows[count * term + n];
  }
  return new Uint32Array(out.buffer);
}
