/**
 * Shader that projects splats, one texel each: `rendering.splats.kernels.projection.project`, with the names of the kernel.
 *
 * A covariance is F F^T: F = R diag(s) of the field's splats, the Cholesky factor of changed ones. With N = M F, M the
 * derivative of the pixel by the point, the projected covariance is N N^T, and its determinant the square of the cross
 * product of N's rows, which avoids differences of large numbers.
 */
import { defineNumbers } from "../field/gl";
import { SPLAT_CONSTANTS } from "../field/layout";
import { BASIS } from "../field/harmonics_glsl";
import { harmonicWords } from "./splat_file";

/** Number of texels in a row of the textures. */
export const TEXTURE_WIDTH = 2048;

/**
 * Number of texels per projected splat, each with the bits of four floats: place, shape and tint; the normal
 * is extra.
 */
export const PROJECTED_TEXELS = 3;

export interface ProjectVariant {
  degree: number;
  antialiased: boolean;
  normals: boolean;
}

const HEAD = `
uniform usampler2D order;       // numbers of splats, from far to near
uniform uint count;             // numbers in the order
uniform usampler2D records, harmonics, changed;
uniform uint own;               // splats of the field; higher numbers are changed splats
uniform vec3 eye;               // relative to the field's center
uniform mat3 W;                 // rows: x right, y down, z forward
uniform vec2 focal, center, size;
uniform vec4 limits;            // of (x, y) / z: low, high of x, of y
uniform float near, logLow, logStep, colorStep;

// Mean in pixels, x right and y down; A, k of the conic A (x + k y)^2 + D y^2.
layout(location = 0) out uvec4 place;
// D, opacity (0: not shown), distance, its slope along x.
layout(location = 1) out uvec4 shape;
// Color, slope of the distance along y.
layout(location = 2) out uvec4 tint;

${defineNumbers(SPLAT_CONSTANTS)}

uvec4 texel(usampler2D from, uint n) { return texelFetch(from, ivec2(n % ${TEXTURE_WIDTH}u, n / ${TEXTURE_WIDTH}u), 0); }

// The quaternion (w, x, y, z as its y, z, w, x: xyz and w) of three numbers of 15 bits; see page_splats.encode_rotations.
vec4 rotation(uvec2 words) {
  uvec3 codes = uvec3(words.x & 65535u, words.x >> 16, words.y & 65535u);
  uint left = (codes.x >> 15) | (codes.y >> 15) << 1;
  vec3 c = (vec3(codes & 32767u) - 16384.0) / (16383.0 * sqrt(2.0));
  float most = sqrt(max(0.0, 1.0 - dot(c, c)));
  if (left == 0u) return vec4(c, most);
  if (left == 1u) return vec4(most, c.y, c.z, c.x);
  if (left == 2u) return vec4(c.y, most, c.z, c.x);
  return vec4(c.y, c.z, most, c.x);
}

vec3 rotated(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

// The matrix of a changed splat's color: its gains, or a grade; see page_splat_edits.encode_gains and encode_colors.
mat3 colorMatrix(uvec4 words) {
  uint kind = words.x >> 30;
  if (kind == 0u) {
    vec3 gain = exp2((vec3(words.x & 1023u, words.x >> 10 & 1023u, words.x >> 20) - 512.0) / 128.0);
    return mat3(gain.x, 0.0, 0.0, 0.0, gain.y, 0.0, 0.0, 0.0, gain.z);
  }
  uvec4 even = words & 16383u, odd = words >> 14 & 16383u;
  uint last = (words.x >> 28 & 3u) << 12 | (words.w >> 28) << 8 | (words.z >> 28) << 4 | words.y >> 28;
  mat3 codes = mat3(even.x, odd.y, even.w, odd.x, even.z, odd.w, even.y, odd.z, last);
  float range = kind == 1u ? 2.0 : kind == 2u ? 8.0 : 32.0;
  return range / 8191.0 * (codes - mat3(8192, 8192, 8192, 8192, 8192, 8192, 8192, 8192, 8192));
}

mat3 cholesky(float xx, float xy, float xz, float yy, float yz, float zz) {
  float a = sqrt(max(xx, 1e-38));
  float b = xy / a, c = xz / a;
  float d = sqrt(max(yy - b * b, 0.0));
  float e = d > 1e-6 * a ? (yz - b * c) / d : 0.0;
  float f = sqrt(max(zz - c * c - e * e, 0.0));
  return mat3(a, b, c, 0.0, d, e, 0.0, 0.0, f);
}
`;

const MAIN = `
void main() {
  place = shape = tint = uvec4(0u);
#ifdef NORMALS
  normal = uvec4(0u);
#endif
  ivec2 here = ivec2(gl_FragCoord.xy);
  if (uint(here.y * ${TEXTURE_WIDTH} + here.x) >= count) return;
  uint splat = texelFetch(order, here, 0).r;
  uint source = splat;
  vec3 mean;
  mat3 F;
  float o;
  vec4 turn = vec4(0.0, 0.0, 0.0, 1.0);
  float side = 1.0;             // -1 where the turn is that of a reflection, turned over
  mat3 grade = mat3(1.0);
  if (splat < own) {
    uvec4 first = texel(records, 2u * splat), second = texel(records, 2u * splat + 1u);
    mean = uintBitsToFloat(first.xyz);
    o = float(second.y >> 16) / 65535.0;
    vec3 s = exp(logLow + logStep * vec3(second.z & 65535u, second.z >> 16, second.w & 65535u));
    vec4 q = rotation(second.xy);
    F = mat3(s.x * rotated(q, vec3(1, 0, 0)), s.y * rotated(q, vec3(0, 1, 0)), s.z * rotated(q, vec3(0, 0, 1)));
  } else {
    uint n = 4u * (splat - own);
    uvec4 first = texel(changed, n), second = texel(changed, n + 1u), third = texel(changed, n + 2u);
    mean = uintBitsToFloat(first.xyz);
    source = first.w;
    vec4 C = uintBitsToFloat(second);
    F = cholesky(C.x, C.y, C.z, C.w, uintBitsToFloat(third.x), uintBitsToFloat(third.y));
    turn = rotation(third.zw);
    side = (third.w & 32768u) == 0u ? 1.0 : -1.0;
    o = float(third.w >> 16) / 65535.0;
    grade = colorMatrix(texel(changed, n + 3u));
  }
  vec3 offset = mean - eye;
  vec3 p = W * offset;
  if (p.z < near || o <= ALPHA_MIN) return;
  vec2 n = clamp(p.xy / p.z, limits.xz, limits.yw);
  vec3 rowX = vec3(W[0].x, W[1].x, W[2].x), rowY = vec3(W[0].y, W[1].y, W[2].y), rowZ = vec3(W[0].z, W[1].z, W[2].z);
  vec3 N0 = (focal.x / p.z * (rowX - n.x * rowZ)) * F;
  vec3 N1 = (focal.y / p.z * (rowY - n.y * rowZ)) * F;
  float a = dot(N0, N0), b = dot(N0, N1), c = dot(N1, N1);
  vec3 area = cross(N0, N1);
  float sharp = dot(area, area);
  float det = sharp + BLUR * (a + c + BLUR);
  float slopeDet = sharp + SLOPE_BLUR * (a + c + SLOPE_BLUR);
#ifdef ANTIALIASED
  o *= max(LEAST_COMPENSATION, sqrt(sharp / det));
#endif
  float reach = 2.0 * log(o / ALPHA_MIN);
  if (!(reach > 0.0)) return;
  vec2 at = p.xy / p.z * focal + center;
  vec2 extent = sqrt(reach * (vec2(a, c) + BLUR));
  if (any(lessThanEqual(at + extent, vec2(0.0))) || any(greaterThanEqual(at - extent, size))) return;
  place = floatBitsToUint(vec4(at, (c + BLUR) / det, -b / (c + BLUR)));
  float distance = length(offset);
  vec3 d = offset / distance;
  vec3 along = d * F;
  float alongU = dot(along, N0), alongV = dot(along, N1);
  vec2 slope = vec2(alongU * (c + SLOPE_BLUR) - alongV * b, alongV * (a + SLOPE_BLUR) - alongU * b) / slopeDet;
  shape = floatBitsToUint(vec4(1.0 / (c + BLUR), o, distance, slope.x));
#ifdef NORMALS
  vec3 axis = flattest(F);
  normal = floatBitsToUint(vec4(dot(axis, d) > 0.0 ? -axis : axis, 0.0));
#endif
  d = side * rotated(vec4(-turn.xyz, turn.w), d);
  tint = floatBitsToUint(vec4(max(grade * colorOf(source, d), 0.0), slope.y));
}
`;

/** GLSL of the axis of least variance of F F^T, the dominant axis of its adjugate, by power iteration. */
const NORMAL_SOURCE = `
layout(location = 3) out uvec4 normal;
vec3 flattest(mat3 F) {
  mat3 C = F * transpose(F);
  mat3 B = mat3(cross(C[1], C[2]), cross(C[2], C[0]), cross(C[0], C[1]));
  for (int n = 0; n < 8; n++) {
    B /= max(B[0][0] + B[1][1] + B[2][2], 1e-37);
    B = B * B;
  }
  vec3 length2 = vec3(dot(B[0], B[0]), dot(B[1], B[1]), dot(B[2], B[2]));
  vec3 axis = length2.x >= length2.y && length2.x >= length2.z ? B[0] : length2.y >= length2.z ? B[1] : B[2];
  return axis / max(length(axis), 1e-37);
}
`;

/** GLSL of colorOf(splat of the field, canonical unit direction), without the clamp. */
function colorSource(degree: number): string {
  const texels = harmonicWords(degree) / 4;
  const terms = (degree + 1) ** 2;
  const lines = [
    ...(degree > 0 ? [`uniform float steps[${terms - 1}];`] : []),
    "vec3 colorOf(uint splat, vec3 d) {",
    "  uvec2 last = texel(records, 2u * splat + 1u).zw;",
    "  uint both = texel(records, 2u * splat).w;",
    `  vec3 rgb = 0.5 + ${BASIS[0]} * colorStep * (vec3(both & 65535u, both >> 16, last.y >> 16) - 32768.0);`,
    ...Array.from(
      { length: texels },
      (_, n) => `  uvec4 t${n} = texel(harmonics, ${texels}u * splat + ${n}u);`,
    ),
  ];
  for (let k = 1; k < terms; k++) {
    const bytes = [0, 1, 2].map((channel) => {
      const byte = 3 * (k - 1) + channel;
      return `(t${byte >> 4}.${"xyzw"[(byte >> 2) & 3]} >> ${8 * (byte & 3)} & 255u)`;
    });
    lines.push(`  rgb += (steps[${k - 1}] * (${BASIS[k]})) * (vec3(${bytes.join(", ")}) - 128.0);`);
  }
  return [...lines, "  return rgb;", "}"].join("\n");
}

export function projectionShader(variant: ProjectVariant): string {
  return [
    "#version 300 es",
    "precision highp float;",
    "precision highp int;",
    "precision highp usampler2D;",
    ...(variant.antialiased ? ["#define ANTIALIASED"] : []),
    ...(variant.normals ? ["#define NORMALS"] : []),
    HEAD,
    variant.normals ? NORMAL_SOURCE : "",
    colorSource(variant.degree),
    MAIN,
  ].join("\n");
}
