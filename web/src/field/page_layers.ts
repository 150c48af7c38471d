/**
 * Layers of a field in files (see `cagefield.pages.page_layers`), and the index of the field with its layers.
 */
import { indexEntry } from "./atlas";
import type { AtlasLayout } from "./atlas";
import { readValues } from "./level";
import type { Vec3, Vertices } from "./level";
import type { PageFile } from "./page_file";

/** Codes of a layer's bricks of cells: changed, or empty. */
export const OTHER = 1;
export const EMPTY = 2;

/** Vertices in which a layer differs from the field, in a box of bricks. */
export interface Layer extends Vertices {
  /** Digest of the content. */
  key: string;
  /** The first brick, and the number of bricks along each axis. */
  low: Vec3;
  dims: Vec3;
  /** [dims]: 0 for the field's own brick, OTHER or EMPTY. */
  cells: Uint8Array;
}

/**
 * A layer behind the field: the index has its slices `first` to before `end` at an offset of `place` bricks
 * along x.
 */
export interface PlacedLayer {
  layer: Layer;
  place: number;
  first: number;
  end: number;
}

/** The layer with a name in a file. */
export async function readLayer(file: PageFile<unknown>, name: string, key: string): Promise<Layer> {
  const box = [...((await file.read(`${name}.box`)) as Int32Array)];
  const cells = (await file.read(`${name}.cells`)) as Uint8Array;
  const bricks = (await file.read(`${name}.bricks`)) as Uint8Array;
  const masks = (await file.read(`${name}.masks`)) as Uint8Array;
  return {
    key,
    low: box.slice(0, 3) as Vec3,
    dims: box.slice(3) as Vec3,
    cells,
    bricks,
    masks,
    ...(await readValues(file, name)),
  };
}

/** Linear indices, in a layout's grid, of the bricks in which a layer differs from the field. */
export function changedBricks(layer: Layer, { dims }: AtlasLayout): Int32Array {
  return Int32Array.from(brickNumbers(layer, dims, OTHER));
}

/**
 * The index of the field and, behind it along x, of its layers; `places` gives the positions of their bricks.
 */
export function buildLayerIndex(
  layout: AtlasLayout,
  layers: readonly PlacedLayer[],
  places: (layer: Layer) => ArrayLike<number>,
): { dims: Vec3; index: Uint8Array } {
  const { dims, atlasBricks: across } = layout;
  const plane = 4 * dims[1] * dims[2];
  const end = Math.max(dims[0], ...layers.map((each) => each.place + each.end));
  const index = new Uint8Array(end * plane);
  index.set(layout.index);
  for (const { layer, place, ...slices } of layers) {
    const at = place * plane;
    const [from, to] = [Math.max(0, slices.first), Math.min(slices.end, dims[0])].map(
      (slice) => slice * plane,
    );
    index.set(layout.index.subarray(from, to), at + from);
    const own = places(layer);
    let n = 0;
    for (const number of brickNumbers(layer, dims, OTHER))
      index.set(indexEntry(own[n++], across), at + 4 * number);
    for (const number of brickNumbers(layer, dims, EMPTY))
      index.fill(0, at + 4 * number, at + 4 * number + 4);
  }
  return { dims: [end, dims[1], dims[2]], index };
}

function* brickNumbers({ low, dims, cells }: Layer, grid: Vec3, code: number): Generator<number> {
  let n = 0;
  for (let x = low[0]; x < low[0] + dims[0]; x++)
    for (let y = low[1]; y < low[1] + dims[1]; y++)
      for (let z = low[2]; z < low[2] + dims[2]; z++, n++)
        if (cells[n] === code) yield (x * grid[1] + y) * grid[2] + z;
}
