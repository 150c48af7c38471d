/** Handles of cages: dots on corners and squares on faces, drawn on top of everything. */
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DynamicDrawUsage,
  GLSL3,
  Points,
  ShaderMaterial,
} from "three";
import type { Vec3 } from "../net/protocol";
import type { Viewport } from "../frames/viewport";

export interface Dot {
  position: Vec3;
  color: Color;
  /** CSS pixels across. */
  size: number;
  shape: "round" | "square";
  filled: boolean;
}

const MAX_DOTS = 2048;

const VERTEX = `
uniform float scale;
in vec4 paint;
in float form;
out vec3 tint;
out float diameter;
flat out float shape;
void main() {
  gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0);
  gl_Position.z = 0.0;
  diameter = paint.w * scale;
  gl_PointSize = diameter + 2.0;
  tint = paint.rgb;
  shape = form;
}`;
const FRAGMENT = `
in vec3 tint;
in float diameter;
flat in float shape;
out vec4 color;
void main() {
  vec2 p = (gl_PointCoord - 0.5) * (diameter + 2.0);
  bool square = shape > 1.5;
  bool filled = mod(shape, 2.0) > 0.5;
  float radius = square ? max(abs(p.x), abs(p.y)) : length(p);
  float inside = clamp(0.5 * diameter - radius + 0.5, 0.0, 1.0);
  float core = clamp(0.5 * diameter - 1.6 - radius + 0.5, 0.0, 1.0);
  vec3 middle = filled ? tint : vec3(0.08, 0.09, 0.1);
  vec3 rim = filled ? vec3(0.08, 0.09, 0.1) : tint;
  if (inside <= 0.0) discard;
  color = vec4(mix(rim, middle, core), inside);
}`;

export class Handles {
  private readonly geometry = new BufferGeometry();
  private readonly position = new BufferAttribute(new Float32Array(MAX_DOTS * 3), 3);
  private readonly paint = new BufferAttribute(new Float32Array(MAX_DOTS * 4), 4);
  private readonly form = new BufferAttribute(new Float32Array(MAX_DOTS), 1);

  constructor(viewport: Viewport) {
    for (const attribute of [this.position, this.paint, this.form]) attribute.setUsage(DynamicDrawUsage);
    this.geometry.setAttribute("position", this.position);
    this.geometry.setAttribute("paint", this.paint);
    this.geometry.setAttribute("form", this.form);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      glslVersion: GLSL3,
      transparent: true,
      depthTest: false,
      depthWrite: false,
      uniforms: { scale: { value: 1 } },
    });
    const points = new Points(this.geometry, material);
    points.frustumCulled = false;
    points.renderOrder = 4;
    viewport.scene.add(points);
    viewport.beforeFrame.push(() => {
      material.uniforms.scale.value = viewport.renderer.getPixelRatio();
    });
  }

  /** Replaces the drawn dots. */
  set(dots: readonly Dot[]): void {
    const shown = dots.slice(0, MAX_DOTS);
    shown.forEach((dot, i) => {
      this.position.setXYZ(i, ...dot.position);
      this.paint.setXYZW(i, dot.color.r, dot.color.g, dot.color.b, dot.size);
      this.form.setX(i, (dot.shape === "square" ? 2 : 0) + (dot.filled ? 1 : 0));
    });
    this.position.needsUpdate = this.paint.needsUpdate = this.form.needsUpdate = true;
    this.geometry.setDrawRange(0, shown.length);
  }
}
