/** Order in which nodes of splats are loaded: those that are largest in the camera's image come first. */
import type { Vec3 } from "../field/level";
import type { PinholeCamera } from "../field/march_uniforms";
import type { SplatNode } from "./splat_file";

/** Priority of a node outside the image, against one of the same size inside. */
const OUTSIDE = 0.02;

type Bounded = Pick<SplatNode, "bounds">;

/** Angular size of a node's box; less where the box lies outside the image. */
export function nodePriority(node: Bounded, camera: PinholeCamera): number {
  const { radius, distance } = sphereFrom(node, camera);
  return (radius / distance) * (isInImage(node, camera) ? 1 : OUTSIDE);
}

/** Whether the image may show a part of a node's box: the box's sphere meets the camera's frustum. */
export function isInImage(node: Bounded, camera: PinholeCamera): boolean {
  const { ray, radius } = sphereFrom(node, camera);
  const { c2w } = camera;
  const along = (column: number): number =>
    ray.reduce((sum, value, k) => sum + value * c2w[4 * k + column], 0);
  const depth = -along(2);
  return (
    depth > -radius &&
    Math.abs(along(0)) - radius <= (Math.max(depth, radius) * 0.5 * camera.width) / camera.fx &&
    Math.abs(along(1)) - radius <= (Math.max(depth, radius) * 0.5 * camera.height) / camera.fy
  );
}

/** The ray from the camera to the middle of a node's sphere, its radius, and the distance of its surface. */
function sphereFrom(
  { bounds: [low, high] }: Bounded,
  { c2w }: PinholeCamera,
): { ray: Vec3; radius: number; distance: number } {
  const half = low.map((value, k) => 0.5 * (high[k] - value));
  const ray = low.map((value, k) => value + half[k] - c2w[4 * k + 3]) as Vec3;
  const radius = Math.hypot(...half);
  return { ray, radius, distance: Math.max(Math.hypot(...ray) - radius, 0.1 * radius, 1e-9) };
}
