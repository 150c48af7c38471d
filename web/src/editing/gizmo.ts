/** Gizmo of the selected cage: three's TransformControls, whose motions become operations. */
import {
  Mesh,
  Object3D,
  PerspectiveCamera,
  Quaternion,
  Raycaster,
  Vector2,
  Vector3,
  type Scene,
} from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { nearestRotation, type Posed } from "./cage";
import { moveCornersBy, rotationBetween, scalingBy, translationBetween } from "./gestures";
import type { Axes, Operation } from "./operations";
import type { Tool } from "../app/store";

/** Logarithm of the uniform scale factor per half height of the view. */
const UNIFORM_SCALE_RATE = 2;

interface DevicePoint {
  x: number;
  y: number;
}

/** Members of three's controls that its types omit or restrict to DOM events. */
interface UntypedControls {
  pointerHover(pointer: DevicePoint & { button: number }): void;
  pointerDown(pointer: DevicePoint & { button: number }): void;
  pointerMove(pointer: DevicePoint & { button: number }): void;
  pointerUp(pointer: DevicePoint & { button: number }): void;
  _gizmo: { picker: Record<string, Object3D> };
}

export class Gizmo {
  private readonly proxy = new Object3D();
  private readonly controls: TransformControls;
  private readonly start = { position: new Vector3(), quaternion: new Quaternion(), device: { x: 0, y: 0 } };
  private axes: Axes = "world";
  private compiled = false;

  constructor(
    scene: Scene,
    private readonly camera: PerspectiveCamera,
  ) {
    this.controls = new TransformControls(camera);
    this.controls.size = 0.85;
    this.controls.space = "local";
    this.controls.setColors("#ff4d5e", "#7fd13b", "#3f8cff", "#ffd34d");
    scene.add(this.proxy, this.controls.getHelper());
  }

  /**
   * Shows the gizmo at a position, by default the cage's pivot, along the axes of the world, which `turn` carries, or of
   * the cage.
   */
  show(tool: Tool, axes: Axes, cage: Posed, at: Vector3 | null, turn = new Quaternion()): void {
    if (this.dragging) return;
    this.axes = axes;
    this.controls.mode = at !== null || tool === "select" ? "translate" : tool;
    this.proxy.position.copy(at ?? new Vector3(...cage.pivot));
    this.proxy.quaternion.copy(axes === "cage" ? nearestRotation(cage.corners) : turn);
    this.proxy.scale.set(1, 1, 1);
    this.proxy.updateMatrixWorld();
    if (!this.isShown) this.controls.attach(this.proxy);
  }

  /**
   * Compiles the shaders of the gizmo's highlight and of its motion, once, before the mouse reaches it; `draw` draws the
   * scene.
   */
  compile(draw: () => void): void {
    if (this.compiled || !this.isShown || this.dragging) return;
    this.compiled = true;
    const { controls } = this;
    const { axis } = controls;
    controls.axis = "Z";
    controls.dragging = true;
    draw();
    controls.dragging = false;
    controls.axis = axis;
  }

  hide(): void {
    if (this.isShown && !this.dragging) this.controls.detach();
  }

  get isShown(): boolean {
    return (this.controls.object as Object3D | undefined) !== undefined;
  }

  get dragging(): boolean {
    return this.controls.dragging;
  }

  /** Highlights and returns the handle under the mouse: "X", "XY", "XYZ", "E" and so on, or null. */
  hover(device: DevicePoint): string | null {
    if (!this.isShown) return null;
    this.untyped.pointerHover({ ...device, button: -1 });
    return this.axis;
  }

  /** Removes the highlight. */
  clearHover(): void {
    if (!this.dragging) this.controls.axis = null;
  }

  /** The handle that is highlighted or dragged. */
  get axis(): string | null {
    return this.controls.axis;
  }

  begin(device: DevicePoint): void {
    this.start.position.copy(this.proxy.position);
    this.start.quaternion.copy(this.proxy.quaternion);
    this.start.device = { x: device.x, y: device.y };
    this.untyped.pointerDown({ ...device, button: 0 });
  }

  /** The whole operation since `begin`; a motion of corners if some are given. */
  move(device: DevicePoint, corners: readonly number[]): Operation {
    this.untyped.pointerMove({ ...device, button: -1 });
    const { proxy, start: from } = this;
    switch (this.controls.mode) {
      case "translate":
        return corners.length > 0
          ? moveCornersBy(corners, proxy.position.clone().sub(from.position))
          : translationBetween(from.position, proxy.position);
      case "rotate":
        return rotationBetween(from.quaternion, proxy.quaternion, this.axes, this.axis ?? "");
      case "scale":
        return scalingBy(this.axis === "XYZ" ? this.uniformFactors(device) : proxy.scale, this.axes);
    }
  }

  /** Factors of a uniform scaling, which grow with a motion to the right and up. */
  private uniformFactors(device: DevicePoint): Vector3 {
    const { x, y } = this.start.device;
    const factor = Math.exp(UNIFORM_SCALE_RATE * ((device.x - x) * this.camera.aspect + (device.y - y)));
    return new Vector3(factor, factor, factor);
  }

  /** Moves the gizmo to the point that the drag has reached. */
  moveTo(pivot: Vector3): void {
    this.proxy.position.copy(pivot);
    this.proxy.updateMatrixWorld();
  }

  end(device: DevicePoint): void {
    this.untyped.pointerUp({ ...device, button: 0 });
    this.controls.axis = null;
  }

  /**
   * A point in normalized device coordinates that is on a handle, as are its neighbors at a distance of `slack`; null
   * without such a point. `free` excludes points under other handles.
   */
  grip(axis: string, slack: DevicePoint, free: (device: DevicePoint) => boolean): DevicePoint | null {
    const picker = this.untyped._gizmo.picker[this.controls.mode];
    this.controls.getHelper().updateMatrixWorld(true);
    const handles = picker.children.filter((child): child is Mesh => child instanceof Mesh);
    const ray = new Raycaster();
    const holds = (at: DevicePoint): boolean => {
      ray.setFromCamera(new Vector2(at.x, at.y), this.camera);
      return ray.intersectObjects(handles, false).find((found) => found.object.visible)?.object.name === axis;
    };
    for (const handle of handles.filter((child) => child.name === axis)) {
      const places = handle.geometry.getAttribute("position");
      const points = Array.from({ length: places.count }, (_, i) =>
        new Vector3().fromBufferAttribute(places, i),
      );
      const center = points.reduce((sum, point) => sum.add(point), new Vector3()).divideScalar(points.length);
      for (const point of [center, ...points]) {
        const at = point.applyMatrix4(handle.matrixWorld).project(this.camera);
        if (Math.abs(at.x) > 0.98 || Math.abs(at.y) > 0.98 || !free(at)) continue;
        const around = [-1, 0, 1].flatMap((i) =>
          [-1, 0, 1].map((j) => ({ x: at.x + i * slack.x, y: at.y + j * slack.y })),
        );
        if (around.every(holds)) return { x: at.x, y: at.y };
      }
    }
    return null;
  }

  private get untyped(): UntypedControls {
    return this.controls as unknown as UntypedControls;
  }
}
