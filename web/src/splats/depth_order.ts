/** Depth order of splats, far to near, by a radix sort; runs in the page or in a worker. */

/** The drawn splats: those of the field that are not hidden, and changed ones, numbered from `count` on. */
export interface SplatSet {
  /** [count, 3] */
  means: Float32Array;
  /** [count], 1 for a hidden splat; null if none is hidden. */
  hidden: Uint8Array | null;
  /** [M, 3], NaN for a splat that cannot be drawn yet; null if none is changed. */
  changed: Float32Array | null;
}

/** Depth function axis . mean + offset; splats nearer than `near` > 0 are not drawn. */
export interface Depths {
  axis: readonly [number, number, number];
  offset: number;
  near: number;
}

const RADIX = 1 << 16;

/** Numbers of the splats at a depth of at least `near`, far to near; higher numbers first at equal depths. */
export function depthOrder(set: SplatSet, depths: Depths): Uint32Array<ArrayBuffer> {
  const { means, hidden, changed } = set;
  const [x, y, z] = depths.axis;
  const { offset, near } = depths;
  const own = means.length / 3;
  const most = own + (changed ? changed.length / 3 : 0);
  const keys = new Float32Array(most);
  const bits = new Uint32Array(keys.buffer);
  const numbers = new Uint32Array(most);
  let count = 0;
  for (let n = 0; n < own; n++) {
    if (hidden !== null && hidden[n] === 1) continue;
    const depth = x * means[3 * n] + y * means[3 * n + 1] + z * means[3 * n + 2] + offset;
    if (depth < near) continue;
    keys[count] = depth;
    numbers[count++] = n;
  }
  if (changed !== null) {
    for (let n = own; n < most; n++) {
      const at = 3 * (n - own);
      const depth = x * changed[at] + y * changed[at + 1] + z * changed[at + 2] + offset;
      if (!(depth >= near)) continue;
      keys[count] = depth;
      numbers[count++] = n;
    }
  }
  // Positive floats are in the order of their bits: sorted by the low half first, then by the high half, descending.
  const places = new Uint32Array(RADIX);
  const between = new Uint32Array(count);
  const order = new Uint32Array(count);
  for (let n = 0; n < count; n++) places[bits[n] & 65535]++;
  let sum = 0;
  for (let value = RADIX - 1; value >= 0; value--) {
    const here = places[value];
    places[value] = sum;
    sum += here;
  }
  for (let n = count - 1; n >= 0; n--) between[places[bits[n] & 65535]++] = n;
  places.fill(0);
  for (let n = 0; n < count; n++) places[bits[n] >>> 16]++;
  sum = 0;
  for (let value = RADIX - 1; value >= 0; value--) {
    const here = places[value];
    places[value] = sum;
    sum += here;
  }
  for (let n = 0; n < count; n++) {
    const splat = between[n];
    order[places[bits[splat] >>> 16]++] = numbers[splat];
  }
  return order;
}
