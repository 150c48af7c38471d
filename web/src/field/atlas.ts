/**
 * Brick atlas: the bricks of a level in 3D textures. A brick has (B + 1)^3 texels and shares the last texels of each axis
 * with the next brick, so that the GPU interpolates within one brick. The x axis of a texture is the z axis of the field.
 */
import { VertexIndex } from "./quantized_vertices";
import type { Level, Vec3 } from "./level";

/** Layout of the bricks of a level in an atlas. */
export interface AtlasLayout {
  /** Number of cells, and of texels, along the edge of a brick. */
  brick: number;
  edge: number;
  /** Number of bricks of cells along x, y and z of the field. */
  dims: Vec3;
  /** Number of bricks along x, y and z of the textures. */
  atlasBricks: Vec3;
  /** Number of bricks of the level, which come first in the textures; bricks of layers follow. */
  count: number;
  /** [dims, 4]: position in the atlas, and 255; 0 for an empty brick. z of the field fastest. */
  index: Uint8Array;
  /** [count] linear indices of the bricks in the field, in the order of the atlas. */
  bricks: Int32Array;
  /** Number of RGBA textures of color. */
  colorTextures: number;
}

export class TooLarge extends Error {}

/**
 * The layout of a level with `spare` more bricks; throws `TooLarge` beyond textures of `side` texels per
 * edge.
 */
export function createLayout(level: Level, side: number, spare = 0): AtlasLayout {
  const brick = level.field.brick;
  const edge = brick + 1;
  const dims = level.header.resolution.map((n) => Math.ceil((n - 1) / brick)) as Vec3;
  const bricks = findOccupiedBricks(level, dims);
  const most = Math.min(255, Math.floor(side / edge));
  const all = bricks.length + spare;
  const first = Math.min(most, Math.max(1, Math.ceil(Math.cbrt(all))));
  const second = Math.min(most, Math.max(1, Math.ceil(Math.sqrt(all / first))));
  const third = Math.max(1, Math.ceil(all / (first * second)));
  if (third > most) throw new TooLarge(`${all} bricks do not fit into textures of ${side} texels an edge`);
  const index = new Uint8Array(4 * dims[0] * dims[1] * dims[2]);
  const across: Vec3 = [first, second, third];
  for (const [n, number] of bricks.entries()) index.set(indexEntry(n, across), 4 * number);
  const colors = Math.ceil((3 * level.header.steps.length) / 4);
  return {
    brick,
    edge,
    dims,
    atlasBricks: across,
    count: bricks.length,
    index,
    bricks,
    colorTextures: colors,
  };
}

/** The index entry of the n-th brick of the textures. */
export function indexEntry(n: number, [first, second]: Vec3): [number, number, number, number] {
  return [n % first, Math.floor(n / first) % second, Math.floor(n / (first * second)), 255];
}

/** Bytes of the textures of a layout. */
export function layoutBytes({
  atlasBricks: across,
  edge,
  colorTextures: colors,
  index,
}: AtlasLayout): number {
  return across[0] * across[1] * across[2] * edge ** 3 * (2 + 4 * colors) + index.length;
}

/** Linear indices of the bricks of cells that are occupied. */
function findOccupiedBricks(level: Level, dims: Vec3): Int32Array {
  const { codes, dims: fine } = level.occupancy;
  const share = level.field.brick / 4;
  const held = new Uint8Array(dims[0] * dims[1] * dims[2]);
  let n = 0;
  for (let x = 0; x < fine[0]; x++)
    for (let y = 0; y < fine[1]; y++)
      for (let z = 0; z < fine[2]; z++, n++)
        if (codes[n] < 256)
          held[(Math.floor(x / share) * dims[1] + Math.floor(y / share)) * dims[2] + Math.floor(z / share)] =
            1;
  return Int32Array.from(held.keys()).filter((number) => held[number] === 1);
}

/** Texels of some bricks, for one upload. */
export interface Texels {
  density: Uint16Array;
  colors: Uint8Array[];
}

/** Conversion of vertices to the texels of bricks; the first source that has a vertex supplies it. */
export class TexelWriter {
  constructor(
    private readonly layout: AtlasLayout,
    private readonly sources: readonly VertexIndex[],
  ) {}

  /** The texels of bricks with the given linear indices, `first` by `second` bricks or fewer. */
  texels(numbers: ArrayLike<number>, first: number, second: number): Texels {
    const { edge, colorTextures: colors, brick, dims } = this.layout;
    const count = first * second * edge ** 3;
    const out: Texels = {
      density: new Uint16Array(count),
      colors: Array.from({ length: colors }, () => new Uint8Array(4 * count).fill(128)),
    };
    const width = first * edge;
    const plane = width * second * edge;
    for (let n = 0; n < numbers.length; n++) {
      const number = numbers[n];
      const at = [
        Math.floor(number / (dims[1] * dims[2])),
        Math.floor(number / dims[2]) % dims[1],
        number % dims[2],
      ];
      const corner = (n % first) * edge + Math.floor(n / first) * edge * width;
      for (let x = 0; x < edge; x++)
        for (let y = 0; y < edge; y++)
          for (let z = 0; z < edge; z++)
            this.putTexel(
              out,
              corner + x * plane + y * width + z,
              at[0] * brick + x,
              at[1] * brick + y,
              at[2] * brick + z,
            );
    }
    return out;
  }

  private putTexel(out: Texels, texel: number, x: number, y: number, z: number): void {
    for (const source of this.sources) {
      const slot = source.slot(x, y, z);
      if (slot < 0) continue;
      const { density, sh } = source.vertices;
      const rows = sh.length / density.length;
      out.density[texel] = density[slot];
      for (let row = 0; row < rows; row++)
        out.colors[row >> 2][4 * texel + (row & 3)] = sh[row * density.length + slot];
      return;
    }
  }
}
