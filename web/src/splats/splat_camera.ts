/** A camera beside the splats of a file, whose means are less their centre. */
import type { Vec3 } from "../field/level";
import type { PinholeCamera } from "../field/march_uniforms";
import type { Depths } from "./depth_order";
import type { SplatHeader } from "./splat_file";

/** The camera's place, less the splats' centre. */
export function eyeOf({ centre }: SplatHeader, { c2w }: PinholeCamera): Vec3 {
  return [c2w[3] - centre[0], c2w[7] - centre[1], c2w[11] - centre[2]];
}

/** The depth from which splats are drawn, at least `near`. */
export function nearestOf(header: SplatHeader, near: number): number {
  return Math.max(near, header.near);
}

/** What splats are sorted by. */
export function depthsOf(header: SplatHeader, camera: PinholeCamera, near: number): Depths {
  const { c2w } = camera;
  const [x, y, z] = eyeOf(header, camera);
  const axis: Vec3 = [-c2w[2], -c2w[6], -c2w[10]];
  return { axis, offset: -(axis[0] * x + axis[1] * y + axis[2] * z), near: nearestOf(header, near) };
}

/** A distance beyond the box of interest. */
export function farthest(header: SplatHeader, camera: PinholeCamera): number {
  const [low, high] = header.bounds;
  return Math.hypot(...eyeOf(header, camera)) + Math.hypot(...high.map((value, axis) => value - low[axis]));
}
