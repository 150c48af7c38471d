/**
 * GLSL of colors from spherical harmonics in 8-bit RGBA textures; coefficient k of channel c is component 3 k
 * + c.
 */

/** GLSL of the real spherical harmonics of the unit direction d, equal to `cagefield.fields.sh.sh_basis`. */
export const BASIS = [
  "0.28209479177387814",
  "-0.4886025119029199 * d.y",
  "0.4886025119029199 * d.z",
  "-0.4886025119029199 * d.x",
  "1.0925484305920792 * d.x * d.y",
  "-1.0925484305920792 * d.y * d.z",
  "0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)",
  "-1.0925484305920792 * d.x * d.z",
  "0.5462742152960396 * (d.x * d.x - d.y * d.y)",
  "-0.5900435899266435 * d.y * (3.0 * d.x * d.x - d.y * d.y)",
  "2.890611442640554 * d.x * d.y * d.z",
  "-0.4570457994644658 * d.y * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)",
  "0.3731763325901154 * d.z * (2.0 * d.z * d.z - 3.0 * d.x * d.x - 3.0 * d.y * d.y)",
  "-0.4570457994644658 * d.x * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)",
  "1.445305721320277 * d.z * (d.x * d.x - d.y * d.y)",
  "-0.5900435899266435 * d.x * (d.x * d.x - 3.0 * d.y * d.y)",
  "2.5033429417967046 * d.x * d.y * (d.x * d.x - d.y * d.y)",
  "-1.7701307697799304 * d.y * d.z * (3.0 * d.x * d.x - d.y * d.y)",
  "0.9461746957575601 * d.x * d.y * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)",
  "-0.6690465435572892 * d.y * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))",
  "0.10578554691520431 * (8.0 * d.z * d.z * d.z * d.z - 24.0 * d.z * d.z * (d.x * d.x + d.y * d.y) + 3.0 * (d.x * d.x + d.y * d.y) * (d.x * d.x + d.y * d.y))",
  "-0.6690465435572892 * d.x * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))",
  "0.47308734787878004 * (d.x * d.x - d.y * d.y) * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)",
  "-1.7701307697799304 * d.x * d.z * (d.x * d.x - 3.0 * d.y * d.y)",
  "0.6258357354491761 * (d.x * d.x * (d.x * d.x - 3.0 * d.y * d.y) - d.y * d.y * (3.0 * d.x * d.x - d.y * d.y))",
];

/**
 * GLSL of colorAt(position in the atlas, unit direction), without the clamp, and the number of its textures.
 */
export function harmonicsSource(K: number): { source: string; colors: number } {
  const colors = Math.ceil((3 * K) / 4);
  const lines = [
    `uniform float coefficientSteps[${K}];`,
    ...Array.from({ length: colors }, (_, n) => `uniform sampler3D colorAtlas${n};`),
    "vec3 colorAt(vec3 at, vec3 d) {",
    "  vec3 rgb = vec3(0.5);",
    ...Array.from(
      { length: colors },
      (_, n) => `  vec4 s${n} = 255.0 * textureLod(colorAtlas${n}, at, 0.0) - 128.0;`,
    ),
  ];
  for (let k = 0; k < K; k++) {
    const channels = [0, 1, 2].map((c) => `s${(3 * k + c) >> 2}.${"xyzw"[(3 * k + c) & 3]}`);
    lines.push(`  rgb += (coefficientSteps[${k}] * (${BASIS[k]})) * vec3(${channels.join(", ")});`);
  }
  return { source: [...lines, "  return rgb;", "}"].join("\n"), colors };
}
