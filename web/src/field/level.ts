/** Levels of a field's file (see `cagefield.pages.page_field`). */
import { ByteReader, PageFile } from "./page_file";
import type { OnArrival, Bytes } from "./page_file";

export type Vec3 = [number, number, number];

/**
 * Grid of occupancy codes, by which rays skip empty space (see `cagefield.rendering.voxels.occupancy`), z
 * fastest.
 */
export interface Occupancy {
  origin: Vec3;
  dims: Vec3;
  codes: Uint16Array;
}

export interface LevelHeader {
  resolution: Vec3;
  vertices: number;
  /** Density, per world unit, of the stored value 1. */
  unit: number;
  /** [K]: color coefficient of one step of the 8-bit values. */
  steps: number[];
  dims: Vec3;
}

export interface FieldHeader {
  bounds: [Vec3, Vec3];
  contracted: boolean;
  step: number;
  background: Vec3 | null;
  brick: number;
  levels: LevelHeader[];
}

/** M vertices, in the order of bricks. */
export interface Vertices {
  bricks: Uint8Array;
  masks: Uint8Array;
  /** [M] float16 bits. */
  density: Uint16Array;
  /** [K, 3, M]; 128 stands for 0. */
  sh: Uint8Array;
}

/** A level of detail of the field. */
export interface Level extends Vertices {
  field: FieldHeader;
  header: LevelHeader;
  /** Whether the level is the finest one. */
  last: boolean;
  occupancy: Occupancy;
}

const MAGIC = "cagepage";
const VERSION = 1;

/** The levels of a field's file in the order of their arrival, from coarse to fine. */
export async function* readLevels(
  source: ReadableStream<Bytes> | ArrayBuffer,
  onArrival?: OnArrival,
): AsyncGenerator<Level> {
  const reader = new ByteReader(source, onArrival);
  try {
    const file = await PageFile.open<FieldHeader>(reader, MAGIC, VERSION);
    for (const [number, header] of file.header.levels.entries()) {
      const bricks = (await file.read(`${number}.bricks`)) as Uint8Array;
      const masks = (await file.read(`${number}.masks`)) as Uint8Array;
      const codes = (await file.read(`${number}.occupancy`)) as Uint16Array;
      const values = await readValues(file, `${number}`);
      yield {
        field: file.header,
        header,
        last: number === file.header.levels.length - 1,
        bricks,
        masks,
        ...values,
        occupancy: { origin: [0, 0, 0], dims: header.dims, codes },
      };
    }
  } finally {
    reader.cancel();
  }
}

/** Decoded densities and colors of vertices. */
export async function readValues(
  file: PageFile<unknown>,
  name: string,
): Promise<{ density: Uint16Array; sh: Uint8Array }> {
  const density = joinBytePlanes((await file.read(`${name}.density`)) as Uint8Array);
  return { density, sh: undoDifferences((await file.read(`${name}.sh`)) as Uint8Array, density.length) };
}

/** 16-bit numbers from a plane of low bytes and a plane of high bytes. */
export function joinBytePlanes(planes: Uint8Array): Uint16Array {
  const count = planes.length / 2;
  const out = new Uint16Array(count);
  for (let n = 0; n < count; n++) out[n] = planes[n] | (planes[count + n] << 8);
  return out;
}

/** Rows of `count` bytes from their differences along a row, in place. */
export function undoDifferences(rows: Uint8Array, count: number): Uint8Array {
  if (count === 0) return rows;
  for (let first = 0; first < rows.length; first += count) {
    let value = 128;
    for (let n = first; n < first + count; n++) rows[n] = value = (value + rows[n]) & 255;
  }
  return rows;
}
