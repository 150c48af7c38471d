/**
 * The image of the field behind everything else, and its distances, for hidden lines.
 *
 * Parts are drawn into one texture as they arrive. Depth-based reprojection: while the camera differs from the image's
 * viewpoint, the image is drawn as a surface in space from the current camera, until the next image arrives.
 */
import {
  DataTexture,
  FloatType,
  GLSL3,
  LinearFilter,
  Matrix4,
  Mesh,
  NearestFilter,
  OrthographicCamera,
  PlaneGeometry,
  RedFormat,
  Scene,
  ShaderMaterial,
  Texture,
  Vector3,
  Vector4,
  WebGLRenderTarget,
} from "three";
import { DepthImage, EMPTY_DISTANCE } from "./depth_image";
import type { Distances } from "../field/views";
import type { PictureHeader } from "../net/protocol";
import type { Viewport } from "./viewport";

/** The camera of an image. */
export interface Viewpoint {
  viewProjection: Matrix4;
  eye: Vector3;
}

const SURFACE_CELLS = 96;

const PART_VERTEX = `
uniform vec4 part;
out vec2 at;
void main() {
  at = uv;
  vec2 place = part.xy + part.zw * vec2(uv.x, 1.0 - uv.y);
  gl_Position = vec4(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0);
}`;
const PART_FRAGMENT = `
uniform sampler2D picture;
uniform bool upright;
in vec2 at;
out vec4 color;
void main() { color = vec4(texture(picture, upright ? at : vec2(at.x, 1.0 - at.y)).rgb, 1.0); }`;
const SURFACE_VERTEX = `
uniform sampler2D depthMap;
uniform mat4 toWorld;
uniform vec3 pictureEye;
uniform float far;
uniform bool flat_;
out vec2 at;
void main() {
  at = uv;
  vec2 device = 2.0 * uv - 1.0;
  gl_Position = vec4(device, 0.0, 1.0);
  if (!flat_) {
    vec4 through = toWorld * vec4(device, 0.5, 1.0);
    vec3 ray = normalize(through.xyz / through.w - pictureEye);
    float distance_ = min(texture(depthMap, vec2(uv.x, 1.0 - uv.y)).r, far);
    gl_Position = projectionMatrix * viewMatrix * vec4(pictureEye + distance_ * ray, 1.0);
  }
}`;
const SURFACE_FRAGMENT = `
uniform sampler2D picture;
in vec2 at;
out vec4 color;
void main() { color = vec4(texture(picture, at).rgb, 1.0); }`;

export class Pictures {
  readonly depth = new DepthImage();
  readonly depthTexture = new DataTexture(this.depth.data, 1, 1, RedFormat, FloatType);
  /** The camera of the image that is shown. */
  viewpoint: Viewpoint | null = null;
  private target: WebGLRenderTarget | null = null;
  private readonly flatCamera = new OrthographicCamera();
  private readonly partMesh: Mesh<PlaneGeometry, ShaderMaterial>;
  private readonly partScene = new Scene();
  private readonly surface: Mesh<PlaneGeometry, ShaderMaterial>;
  private readonly quad = new PlaneGeometry(2, 2);
  private readonly grid = new PlaneGeometry(2, 2, SURFACE_CELLS, SURFACE_CELLS);

  constructor(private readonly viewport: Viewport) {
    this.depthTexture.magFilter = this.depthTexture.minFilter = NearestFilter;
    this.depthTexture.needsUpdate = true;
    const part = new ShaderMaterial({
      vertexShader: PART_VERTEX,
      fragmentShader: PART_FRAGMENT,
      glslVersion: GLSL3,
      depthTest: false,
      depthWrite: false,
      uniforms: { picture: { value: null }, part: { value: new Vector4() }, upright: { value: false } },
    });
    this.partMesh = new Mesh(this.quad, part);
    this.partMesh.frustumCulled = false;
    this.partScene.add(this.partMesh);
    const shown = new ShaderMaterial({
      vertexShader: SURFACE_VERTEX,
      fragmentShader: SURFACE_FRAGMENT,
      glslVersion: GLSL3,
      depthTest: true,
      depthWrite: true,
      uniforms: {
        picture: { value: null },
        depthMap: { value: this.depthTexture },
        toWorld: { value: new Matrix4() },
        pictureEye: { value: new Vector3() },
        far: { value: 10 },
        flat_: { value: true },
      },
    });
    this.surface = new Mesh(this.quad, shown);
    this.surface.frustumCulled = false;
    this.surface.renderOrder = -10;
    this.surface.visible = false;
    viewport.scene.add(this.surface);
    viewport.beforeFrame.push(() => this.updateSurface());
    // Objects of a lost context cannot be freed in the next context.
    viewport.canvas.addEventListener("webglcontextlost", () => {
      this.depthTexture.dispose();
      this.target?.dispose();
    });
  }

  /** Shows a part of an image: all of it, or a tile. */
  show(
    header: PictureHeader,
    image: ImageBitmap | ImageData,
    depth: Uint16Array,
    viewpoint: Viewpoint | null,
  ): void {
    this.resizeTarget();
    const texture = new Texture(image);
    texture.flipY = false;
    texture.generateMipmaps = false;
    texture.minFilter = texture.magFilter = LinearFilter;
    texture.needsUpdate = true;
    this.draw(texture, header, false);
    texture.dispose();
    if (image instanceof ImageBitmap) image.close();
    this.depth.addPart(header, depth);
    this.uploadDepth();
    this.viewpoint = viewpoint ?? this.viewpoint;
    this.surface.visible = true;
    this.viewport.invalidate();
  }

  /** Shows an image drawn by the page for the current camera: `draw` draws it into a framebuffer of a size. */
  showOwn(
    { width, height, values }: Distances,
    draw: (framebuffer: WebGLFramebuffer | null, across: number, down: number) => void,
  ): void {
    this.resizeTarget();
    const { renderer } = this.viewport;
    const gl = renderer.getContext();
    renderer.setRenderTarget(this.target);
    const framebuffer = gl.getParameter(gl.FRAMEBUFFER_BINDING) as WebGLFramebuffer | null;
    draw(framebuffer, this.target?.width ?? 1, this.target?.height ?? 1);
    renderer.resetState();
    renderer.setRenderTarget(null);
    this.depth.replace(width, height, values);
    this.uploadDepth();
    this.viewpoint = {
      viewProjection: this.viewport.viewProjection,
      eye: this.viewport.camera.position.clone(),
    };
    this.surface.visible = true;
    this.updateSurface();
  }

  private uploadDepth(): void {
    const { data, width, height } = this.depth;
    const image = this.depthTexture.image as { data: Float32Array; width: number; height: number };
    if (image.width !== width || image.height !== height) this.depthTexture.dispose();
    this.depthTexture.image = { data, width, height };
    this.depthTexture.needsUpdate = true;
  }

  /** Resizes the texture to the canvas and keeps its content. */
  private resizeTarget(): void {
    const { width, height } = this.viewport.pixels;
    const old = this.target;
    if (old?.width === width && old.height === height) return;
    this.target = new WebGLRenderTarget(width, height, {
      depthBuffer: false,
      // The texture has the size of the canvas, so that no interpolation, costly in software, is needed.
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      generateMipmaps: false,
    });
    if (old) {
      this.draw(old.texture, { x: 0, y: 0, width: 1, height: 1, full_width: 1, full_height: 1 }, true);
      old.dispose();
    }
    this.surface.material.uniforms.picture.value = this.target.texture;
  }

  private draw(
    texture: Texture,
    at: Pick<PictureHeader, "x" | "y" | "width" | "height" | "full_width" | "full_height">,
    upright: boolean,
  ): void {
    const { renderer } = this.viewport;
    const { uniforms } = this.partMesh.material;
    uniforms.picture.value = texture;
    uniforms.upright.value = upright;
    (uniforms.part.value as Vector4).set(
      at.x / at.full_width,
      at.y / at.full_height,
      at.width / at.full_width,
      at.height / at.full_height,
    );
    renderer.setRenderTarget(this.target);
    renderer.render(this.partScene, this.flatCamera);
    renderer.setRenderTarget(null);
  }

  /** Chooses between the image as it is and the image as a surface in space. */
  private updateSurface(): void {
    const { uniforms } = this.surface.material;
    const now = this.viewport.viewProjection;
    const moved = this.viewpoint !== null && !areSimilar(now, this.viewpoint.viewProjection);
    this.surface.geometry = moved ? this.grid : this.quad;
    this.surface.material.depthTest = this.surface.material.depthWrite = moved;
    uniforms.flat_.value = !moved;
    if (!moved || this.viewpoint === null) return;
    (uniforms.toWorld.value as Matrix4).copy(this.viewpoint.viewProjection).invert();
    (uniforms.pictureEye.value as Vector3).copy(this.viewpoint.eye);
    let far = 0;
    for (const distance of this.depth.data) if (distance < EMPTY_DISTANCE && distance > far) far = distance;
    uniforms.far.value = far > 0 ? 1.05 * far : 10;
  }
}

function areSimilar(a: Matrix4, b: Matrix4): boolean {
  return a.elements.every((x, i) => Math.abs(x - b.elements[i]) <= 1e-6 * (1 + Math.abs(x)));
}
