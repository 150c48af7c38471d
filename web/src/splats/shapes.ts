/** Decoding of the shapes of splats in files (see `cagefield.pages.page_splats`). */

/** Rotation matrix, row by row, of three numbers of `page_splats.encode_rotations`. */
export function decodeRotation(a: number, b: number, c: number): number[] {
  const left = (a >> 15) | ((b >> 15) << 1);
  const three = [a, b, c].map((code) => ((code & 32767) - 16384) / (16383 * Math.SQRT2));
  const most = Math.sqrt(Math.max(0, 1 - three[0] ** 2 - three[1] ** 2 - three[2] ** 2));
  const [w, x, y, z] = [...three.slice(0, left), most, ...three.slice(left)];
  return [
    1 - 2 * (y * y + z * z),
    2 * (x * y - w * z),
    2 * (x * z + w * y),
    2 * (x * y + w * z),
    1 - 2 * (x * x + z * z),
    2 * (y * z - w * x),
    2 * (x * z - w * y),
    2 * (y * z + w * x),
    1 - 2 * (x * x + y * y),
  ];
}

/** Axes [M, 9], row by row, each column as long as the standard deviation along it: A of a covariance A A^T. */
export function decodeAxes(
  rotations: Uint16Array,
  scales: Uint16Array,
  [low, high]: [number, number],
): Float32Array<ArrayBuffer> {
  const count = rotations.length / 3;
  const out = new Float32Array(9 * count);
  for (let n = 0; n < count; n++) {
    const rotation = decodeRotation(rotations[n], rotations[count + n], rotations[2 * count + n]);
    for (let k = 0; k < 3; k++) {
      const size = Math.exp(low + ((high - low) * scales[k * count + n]) / 65535);
      for (let i = 0; i < 3; i++) out[9 * n + 3 * i + k] = rotation[3 * i + k] * size;
    }
  }
  return out;
}

/** Covariances A A^T [M, 6] (xx, xy, xz, yy, yz, zz) of matrices A [M, 9]. */
export function covariancesFromAxes(axes: Float32Array): Float32Array<ArrayBuffer> {
  const out = new Float32Array((axes.length / 9) * 6);
  for (let n = 0, at = 0; n < axes.length; n += 9) {
    for (let i = 0; i < 3; i++)
      for (let j = i; j < 3; j++) {
        let sum = 0;
        for (let k = 0; k < 3; k++) sum += axes[n + 3 * i + k] * axes[n + 3 * j + k];
        out[at++] = sum;
      }
  }
  return out;
}
