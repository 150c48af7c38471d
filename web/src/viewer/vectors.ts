/** Vectors of three numbers, and camera-to-world matrices row by row. */
export type Vec3 = [number, number, number];

/** a + t b */
export const add = (a: Vec3, b: Vec3, t = 1): Vec3 => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];
export const subtract = (a: Vec3, b: Vec3): Vec3 => add(a, b, -1);
export const scale = (a: Vec3, t: number): Vec3 => [t * a[0], t * a[1], t * a[2]];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a: Vec3): number => Math.hypot(...a);
export const normalize = (a: Vec3): Vec3 => scale(a, 1 / Math.max(1e-30, length(a)));

/** A vector rotated about a unit axis by an angle in radians (Rodrigues). */
export function rotate(v: Vec3, axis: Vec3, angle: number): Vec3 {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(scale(v, c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
}

/** Column 0 to 3 of a camera-to-world matrix: right, up, back, eye. */
export const column = (c2w: readonly number[], n: number): Vec3 => [c2w[n], c2w[4 + n], c2w[8 + n]];

/** The camera-to-world matrix [4,4] of three axes and the eye. */
export function poseMatrix(right: Vec3, up: Vec3, back: Vec3, eye: Vec3): number[] {
  return [0, 1, 2].flatMap((n) => [right[n], up[n], back[n], eye[n]]).concat(0, 0, 0, 1);
}
