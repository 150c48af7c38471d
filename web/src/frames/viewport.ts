/** The canvas: three's scene and camera, orbit controls, and redraws on demand. */
import {
  MathUtils,
  Matrix4,
  PerspectiveCamera,
  Quaternion,
  Ray,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { ScreenPoint } from "../editing/picking";
import type { Vec3 } from "../net/protocol";
import { RedrawSchedule } from "./redraw_schedule";

const MAX_DEVICE_PIXEL_RATIO = 2;

/** Time in ms above which two frames do not count as consecutive. */
const MAX_FRAME_MS = 100;

/** Whether the browser renders in software: antialiasing is then left to the shaders of lines and dots. */
function isSoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  const information = gl?.getExtension("WEBGL_debug_renderer_info");
  if (!gl || !information) return false;
  const name = String(gl.getParameter(information.UNMASKED_RENDERER_WEBGL));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

/** A renderer with an opaque canvas, which the browser need not blend with the page behind it. */
function opaqueRenderer(antialias: boolean): WebGLRenderer {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("webgl2", {
    alpha: false,
    depth: true,
    stencil: false,
    antialias,
    powerPreference: "high-performance",
  });
  return new WebGLRenderer({ canvas, context: context ?? undefined });
}

export class Viewport {
  /** Whether the browser renders in software. */
  readonly software = isSoftware();
  readonly renderer = opaqueRenderer(!this.software);
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(50, 1, 0.01, 1000);
  orbit: OrbitControls | null = null;
  /** Called before each redraw; and after it, with the time at which the next frame can begin. */
  beforeFrame: (() => void)[] = [];
  afterFrame: ((time: number) => void)[] = [];
  /** Milliseconds from one frame to the next, smoothed. */
  frameTime = 16;
  /** Called when the camera or the size of the canvas changes. */
  cameraChanges: (() => void)[] = [];
  /** Called when the user turns the view or chooses another one. */
  userTurns: (() => void)[] = [];
  /**
   * Called when the orbit's center is only a guess: the point of the camera's axis closest to the scene's
   * center.
   */
  orbitGuessed: (() => void)[] = [];
  private sceneCenter: Vec3 = [0, 0, 0];
  private readonly redraws = new RedrawSchedule((began) => this.redraw(began));
  private size = new Vector2(1, 1);

  constructor(private readonly host: HTMLElement) {
    const { renderer } = this;
    renderer.setClearColor(0x15171a, 1);
    renderer.autoClear = false;
    renderer.info.autoReset = true;
    host.append(renderer.domElement);
    new ResizeObserver(() => this.resize()).observe(host);
    this.resize();
  }

  get canvas(): HTMLCanvasElement {
    return this.renderer.domElement;
  }

  /** Size of the canvas in device pixels. */
  get pixels(): { width: number; height: number } {
    const { width, height } = this.canvas;
    return { width, height };
  }

  /** Size of the canvas in CSS pixels. */
  get points(): { width: number; height: number } {
    return { width: this.size.x, height: this.size.y };
  }

  /** Schedules a redraw for the browser's next frame, or in so many milliseconds if none comes before. */
  invalidate(within = 0): void {
    if (within > 0) this.redraws.requestWithin(within);
    else this.redraws.request();
  }

  /** Draws the scene into one pixel, which the frame that follows covers: its shaders are compiled then. */
  drawUnseen(): void {
    const { renderer } = this;
    renderer.setRenderTarget(null);
    renderer.setScissor(0, 0, 1, 1);
    renderer.setScissorTest(true);
    renderer.render(this.scene, this.camera);
    renderer.setScissorTest(false);
  }

  /**
   * Looks from a camera-to-world matrix, row by row, and orbits around the point of its axis closest to
   * `around`.
   */
  lookFrom(c2w: readonly number[], fov_y_deg: number, up: Vec3, around: Vec3): void {
    this.notifyUserTurn();
    const { camera } = this;
    if (this.orbit === null || camera.up.distanceTo(new Vector3(...up)) > 1e-6) {
      camera.up.set(...up);
      this.orbit?.dispose();
      this.orbit = new OrbitControls(camera, this.canvas);
      this.orbit.zoomToCursor = true;
      this.orbit.addEventListener("start", () => this.notifyUserTurn());
      this.orbit.addEventListener("change", () => this.updateCamera());
    }
    // After the creation of the orbit, which turns the camera to its center.
    this.setPose(c2w, fov_y_deg);
    this.sceneCenter = around;
    this.resetOrbit();
    this.orbit.update();
  }

  /** Orbits about another up direction; the camera stays where it is, and turns upright. */
  turnUp(up: Vec3): void {
    if (this.orbit === null || this.camera.up.distanceTo(new Vector3(...up)) <= 1e-6) return;
    this.lookFrom(this.c2w, this.camera.fov, up, this.sceneCenter);
  }

  /** Looks from a pose exactly, roll included, until the orbit is reset. */
  pose(c2w: readonly number[], fov_y_deg: number): void {
    this.setPose(c2w, fov_y_deg);
    this.updateCamera();
  }

  /** Sets the orbit's center to the point of the camera's axis closest to the scene's center. */
  resetOrbit(): void {
    if (this.orbit === null) return;
    const to = new Vector3(...this.sceneCenter).sub(this.camera.position);
    this.orbitAt(Math.max(to.dot(this.forward), 0.1));
    this.updateCamera();
    for (const action of this.orbitGuessed) action();
  }

  /** Sets the orbit's center to the point of the camera's axis at a distance. */
  orbitAt(distance: number): void {
    this.orbit?.target.copy(this.camera.position).addScaledVector(this.forward, distance);
  }

  /** Centers the orbit on a sphere and moves the camera so that the sphere fills most of the view. */
  focus(center: Vec3, radius: number): void {
    if (this.orbit === null) return;
    this.notifyUserTurn();
    const away = this.camera.position.clone().sub(this.orbit.target).normalize();
    const narrow = Math.min(1, this.camera.aspect) * Math.tan(MathUtils.degToRad(this.camera.fov / 2));
    this.orbit.target.set(...center);
    this.camera.position.copy(this.orbit.target).addScaledVector(away, (1.6 * radius) / narrow);
    this.orbit.update();
    this.updateCamera();
  }

  /** Camera-to-world matrix, row by row. */
  get c2w(): number[] {
    this.camera.updateMatrixWorld();
    return this.camera.matrixWorld.clone().transpose().toArray();
  }

  /** Matrix from world to clip coordinates of the current camera. */
  get viewProjection(): Matrix4 {
    this.camera.updateMatrixWorld();
    return this.camera.projectionMatrix.clone().multiply(this.camera.matrixWorldInverse);
  }

  /** Projection of a world point to CSS pixels from the left and the top of the canvas. */
  readonly project = (point: Vec3): ScreenPoint => {
    this.camera.updateMatrixWorld();
    const seen = new Vector3(...point).applyMatrix4(this.camera.matrixWorldInverse);
    const depth = -seen.z;
    const clip = seen.applyMatrix4(this.camera.projectionMatrix);
    return { x: (0.5 + 0.5 * clip.x) * this.size.x, y: (0.5 - 0.5 * clip.y) * this.size.y, depth };
  };

  /** A CSS pixel in normalized device coordinates. */
  device(x: number, y: number): { x: number; y: number } {
    return { x: (2 * x) / this.size.x - 1, y: 1 - (2 * y) / this.size.y };
  }

  /** The ray through a CSS pixel. */
  ray(x: number, y: number): Ray {
    this.camera.updateMatrixWorld();
    const at = this.device(x, y);
    const through = new Vector3(at.x, at.y, 0.5).unproject(this.camera);
    return new Ray(this.camera.position.clone(), through.sub(this.camera.position).normalize());
  }

  /** Unit viewing direction of the camera. */
  get forward(): Vector3 {
    return new Vector3(0, 0, -1).applyQuaternion(this.camera.getWorldQuaternion(new Quaternion()));
  }

  private redraw(began: number): void {
    for (const action of this.beforeFrame) action();
    this.renderer.setRenderTarget(null);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    requestAnimationFrame((time) => {
      this.frameTime += 0.2 * (Math.min(time - began, MAX_FRAME_MS) - this.frameTime);
      for (const action of this.afterFrame) action(time);
    });
  }

  private setPose(c2w: readonly number[], fov_y_deg: number): void {
    const pose = new Matrix4().fromArray([...c2w]).transpose();
    this.camera.fov = fov_y_deg;
    this.camera.position.setFromMatrixPosition(pose);
    this.camera.quaternion.setFromRotationMatrix(pose);
  }

  private notifyUserTurn(): void {
    for (const action of this.userTurns) action();
  }

  private updateCamera(): void {
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    for (const action of this.cameraChanges) action();
    this.invalidate();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.host;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.size.set(clientWidth, clientHeight);
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MAX_DEVICE_PIXEL_RATIO));
    this.renderer.setSize(clientWidth, clientHeight);
    this.camera.aspect = clientWidth / clientHeight;
    this.updateCamera();
  }
}
