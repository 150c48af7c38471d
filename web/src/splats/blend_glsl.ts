import { defineNumbers } from "../field/gl";
import { SPLAT_CONSTANTS } from "../field/layout";
import { TEXTURE_WIDTH } from "./project_glsl";

/**
 * Shaders that blend projected splats back to front by the rule of `rendering.splats.kernels.blending`: alpha =
 * o exp(-q / 2), at most ALPHA_MAX, and 0 below ALPHA_MIN. The kernel ends a tile at a transmittance below a thousandth;
 * here all splats are drawn.
 *
 * A quad is the parallelogram |x + k y| <= sqrt(reach / A), |y| <= sqrt(reach / D) around the ellipse q = reach at which
 * alpha is ALPHA_MIN.
 */
const CONSTANTS = defineNumbers(SPLAT_CONSTANTS);

export const QUAD_VERTEX_SHADER = `#version 300 es
${CONSTANTS}
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D places, shapes, tints;
uniform vec2 size;
flat out vec4 where;
flat out vec4 how;
flat out vec4 color;
#ifdef NORMALS
uniform usampler2D normals;
flat out vec3 axis;
#endif
void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  int splat = gl_VertexID / 6, side = gl_VertexID - 6 * splat;
  ivec2 here = ivec2(splat % ${TEXTURE_WIDTH}, splat / ${TEXTURE_WIDTH});
  how = uintBitsToFloat(texelFetch(shapes, here, 0));
  if (how.y <= 0.0) return;
  where = uintBitsToFloat(texelFetch(places, here, 0));
  color = uintBitsToFloat(texelFetch(tints, here, 0));
#ifdef NORMALS
  axis = uintBitsToFloat(texelFetch(normals, here, 0)).xyz;
#endif
  float reach = 2.0 * log(how.y / ALPHA_MIN);
  // Two triangles: corners 0 1 2 and 3 2 1.
  int number = side < 3 ? side : 6 - side;
  vec2 corner = vec2(float(number & 1), float(number >> 1)) * 2.0 - 1.0;
  vec2 at = corner * (sqrt(reach / vec2(where.z, how.x)) + 0.01);
  at = where.xy + vec2(at.x - where.w * at.y, at.y);
  gl_Position = vec4(2.0 * at.x / size.x - 1.0, 1.0 - 2.0 * at.y / size.y, 0.0, 1.0);
}`;

export const SPLAT_FRAGMENT_SHADER = `#version 300 es
${CONSTANTS}
precision highp float;
flat in vec4 where;
flat in vec4 how;
flat in vec4 color;
uniform vec2 size;
uniform float unit;                 // of distances
layout(location = 0) out vec4 outColor;
layout(location = 1) out vec4 outDepth;
#ifdef NORMALS
flat in vec3 axis;
layout(location = 2) out vec4 outNormal;
#endif
void main() {
  vec2 d = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) - where.xy;
  float l = d.x + where.w * d.y;
  float q = where.z * l * l + how.x * d.y * d.y;
  float a = min(how.y * exp(-0.5 * q), ALPHA_MAX);
  if (a < ALPHA_MIN) discard;
  outColor = vec4(a * color.rgb, a);
  outDepth = vec4(a * unit * (how.z + how.w * d.x + color.w * d.y), 0.0, 0.0, a);
#ifdef NORMALS
  outNormal = vec4(a * (0.5 + 0.5 * axis), a);
#endif
}`;

/** Final pass: colors over the background, depth as float bits, normals of 8 bits. */
export const RESOLVE_SHADER = `#version 300 es
precision highp float;
precision highp int;
uniform sampler2D gathered, distances;
uniform vec3 background;
uniform float unit;
layout(location = 0) out vec4 outColor;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
uniform sampler2D axes;
layout(location = 2) out vec4 outNormal;
#endif
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(gathered, at, 0);
  outColor = eightBits(vec4(sum.rgb + (1.0 - sum.a) * background, sum.a));
  float distance = texelFetch(distances, at, 0).r / unit;
  outDepth = floatBitsToUint(sum.a > 1e-6 ? distance / sum.a : intBitsToFloat(0x7f800000));
#ifdef NORMALS
  vec4 both = texelFetch(axes, at, 0);
  vec3 normal = 2.0 * both.rgb - both.a;
  float length_ = length(normal);
  outNormal = eightBits(vec4(length_ > 1e-3 ? 0.5 + 0.5 * normal / length_ : vec3(0.5), sum.a));
#endif
}`;

/** The source of a shader with definitions after its first line. */
export function withDefines(source: string, defines: readonly string[]): string {
  const end = source.indexOf("\n") + 1;
  return source.slice(0, end) + defines.map((name) => `#define ${name}\n`).join("") + source.slice(end);
}
