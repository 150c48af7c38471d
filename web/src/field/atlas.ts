/**
 * A level's bricks as they lie in 3D textures: (B + 1)^3 texels each, the last of an axis those of the brick behind it,
 * so that the GPU interpolates without looking elsewhere. Textures have z of the field along their x.
 */
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
  count: number;
  /** [dims, 4]: place in the atlas, and 255; 0 where nothing is. z of the field fastest. */
  index: Uint8Array;
  /** [count] linear numbers of the bricks, in the order of their places. */
  bricks: Int32Array;
  /** RGBA textures of colour. */
  colours: number;
}

export class TooLarge extends Error {}

/** The layout of a level; throws `TooLarge` where textures of at most `side` texels an edge do not hold it. */
export function layoutOf(level: Level, side: number): Layout {
  const brick = level.field.brick;
  const edge = brick + 1;
  const dims = level.header.resolution.map((n) => Math.ceil((n - 1) / brick)) as Vec3;
  const bricks = occupiedBricks(level, dims);
  const most = Math.min(255, Math.floor(side / edge));
  const first = Math.min(most, Math.max(1, Math.ceil(Math.cbrt(bricks.length))));
  const second = Math.min(most, Math.max(1, Math.ceil(Math.sqrt(bricks.length / first))));
  const third = Math.max(1, Math.ceil(bricks.length / (first * second)));
  if (third > most) throw new TooLarge(`${bricks.length} bricks do not fit into textures of ${side} texels an edge`);
  const index = new Uint8Array(4 * dims[0] * dims[1] * dims[2]);
  for (const [n, number] of bricks.entries()) {
    index.set([n % first, Math.floor(n / first) % second, Math.floor(n / (first * second)), 255], 4 * number);
  }
  const colours = Math.ceil((3 * level.header.steps.length) / 4);
  return { brick, edge, dims, across: [first, second, third], count: bricks.length, index, bricks, colours };
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
          held[(Math.floor(x / share) * dims[1] + Math.floor(y / share)) * dims[2] + Math.floor(z / share)] = 1;
  return Int32Array.from(held.keys()).filter((number) => held[number] === 1);
}

/** A layer of bricks of the atlas: what is uploaded at a time. */
export interface Layer {
  density: Uint16Array;
  colours: Uint8Array[];
}

/** Fills layers of an atlas. */
export class Filler {
  /** [wire bricks, B^3]: the vertex at each place, or -1; for each wire brick its number in this, or -1. */
  private readonly slots: Int32Array;
  private readonly numbers: Int32Array;
  private readonly wire: Vec3;

  constructor(
    private readonly level: Level,
    private readonly layout: Layout,
  ) {
    const { brick } = layout;
    this.wire = level.header.resolution.map((n) => Math.ceil(n / brick)) as Vec3;
    const size = brick ** 3;
    this.numbers = new Int32Array(level.bricks.length).fill(-1);
    this.slots = new Int32Array((level.masks.length / (size / 8)) * size).fill(-1);
    let held = 0;
    level.bricks.forEach((is, n) => {
      if (is) this.numbers[n] = held++;
    });
    let slot = 0;
    for (let n = 0; n < this.slots.length; n++) if ((level.masks[n >> 3] >> (n & 7)) & 1) this.slots[n] = slot++;
  }

  /** The layer at a place along the textures' z. */
  layer(place: number): Layer {
    const { across, edge, count, colours, bricks } = this.layout;
    const texels = across[0] * across[1] * edge ** 3;
    const layer: Layer = {
      density: new Uint16Array(texels),
      colours: Array.from({ length: colours }, () => new Uint8Array(4 * texels).fill(128)),
    };
    const first = place * across[0] * across[1];
    const found = new Int32Array(edge ** 3);
    for (let n = first; n < Math.min(count, first + across[0] * across[1]); n++) {
      this.vertices(bricks[n], found);
      this.put(layer, n - first, found);
    }
    return layer;
  }

  /** Writes the vertices of a brick, -1 where there is none, x slowest. */
  private vertices(number: number, found: Int32Array): void {
    const { dims, brick, edge } = this.layout;
    const at = [Math.floor(number / (dims[1] * dims[2])), Math.floor(number / dims[2]) % dims[1], number % dims[2]];
    let n = 0;
    for (let x = 0; x < edge; x++)
      for (let y = 0; y < edge; y++)
        for (let z = 0; z < edge; z++, n++) {
          const bx = x < brick ? at[0] : at[0] + 1;
          const by = y < brick ? at[1] : at[1] + 1;
          const bz = z < brick ? at[2] : at[2] + 1;
          found[n] = -1;
          if (bx >= this.wire[0] || by >= this.wire[1] || bz >= this.wire[2]) continue;
          const wire = this.numbers[(bx * this.wire[1] + by) * this.wire[2] + bz];
          if (wire >= 0) found[n] = this.slots[((wire * brick + (x % brick)) * brick + (y % brick)) * brick + (z % brick)];
        }
  }

  private put(layer: Layer, n: number, found: Int32Array): void {
    const { across, edge } = this.layout;
    const { density, sh, header } = this.level;
    const width = across[0] * edge;
    const plane = width * across[1] * edge;
    const corner = (n % across[0]) * edge + Math.floor(n / across[0]) * edge * width;
    const rows = 3 * header.steps.length;
    let v = 0;
    for (let x = 0; x < edge; x++)
      for (let y = 0; y < edge; y++)
        for (let z = 0; z < edge; z++, v++) {
          const slot = found[v];
          if (slot < 0) continue;
          const texel = corner + x * plane + y * width + z;
          layer.density[texel] = density[slot];
          for (let row = 0; row < rows; row++) layer.colours[row >> 2][4 * texel + (row & 3)] = sh[row * header.vertices + slot];
        }
  }
}
