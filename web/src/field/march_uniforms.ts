/** Uniforms of the ray march: the field's grid and the camera. */
import type { AtlasLayout } from "./atlas";
import type { Program } from "./gl";
import type { Level, Occupancy, Vec3 } from "./level";

type GL = WebGL2RenderingContext;

/** A pinhole camera: camera-to-world matrix row by row (OpenGL axes), intrinsics in pixels. */
export interface PinholeCamera {
  c2w: readonly number[];
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
}

/** Sets the uniforms of a level; `step` is the distance between samples in voxels. */
export function setFieldUniforms(
  gl: GL,
  uniform: Program["uniform"],
  level: Level,
  layout: AtlasLayout,
  occupancy: Occupancy,
  step: number,
): void {
  const { bounds, contracted } = level.field;
  const { resolution, unit, steps } = level.header;
  const { atlasBricks: across, edge, dims } = layout;
  const size = bounds[1].map((high, axis) => high - bounds[0][axis]);
  const scale = size.map((length, axis) => (contracted ? 2 / length : (resolution[axis] - 1) / length));
  const lower = bounds[0].map((low, axis) => (contracted ? 0.5 * (low + bounds[1][axis]) : low));
  gl.uniform3f(uniform("atlasScale"), 1 / (across[0] * edge), 1 / (across[1] * edge), 1 / (across[2] * edge));
  gl.uniform3i(uniform("indexDims"), ...dims);
  gl.uniform3i(uniform("bricksOrigin"), ...occupancy.origin);
  gl.uniform3i(uniform("bricksDims"), ...occupancy.dims);
  gl.uniform3i(uniform("resolution"), ...resolution);
  gl.uniform3fv(uniform("lower"), lower);
  gl.uniform3fv(uniform("scale"), scale);
  gl.uniform3fv(
    uniform("halfGrid"),
    resolution.map((n) => (n - 1) / 4),
  );
  gl.uniform1f(uniform("unit"), unit);
  gl.uniform1f(uniform("marchStep"), contracted ? step : step / Math.max(...scale));
  gl.uniform1fv(uniform("coefficientSteps"), steps);
}

/** Sets the uniforms of a camera, for an image of the targets' size. */
export function setCameraUniforms(
  gl: GL,
  uniform: Program["uniform"],
  camera: PinholeCamera,
  { width, height }: { width: number; height: number },
): void {
  const { c2w } = camera;
  const across = width / camera.width;
  const down = height / camera.height;
  gl.uniform3f(uniform("eye"), c2w[3], c2w[7], c2w[11]);
  gl.uniformMatrix3fv(uniform("rotation"), true, [
    c2w[0],
    c2w[1],
    c2w[2],
    c2w[4],
    c2w[5],
    c2w[6],
    c2w[8],
    c2w[9],
    c2w[10],
  ]);
  gl.uniform4f(uniform("lens"), camera.fx * across, camera.fy * down, camera.cx * across, camera.cy * down);
  gl.uniform1f(uniform("height"), height);
}

/** The smallest and the largest distance of a box from a camera. */
export function distanceRange([low, high]: readonly [Vec3, Vec3], camera: PinholeCamera): [number, number] {
  const radius = 0.5 * Math.hypot(...high.map((x, axis) => x - low[axis]));
  const distance = Math.hypot(...high.map((x, axis) => 0.5 * (x + low[axis]) - camera.c2w[4 * axis + 3]));
  return [Math.max(0, distance - radius), distance + radius];
}
