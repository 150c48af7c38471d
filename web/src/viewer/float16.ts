/** Conversion and interpolation of 16-bit floats. */

const COUNT = 65536;

let cachedValues: Float32Array | null = null;

/** The values [65536] of all 16-bit floats, by their bits; infinities and NaN are not represented. */
function decodingTable(): Float32Array {
  if (cachedValues) return cachedValues;
  cachedValues = new Float32Array(COUNT);
  for (let code = 0; code < COUNT; code++) {
    const exponent = (code >> 10) & 31;
    const fraction = code & 1023;
    const size = exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
    cachedValues[code] = code & 0x8000 ? -size : size;
  }
  return cachedValues;
}

const number = new Float32Array(1);
const bits = new Uint32Array(number.buffer);

/** Bits of the nearest 16-bit float to a number of magnitude below 65504. */
export function encodeFloat16(value: number): number {
  number[0] = value;
  const sign = (bits[0] >>> 16) & 0x8000;
  const size = bits[0] & 0x7fffffff;
  // Normal numbers round to even; smaller ones are multiples of 2^-24.
  if (size >= 0x38800000) return sign | ((size - 0x38000000 + 0xfff + ((size >>> 13) & 1)) >>> 13);
  return sign | Math.round(Math.abs(value) * 2 ** 24);
}

/** Linear interpolation of 16-bit floats, a share of the way from `one` to `other`. */
export function mixFloat16(one: Uint16Array, other: Uint16Array, share: number): Uint16Array {
  const values = decodingTable();
  const out = new Uint16Array(one.length);
  for (let n = 0; n < out.length; n++) {
    const value = values[one[n]];
    out[n] = encodeFloat16(value + share * (values[other[n]] - value));
  }
  return out;
}
