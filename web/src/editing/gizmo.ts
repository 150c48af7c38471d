/** The gizmo on the selected cage: three's TransformControls, told where to stand and asked what it was moved by. */
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
import { orientation } from "./cage";
import { cornersMove, rotation, scaling, translation } from "./gestures";
import type { Axes, Operation, Posed } from "./operations";
import type { Tool } from "../app/store";

/** Logarithm of the uniform factor for half the height of the view. */
const UNIFORM_SPEED = 2;

interface Device {
  x: number;
  y: number;
}

/** The parts of three's controls that its types leave out or narrow to DOM events. */
interface Inner {
  pointerHover(pointer: Device & { button: number }): void;
  pointerDown(pointer: Device & { button: number }): void;
  pointerMove(pointer: Device & { button: number }): void;
  pointerUp(pointer: Device & { button: number }): void;
  _gizmo: { picker: Record<string, Object3D> };
}

export class Gizmo {
  private readonly proxy = new Object3D();
  private readonly controls: TransformControls;
  private readonly from = { position: new Vector3(), quaternion: new Quaternion(), device: { x: 0, y: 0 } };
  private axes: Axes = "world";

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

  /** Stands on a cage's pivot, along the world's or the cage's axes; or between some of its corners. */
  show(tool: Tool, axes: Axes, cage: Posed, at: Vector3 | null): void {
    if (this.dragging) return;
    this.axes = axes;
    this.controls.mode = at !== null || tool === "select" ? "translate" : tool;
    this.proxy.position.copy(at ?? new Vector3(...cage.pivot));
    this.proxy.quaternion.copy(axes === "cage" ? orientation(cage.corners) : new Quaternion());
    this.proxy.scale.set(1, 1, 1);
    this.proxy.updateMatrixWorld();
    if (!this.shown) this.controls.attach(this.proxy);
  }

  hide(): void {
    if (this.shown && !this.dragging) this.controls.detach();
  }

  get shown(): boolean {
    return (this.controls.object as Object3D | undefined) !== undefined;
  }

  get dragging(): boolean {
    return this.controls.dragging;
  }

  /** The handle that the mouse is over, which is then highlighted: "X", "XY", "XYZ", "E" and so on, or null. */
  hover(device: Device): string | null {
    if (!this.shown) return null;
    this.inner.pointerHover({ ...device, button: -1 });
    return this.axis;
  }

  /** Takes the highlight off. */
  leave(): void {
    if (!this.dragging) this.controls.axis = null;
  }

  /** The handle that is highlighted, or held. */
  get axis(): string | null {
    return this.controls.axis;
  }

  begin(device: Device): void {
    this.from.position.copy(this.proxy.position);
    this.from.quaternion.copy(this.proxy.quaternion);
    this.from.device = { x: device.x, y: device.y };
    this.inner.pointerDown({ ...device, button: 0 });
  }

  /** The whole operation since `begin`; of some corners where those were meant. */
  move(device: Device, corners: readonly number[]): Operation {
    this.inner.pointerMove({ ...device, button: -1 });
    const { proxy, from } = this;
    switch (this.controls.mode) {
      case "translate":
        return corners.length > 0
          ? cornersMove(corners, proxy.position.clone().sub(from.position))
          : translation(from.position, proxy.position);
      case "rotate":
        return rotation(from.quaternion, proxy.quaternion, this.axes, this.axis ?? "");
      case "scale":
        return scaling(this.axis === "XYZ" ? this.uniform(device) : proxy.scale, this.axes);
    }
  }

  /** Factors of a uniform scaling: larger to the right and up, wherever the mouse took hold. */
  private uniform(device: Device): Vector3 {
    const { x, y } = this.from.device;
    const factor = Math.exp(UNIFORM_SPEED * ((device.x - x) * this.camera.aspect + (device.y - y)));
    return new Vector3(factor, factor, factor);
  }

  /** Stands where the drag could be followed to. */
  settle(pivot: Vector3): void {
    this.proxy.position.copy(pivot);
    this.proxy.updateMatrixWorld();
  }

  end(device: Device): void {
    this.inner.pointerUp({ ...device, button: 0 });
    this.controls.axis = null;
  }

  /**
   * A place, in normalised device coordinates, where the mouse takes hold of a handle, and around which it
   * still does at a distance of `slack`; null if there is none. Only free places count.
   */
  grip(axis: string, slack: Device, free: (device: Device) => boolean): Device | null {
    const picker = this.inner._gizmo.picker[this.controls.mode];
    this.controls.getHelper().updateMatrixWorld(true);
    const handles = picker.children.filter((child): child is Mesh => child instanceof Mesh);
    const ray = new Raycaster();
    const holds = (at: Device): boolean => {
      ray.setFromCamera(new Vector2(at.x, at.y), this.camera);
      return ray.intersectObjects(handles, false).find((found) => found.object.visible)?.object.name === axis;
    };
    for (const handle of handles.filter((child) => child.name === axis)) {
      const places = handle.geometry.getAttribute("position");
      const points = Array.from({ length: places.count }, (_, i) =>
        new Vector3().fromBufferAttribute(places, i),
      );
      const centre = points.reduce((sum, point) => sum.add(point), new Vector3()).divideScalar(points.length);
      for (const point of [centre, ...points]) {
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

  private get inner(): Inner {
    return this.controls as unknown as Inner;
  }
}
