/** Index from grid coordinates to the quantized vertices of a level or a layer, which are stored by bricks. */
import type { Level, Vec3, Vertices } from "./level";

export class VertexIndex {
  /** [stored bricks, B^3]: the vertex at each position, or -1; and for each brick its row in `slots`, or -1. */
  private readonly slots: Int32Array;
  private readonly storedBricks: Int32Array;

  /** `dims` bricks of `brick` vertices per edge, from brick `low` on. */
  constructor(
    readonly vertices: Vertices,
    private readonly brick: number,
    private readonly low: Vec3,
    private readonly dims: Vec3,
  ) {
    const size = brick ** 3;
    const { bricks, masks } = vertices;
    this.storedBricks = new Int32Array(bricks.length).fill(-1);
    this.slots = new Int32Array((masks.length / (size / 8)) * size).fill(-1);
    let held = 0;
    bricks.forEach((is, n) => {
      if (is) this.storedBricks[n] = held++;
    });
    let slot = 0;
    for (let n = 0; n < this.slots.length; n++) if ((masks[n >> 3] >> (n & 7)) & 1) this.slots[n] = slot++;
  }

  static fromLevel(level: Level): VertexIndex {
    const { brick } = level.field;
    return new VertexIndex(
      level,
      brick,
      [0, 0, 0],
      level.header.resolution.map((n) => Math.ceil(n / brick)) as Vec3,
    );
  }

  /** The vertex at grid coordinates; -1 without one. */
  slot(x: number, y: number, z: number): number {
    const { brick, low, dims } = this;
    const bx = Math.floor(x / brick) - low[0];
    const by = Math.floor(y / brick) - low[1];
    const bz = Math.floor(z / brick) - low[2];
    if (bx < 0 || by < 0 || bz < 0 || bx >= dims[0] || by >= dims[1] || bz >= dims[2]) return -1;
    const number = this.storedBricks[(bx * dims[1] + by) * dims[2] + bz];
    return number < 0
      ? -1
      : this.slots[((number * brick + (x % brick)) * brick + (y % brick)) * brick + (z % brick)];
  }
}
