/**
 * A level's bricks as they lie in 3D textures: (B + 1)^3 texels each, the last of an axis those of the brick behind it,
 * so that the GPU interpolates without looking elsewhere. Textures have z of the field along their x.
 */
import { Stored } from "./quantized_vertices";
import type { Level, Vec3 } from "./level";

/** Where the bricks of a level lie in an atlas. */
export interface Layout {
  /** Cells along a brick's edge, and texels. */
  brick: number;
  edge: number;
  /** Bricks of cells along x, y and z of the field. */
  dims: Vec3;
  /** Bricks along x, y and z of the textures. */
  across: Vec3;
  /** Bricks of the level, which have the first places; the textures have more for layers. */
  count: number;
  /** [dims, 4]: place in the atlas, and 255; 0 where nothing is. z of the field fastest. */
  index: Uint8Array;
  /** [count] linear numbers of the bricks, in the order of their places. */
  bricks: Int32Array;
  /** RGBA textures of colour. */
  colours: number;
}

export class TooLarge extends Error {}

/** The layout of a level; throws `TooLarge` where textures of at most `side` texels do not hold it and `spare` bricks. */
export function layoutOf(level: Level, side: number, spare = 0): Layout {
  const brick = level.field.brick;
  const edge = brick + 1;
  const dims = level.header.resolution.map((n) => Math.ceil((n - 1) / brick)) as Vec3;
  const bricks = occupiedBricks(level, dims);
  const most = Math.min(255, Math.floor(side / edge));
  const all = bricks.length + spare;
  const first = Math.min(most, Math.max(1, Math.ceil(Math.cbrt(all))));
  const second = Math.min(most, Math.max(1, Math.ceil(Math.sqrt(all / first))));
  const third = Math.max(1, Math.ceil(all / (first * second)));
  if (third > most) throw new TooLarge(`${all} bricks do not fit into textures of ${side} texels an edge`);
  const index = new Uint8Array(4 * dims[0] * dims[1] * dims[2]);
  const across: Vec3 = [first, second, third];
  for (const [n, number] of bricks.entries()) index.set(entryOf(n, across), 4 * number);
  const colours = Math.ceil((3 * level.header.steps.length) / 4);
  return { brick, edge, dims, across, count: bricks.length, index, bricks, colours };
}

/** The entry of an index for the n-th place of textures. */
export function entryOf(n: number, [first, second]: Vec3): [number, number, number, number] {
  return [n % first, Math.floor(n / first) % second, Math.floor(n / (first * second)), 255];
}

/** Bytes of a layout's textures. */
export function bytesOf({ across, edge, colours, index }: Layout): number {
  return across[0] * across[1] * across[2] * edge ** 3 * (2 + 4 * colours) + index.length;
}

/** Numbers of the bricks of cells that the occupancy holds something in. */
function occupiedBricks(level: Level, dims: Vec3): Int32Array {
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

/** What of textures is uploaded at a time. */
export interface Texels {
  density: Uint16Array;
  colours: Uint8Array[];
}

/** Makes the texels of bricks of cells, from vertices of the first that has one. */
export class Filler {
  constructor(
    private readonly layout: Layout,
    private readonly sources: readonly Stored[],
  ) {}

  /** The texels of `first` by `second` bricks, or fewer, of these linear numbers. */
  texels(numbers: ArrayLike<number>, first: number, second: number): Texels {
    const { edge, colours, brick, dims } = this.layout;
    const count = first * second * edge ** 3;
    const out: Texels = {
      density: new Uint16Array(count),
      colours: Array.from({ length: colours }, () => new Uint8Array(4 * count).fill(128)),
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
            this.put(
              out,
              corner + x * plane + y * width + z,
              at[0] * brick + x,
              at[1] * brick + y,
              at[2] * brick + z,
            );
    }
    return out;
  }

  private put(out: Texels, texel: number, x: number, y: number, z: number): void {
    for (const source of this.sources) {
      const slot = source.slot(x, y, z);
      if (slot < 0) continue;
      const { density, sh } = source.vertices;
      const rows = sh.length / density.length;
      out.density[texel] = density[slot];
      for (let row = 0; row < rows; row++)
        out.colours[row >> 2][4 * texel + (row & 3)] = sh[row * density.length + slot];
      return;
    }
  }
}
