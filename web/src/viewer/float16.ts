/** Numbers of 16 bits: their means, number by number. */

let values: Float32Array | null = null;

/** The value of each of the 65536 halves. */
function table(): Float32Array {
  if (values) return values;
  values = new Float32Array(65536);
  for (let half = 0; half < 65536; half++) {
    const exponent = (half >> 10) & 31;
    const fraction = half & 1023;
    const size = exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
    values[half] = half & 0x8000 ? -size : size;
  }
  return values;
}

const number = new Float32Array(1);
const bits = new Uint32Array(number.buffer);

/** The half next to a number whose size is below 65504. */
export function half(value: number): number {
  number[0] = value;
  const sign = (bits[0] >>> 16) & 0x8000;
  const size = bits[0] & 0x7fffffff;
  if (size >= 0x38800000) return sign | ((size - 0x38000000 + 0xfff + ((size >>> 13) & 1)) >>> 13);
  return sign | Math.round(Math.abs(value) * 2 ** 24);
}

/** The value of a half. */
export const valueOf = (half: number): number => table()[half];

/** The halves at a share of the way from `one` to `other`. */
export function mixedHalves(one: Uint16Array, other: Uint16Array, share: number): Uint16Array {
  const known = table();
  const out = new Uint16Array(one.length);
  for (let n = 0; n < out.length; n++) {
    const value = known[one[n]];
    out[n] = half(value + share * (known[other[n]] - value));
  }
  return out;
}
