/** Cameras in the coordinates of a file of splats, whose means are relative to the center of the field. */
import type { Vec3 } from "../field/level";
import type { PinholeCamera } from "../field/march_uniforms";
import type { Depths } from "./depth_order";
import type { SplatHeader } from "./splat_file";

/** The camera's position relative to the center of the splats. */
export function relativeEye({ center: center }: SplatHeader, { c2w }: PinholeCamera): Vec3 {
  return [c2w[3] - center[0], c2w[7] - center[1], c2w[11] - center[2]];
}

/** The smallest depth at which splats are drawn, at least `near`. */
export function nearDepth(header: SplatHeader, near: number): number {
  return Math.max(near, header.near);
}

/** The depth function by which splats are sorted. */
export function sortDepths(header: SplatHeader, camera: PinholeCamera, near: number): Depths {
  const { c2w } = camera;
  const [x, y, z] = relativeEye(header, camera);
  const axis: Vec3 = [-c2w[2], -c2w[6], -c2w[10]];
  return { axis, offset: -(axis[0] * x + axis[1] * y + axis[2] * z), near: nearDepth(header, near) };
}

/** A distance beyond the bounds of the field. */
export function farDistance(header: SplatHeader, camera: PinholeCamera): number {
  const [low, high] = header.bounds;
  return (
    Math.hypot(...relativeEye(header, camera)) + Math.hypot(...high.map((value, axis) => value - low[axis]))
  );
}
