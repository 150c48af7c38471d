/** Finds the vertices of a level or a layer, which come brick by brick, by their coordinates in the grid. */
import type { Level, Vec3, Vertices } from "./level";

export class Stored {
  /** [bricks that hold vertices, B^3]: the vertex at each place, or -1; and of each brick its number in this, or -1. */
  private readonly slots: Int32Array;
  private readonly numbers: Int32Array;

  /** `dims` bricks of `brick` vertices an edge, from brick `low` on. */
  constructor(
    readonly vertices: Vertices,
    private readonly brick: number,
    private readonly low: Vec3,
    private readonly dims: Vec3,
  ) {
    const size = brick ** 3;
    const { bricks, masks } = vertices;
    this.numbers = new Int32Array(bricks.length).fill(-1);
    this.slots = new Int32Array((masks.length / (size / 8)) * size).fill(-1);
    let held = 0;
    bricks.forEach((is, n) => {
      if (is) this.numbers[n] = held++;
    });
    let slot = 0;
    for (let n = 0; n < this.slots.length; n++) if ((masks[n >> 3] >> (n & 7)) & 1) this.slots[n] = slot++;
  }

  static ofLevel(level: Level): Stored {
    const { brick } = level.field;
    return new Stored(
      level,
      brick,
      [0, 0, 0],
      level.header.resolution.map((n) => Math.ceil(n / brick)) as Vec3,
    );
  }

  /** The vertex at grid coordinates; -1 where none is stored. */
  slot(x: number, y: number, z: number): number {
    const { brick, low, dims } = this;
    const bx = Math.floor(x / brick) - low[0];
    const by = Math.floor(y / brick) - low[1];
    const bz = Math.floor(z / brick) - low[2];
    if (bx < 0 || by < 0 || bz < 0 || bx >= dims[0] || by >= dims[1] || bz >= dims[2]) return -1;
    const number = this.numbers[(bx * dims[1] + by) * dims[2] + bz];
    return number < 0
      ? -1
      : this.slots[((number * brick + (x % brick)) * brick + (y % brick)) * brick + (z % brick)];
  }
}
