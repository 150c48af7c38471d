/** Order in which nodes of splats are loaded: those that are largest in the camera's image come first. */
import type { Vec3 } from "../field/level";
import type { PinholeCamera } from "../field/march_uniforms";
import type { SplatNode } from "./splat_file";

/** Priority of a node outside the image, against one of the same size inside. */
const OUTSIDE = 0.02;

/** Angular size of a node's box; less where the box lies outside the image. */
export function nodePriority(
  { bounds: [low, high] }: Pick<SplatNode, "bounds">,
  camera: PinholeCamera,
): number {
  const { c2w } = camera;
  const half = low.map((value, k) => 0.5 * (high[k] - value));
  const ray = low.map((value, k) => value + half[k] - c2w[4 * k + 3]) as Vec3;
  const radius = Math.hypot(...half);
  const distance = Math.max(Math.hypot(...ray) - radius, 0.1 * radius, 1e-9);
  const along = (column: number): number =>
    ray.reduce((sum, value, k) => sum + value * c2w[4 * k + column], 0);
  const depth = -along(2);
  const inside =
    depth > -radius &&
    Math.abs(along(0)) - radius <= (Math.max(depth, radius) * 0.5 * camera.width) / camera.fx &&
    Math.abs(along(1)) - radius <= (Math.max(depth, radius) * 0.5 * camera.height) / camera.fy;
  return (radius / distance) * (inside ? 1 : OUTSIDE);
}

/** Takes the node of the highest priority out of a list. */
export function takeNext(nodes: SplatNode[], camera: PinholeCamera | null): SplatNode | undefined {
  if (camera === null) return nodes.shift();
  let best = 0;
  const priorities = nodes.map((node) => nodePriority(node, camera));
  priorities.forEach((priority, n) => {
    if (priority > priorities[best]) best = n;
  });
  return nodes.splice(best, 1)[0];
}
