/**
 * Highlight of the selected elements over the image, whoever has drawn that: a tint with an outline where they are
 * visible, a faint tint where the field hides them.
 *
 * Elements are drawn as squares into a mask of the size of the canvas, red where visible and green where hidden; the
 * mask is laid over the image. An element is hidden if the image has a shorter distance along the ray from the image's
 * own camera.
 */
import {
  BufferAttribute,
  BufferGeometry,
  CustomBlending,
  GLSL3,
  MaxEquation,
  Matrix4,
  Mesh,
  NearestFilter,
  OneFactor,
  PlaneGeometry,
  Points,
  Scene,
  ShaderMaterial,
  Vector2,
  Vector3,
  WebGLRenderTarget,
} from "three";
import { EMPTY_DISTANCE } from "../frames/depth_image";
import type { Pictures } from "../frames/pictures";
import type { Viewport } from "../frames/viewport";
import type { HighlightHeader } from "../net/protocol";

/** Least size of an element's square, CSS pixels. */
const MIN_PIXELS = 3;

/** Least slack of the comparison of distances, as a share of the distance. */
const DISTANCE_SLACK = 0.004;

/** Slack in sizes of elements: centers lie behind the surface, at grazing angles far along the ray. */
const SIZE_SLACK = 2.5;

const POINT_VERTEX = `
uniform vec3 low;
uniform vec3 high;
uniform float edge;
uniform float minPixels;
uniform float viewHeight;
out vec3 world;
void main() {
  world = mix(low, high, position);
  gl_Position = projectionMatrix * viewMatrix * vec4(world, 1.0);
  float covered = edge * projectionMatrix[1][1] * 0.5 * viewHeight / max(gl_Position.w, 1e-6);
  gl_PointSize = max(1.2 * covered, minPixels);
}`;
const POINT_FRAGMENT = `
uniform sampler2D depthMap;
uniform mat4 pictureProjection;
uniform vec3 pictureEye;
uniform float slack;
in vec3 world;
out vec4 color;
void main() {
  vec4 clip = pictureProjection * vec4(world, 1.0);
  vec2 at = 0.5 + 0.5 * clip.xy / clip.w;
  bool shown = true;
  if (clip.w > 0.0 && all(greaterThan(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)))) {
    float seen = texture(depthMap, vec2(at.x, 1.0 - at.y)).r;
    shown = seen >= ${(0.5 * EMPTY_DISTANCE).toFixed(1)}
      || length(world - pictureEye) <= seen * ${(1 + DISTANCE_SLACK).toFixed(4)} + slack;
  }
  color = shown ? vec4(1.0, 0.0, 0.0, 1.0) : vec4(0.0, 1.0, 0.0, 1.0);
}`;
const TINT_VERTEX = `
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;
const TINT_FRAGMENT = `
uniform sampler2D mask;
uniform vec2 step_;
out vec4 color;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec2 here = texelFetch(mask, at, 0).rg;
  float most = here.r;
  float least = here.r;
  for (int i = 0; i < 4; i++) {
    ivec2 by = i < 2 ? ivec2(i * 2 - 1, 0) : ivec2(0, i * 2 - 5);
    float other = texelFetch(mask, clamp(at + by * int(step_.x), ivec2(0), textureSize(mask, 0) - 1), 0).r;
    most = max(most, other);
    least = min(least, other);
  }
  float rim = here.r > 0.5 && least < 0.5 ? 1.0 : 0.0;
  float alpha = here.r > 0.5 ? 0.42 : here.g > 0.5 ? 0.12 : 0.0;
  alpha = max(alpha, 0.95 * rim);
  if (alpha <= 0.0) discard;
  color = vec4(rim > 0.5 ? vec3(1.0, 0.78, 0.25) : vec3(1.0, 0.55, 0.08), alpha);
}`;

export class Highlight {
  private readonly geometry = new BufferGeometry();
  private readonly points: Points<BufferGeometry, ShaderMaterial>;
  private readonly pointScene = new Scene();
  private readonly tint: Mesh<PlaneGeometry, ShaderMaterial>;
  private mask: WebGLRenderTarget | null = null;
  private count = 0;

  constructor(
    private readonly viewport: Viewport,
    private readonly pictures: Pictures,
  ) {
    this.points = new Points(
      this.geometry,
      new ShaderMaterial({
        vertexShader: POINT_VERTEX,
        fragmentShader: POINT_FRAGMENT,
        glslVersion: GLSL3,
        depthTest: false,
        depthWrite: false,
        transparent: true,
        blending: CustomBlending,
        blendEquation: MaxEquation,
        blendSrc: OneFactor,
        blendDst: OneFactor,
        uniforms: {
          low: { value: new Vector3() },
          high: { value: new Vector3() },
          edge: { value: 0 },
          minPixels: { value: MIN_PIXELS },
          viewHeight: { value: 1 },
          depthMap: { value: pictures.depthTexture },
          pictureProjection: { value: new Matrix4() },
          pictureEye: { value: new Vector3() },
          slack: { value: 0 },
        },
      }),
    );
    this.points.frustumCulled = false;
    this.pointScene.add(this.points);
    this.tint = new Mesh(
      new PlaneGeometry(2, 2),
      new ShaderMaterial({
        vertexShader: TINT_VERTEX,
        fragmentShader: TINT_FRAGMENT,
        glslVersion: GLSL3,
        transparent: true,
        depthTest: false,
        depthWrite: false,
        uniforms: { mask: { value: null }, step_: { value: new Vector2(1, 1) } },
      }),
    );
    this.tint.frustumCulled = false;
    this.tint.visible = false;
    viewport.scene.add(this.tint);
    viewport.canvas.addEventListener("webglcontextlost", () => {
      this.mask?.dispose();
      this.mask = null;
    });
  }

  /** Shows the positions of a message. */
  take(header: HighlightHeader, positions: ArrayBuffer): void {
    const values = new Uint16Array(positions, 0, 3 * header.count);
    this.geometry.dispose();
    this.geometry.setAttribute("position", new BufferAttribute(values, 3, true));
    this.geometry.setDrawRange(0, header.count);
    this.count = header.count;
    const { uniforms } = this.points.material;
    (uniforms.low.value as Vector3).set(...header.low);
    (uniforms.high.value as Vector3).set(...header.high);
    uniforms.edge.value = header.size;
    uniforms.slack.value = SIZE_SLACK * header.size;
    this.viewport.invalidate();
  }

  /** Number of positions that are drawn. */
  get shown(): number {
    return this.tint.visible ? this.count : 0;
  }

  /** Draws the mask for the current camera, before a frame; hides the highlight where it is not `visible`. */
  draw(visible: boolean): void {
    const { viewpoint } = this.pictures;
    this.tint.visible = visible && this.count > 0 && viewpoint !== null;
    if (!this.tint.visible || viewpoint === null) return;
    const { renderer, camera } = this.viewport;
    const { width, height } = this.viewport.pixels;
    const { uniforms } = this.points.material;
    (uniforms.pictureProjection.value as Matrix4).copy(viewpoint.viewProjection);
    (uniforms.pictureEye.value as Vector3).copy(viewpoint.eye);
    uniforms.viewHeight.value = height;
    uniforms.minPixels.value = MIN_PIXELS * renderer.getPixelRatio();
    const mask = this.sizedMask(width, height);
    (this.tint.material.uniforms.step_.value as Vector2).setScalar(
      Math.max(1, Math.round(renderer.getPixelRatio())),
    );
    renderer.setRenderTarget(mask);
    renderer.clear();
    renderer.render(this.pointScene, camera);
    renderer.setRenderTarget(null);
  }

  private sizedMask(width: number, height: number): WebGLRenderTarget {
    if (this.mask?.width === width && this.mask.height === height) return this.mask;
    this.mask?.dispose();
    this.mask = new WebGLRenderTarget(width, height, {
      depthBuffer: false,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      generateMipmaps: false,
    });
    this.tint.material.uniforms.mask.value = this.mask.texture;
    return this.mask;
  }
}
