/**
 * Thick lines with hidden-line rendering against the field: visible parts are solid, hidden parts thin and dashed.
 *
 * A point of a line is hidden if the image has a shorter distance along the ray from the image's own camera to the
 * point. Widths are in CSS pixels, the shader smooths the edges, and segments are drawn in order.
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
import { EMPTY_DISTANCE } from "../frames/depth_image";
import type { Pictures } from "../frames/pictures";
import type { Vec3 } from "../net/protocol";
import type { Viewport } from "../frames/viewport";

export interface Segment {
  from: Vec3;
  to: Vec3;
  srgbColor: Color;
  /** Width of the visible part, CSS pixels. */
  width: number;
  /** Opacity of the visible part. */
  alpha: number;
  /** Opacity of the hidden part. */
  hiddenAlpha: number;
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
out vec4 color;
bool isHidden() {
  vec4 clip = pictureProjection * vec4(world, 1.0);
  if (clip.w <= 0.0) return false;
  vec2 at = 0.5 + 0.5 * clip.xy / clip.w;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0)))) return false;
  float seen = texture(depthMap, vec2(at.x, 1.0 - at.y)).r;
  if (seen >= ${(0.5 * EMPTY_DISTANCE).toFixed(1)}) return false;
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
  color = vec4(tint.rgb, alpha);
}`;

export class Lines {
  /** Four vertices per segment: a software renderer draws instances one by one. */
  private readonly geometry = new BufferGeometry();
  private readonly mesh: Mesh;
  private buffers: {
    from: BufferAttribute;
    to: BufferAttribute;
    paint: BufferAttribute;
    stroke: BufferAttribute;
  };
  private capacity = 0;
  private readonly uniforms: Record<string, IUniform>;

  constructor(
    private readonly viewport: Viewport,
    private readonly pictures: Pictures,
  ) {
    this.uniforms = {
      viewport: { value: new Vector2() },
      depthMap: { value: pictures.depthTexture },
      pictureProjection: { value: new Matrix4() },
      pictureEye: { value: new Vector3() },
      slack: { value: 0.01 },
      scale: { value: 1 },
    };
    this.buffers = this.allocate(64);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      glslVersion: GLSL3,
      transparent: true,
      depthTest: false,
      depthWrite: false,
      uniforms: this.uniforms,
    });
    this.mesh = new Mesh(this.geometry, material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 1;
    viewport.scene.add(this.mesh);
    viewport.beforeFrame.push(() => this.updateUniforms());
  }

  /** Distance by which the field must be in front of a line to hide it, world units. */
  set slack(value: number) {
    this.uniforms.slack.value = value;
  }

  /** Replaces the drawn segments. */
  set(segments: readonly Segment[]): void {
    if (segments.length > this.capacity) this.buffers = this.allocate(2 * segments.length);
    const { from, to, paint, stroke } = this.buffers;
    const scale = this.viewport.renderer.getPixelRatio();
    segments.forEach((segment, n) => {
      const { r, g, b } = segment.srgbColor;
      for (let i = 4 * n; i < 4 * n + 4; i++) {
        from.setXYZ(i, ...segment.from);
        to.setXYZ(i, ...segment.to);
        paint.setXYZW(i, r, g, b, segment.alpha);
        stroke.setXY(i, segment.width * scale, segment.hiddenAlpha);
      }
    });
    for (const buffer of Object.values(this.buffers)) buffer.needsUpdate = true;
    this.geometry.setDrawRange(0, 6 * segments.length);
    this.mesh.visible = segments.length > 0;
  }

  private allocate(capacity: number): Lines["buffers"] {
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

  private updateUniforms(): void {
    const { width, height } = this.viewport.pixels;
    (this.uniforms.viewport.value as Vector2).set(width, height);
    this.uniforms.scale.value = this.viewport.renderer.getPixelRatio();
    const { viewpoint } = this.pictures;
    if (viewpoint === null) return;
    (this.uniforms.pictureProjection.value as Matrix4).copy(viewpoint.viewProjection);
    (this.uniforms.pictureEye.value as Vector3).copy(viewpoint.eye);
  }
}

/** An sRGB color without conversion to linear values: lines are drawn over sRGB images. */
export function color(text: string): Color {
  return new Color(text).convertLinearToSRGB();
}
