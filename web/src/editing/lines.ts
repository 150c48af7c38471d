/**
 * Thick lines that know what of them the field hides: the visible part solid, the hidden part thin and dashed.
 *
 * A point of a line is hidden where the picture's distance along the same ray, seen from where the picture
 * was taken, is shorter. Widths are CSS pixels, edges are smoothed in the shader. Segments are drawn in order.
 */
import {
  Color,
  DynamicDrawUsage,
  GLSL3,
  BufferAttribute,
  BufferGeometry,
  Matrix4,
  Mesh,
  ShaderMaterial,
  Vector2,
  Vector3,
  type IUniform,
} from "three";
import { NOTHING } from "../frames/depth_image";
import type { Pictures } from "../frames/pictures";
import type { Vec3 } from "../net/protocol";
import type { Viewport } from "../frames/viewport";

export interface Segment {
  from: Vec3;
  to: Vec3;
  colour: Color;
  /** CSS pixels, of the visible part. */
  width: number;
  /** Opacity of the visible part. */
  alpha: number;
  /** Opacity of the hidden part. */
  hidden: number;
}

const VERTEX = `
uniform vec2 viewport;
in vec3 from;
in vec3 to;
in vec4 paint;
in vec2 stroke;
out vec3 world;
out vec4 tint;
out float hiddenAlpha;
out float side;
out float halfWidth;
out vec2 run;
void main() {
  vec4 a = projectionMatrix * viewMatrix * vec4(from, 1.0);
  vec4 b = projectionMatrix * viewMatrix * vec4(to, 1.0);
  vec3 p = from;
  vec3 q = to;
  float near = 1e-3;
  if (a.w < near && b.w < near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (a.w < near) { float t = (near - a.w) / (b.w - a.w); a = mix(a, b, t); p = mix(p, q, t); }
  else if (b.w < near) { float t = (near - b.w) / (a.w - b.w); b = mix(b, a, t); q = mix(q, p, t); }
  vec2 sa = 0.5 * viewport * a.xy / a.w;
  vec2 sb = 0.5 * viewport * b.xy / b.w;
  float reach = length(sb - sa);
  vec2 direction = reach > 0.0 ? (sb - sa) / reach : vec2(1.0, 0.0);
  halfWidth = 0.5 * stroke.x;
  float outer = halfWidth + 1.0;
  bool first = position.x < 0.5;
  vec4 clip = first ? a : b;
  vec2 offset = vec2(-direction.y, direction.x) * position.y * outer + direction * (first ? -0.5 : 0.5) * halfWidth;
  clip.xy += 2.0 * offset / viewport * clip.w;
  clip.z = 0.0;
  gl_Position = clip;
  world = first ? p : q;
  side = position.y * outer * clip.w;
  run = vec2((first ? 0.0 : reach) * clip.w, clip.w);
  tint = paint;
  hiddenAlpha = stroke.y;
}`;
const FRAGMENT = `
uniform sampler2D depthMap;
uniform mat4 pictureProjection;
uniform vec3 pictureEye;
uniform float slack;
uniform float scale;
in vec3 world;
in vec4 tint;
in float hiddenAlpha;
in float side;
in float halfWidth;
in vec2 run;
out vec4 colour;
bool isHidden() {
  vec4 clip = pictureProjection * vec4(world, 1.0);
  if (clip.w <= 0.0) return false;
  vec2 at = 0.5 + 0.5 * clip.xy / clip.w;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0)))) return false;
  float seen = texture(depthMap, vec2(at.x, 1.0 - at.y)).r;
  if (seen >= ${(0.5 * NOTHING).toFixed(1)}) return false;
  float own = length(world - pictureEye);
  return own > seen * 1.003 + slack;
}
void main() {
  float away = abs(side / run.y);
  if (away > halfWidth + 0.5) discard;
  float alpha = tint.a;
  float reach = halfWidth;
  if (isHidden()) {
    if (mod(run.x / run.y, 8.0 * scale) > 4.5 * scale) discard;
    alpha = hiddenAlpha;
    reach = min(halfWidth, 0.6);
  }
  alpha *= clamp(reach + 0.5 - away, 0.0, 1.0);
  if (alpha < 0.01) discard;
  colour = vec4(tint.rgb, alpha);
}`;

export class Lines {
  /** Four vertices a segment; instances would be a draw each where the processor draws. */
  private readonly geometry = new BufferGeometry();
  private readonly mesh: Mesh;
  private buffers: {
    from: BufferAttribute;
    to: BufferAttribute;
    paint: BufferAttribute;
    stroke: BufferAttribute;
  };
  private capacity = 0;
  private readonly shared: Record<string, IUniform>;

  constructor(
    private readonly viewport: Viewport,
    private readonly pictures: Pictures,
  ) {
    this.shared = {
      viewport: { value: new Vector2() },
      depthMap: { value: pictures.depthTexture },
      pictureProjection: { value: new Matrix4() },
      pictureEye: { value: new Vector3() },
      slack: { value: 0.01 },
      scale: { value: 1 },
    };
    this.buffers = this.grow(64);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      glslVersion: GLSL3,
      transparent: true,
      depthTest: false,
      depthWrite: false,
      uniforms: this.shared,
    });
    this.mesh = new Mesh(this.geometry, material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 1;
    viewport.scene.add(this.mesh);
    viewport.beforeFrame.push(() => this.follow());
  }

  /** How much nearer than a line the field must be to hide it, world units. */
  set slack(value: number) {
    this.shared.slack.value = value;
  }

  /** Shows these segments in place of the ones before. */
  set(segments: readonly Segment[]): void {
    if (segments.length > this.capacity) this.buffers = this.grow(2 * segments.length);
    const { from, to, paint, stroke } = this.buffers;
    const scale = this.viewport.renderer.getPixelRatio();
    segments.forEach((segment, n) => {
      const { r, g, b } = segment.colour;
      for (let i = 4 * n; i < 4 * n + 4; i++) {
        from.setXYZ(i, ...segment.from);
        to.setXYZ(i, ...segment.to);
        paint.setXYZW(i, r, g, b, segment.alpha);
        stroke.setXY(i, segment.width * scale, segment.hidden);
      }
    });
    for (const buffer of Object.values(this.buffers)) buffer.needsUpdate = true;
    this.geometry.setDrawRange(0, 6 * segments.length);
    this.mesh.visible = segments.length > 0;
  }

  private grow(capacity: number): Lines["buffers"] {
    this.capacity = capacity;
    const make = (name: string, size: number): BufferAttribute => {
      const attribute = new BufferAttribute(new Float32Array(4 * capacity * size), size);
      attribute.setUsage(DynamicDrawUsage);
      this.geometry.setAttribute(name, attribute);
      return attribute;
    };
    this.geometry.dispose();
    const corners = [0, -1, 0, 0, 1, 0, 1, -1, 0, 1, 1, 0];
    const position = Float32Array.from({ length: 12 * capacity }, (_, i) => corners[i % 12]);
    this.geometry.setAttribute("position", new BufferAttribute(position, 3));
    this.geometry.setIndex(
      Array.from({ length: 6 * capacity }, (_, i) => 4 * Math.floor(i / 6) + [0, 2, 1, 1, 2, 3][i % 6]),
    );
    return { from: make("from", 3), to: make("to", 3), paint: make("paint", 4), stroke: make("stroke", 2) };
  }

  private follow(): void {
    const { width, height } = this.viewport.pixels;
    (this.shared.viewport.value as Vector2).set(width, height);
    this.shared.scale.value = this.viewport.renderer.getPixelRatio();
    const { viewpoint } = this.pictures;
    if (viewpoint === null) return;
    (this.shared.pictureProjection.value as Matrix4).copy(viewpoint.viewProjection);
    (this.shared.pictureEye.value as Vector3).copy(viewpoint.eye);
  }
}

/** An sRGB colour as it is, not made linear: lines are drawn over sRGB pictures. */
export function colour(text: string): Color {
  return new Color(text).convertLinearToSRGB();
}
