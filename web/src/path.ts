/** The camera path between its keyframes, as the page plays it. */
import { CatmullRomCurve3, MathUtils, Matrix4, Quaternion, Vector3 } from "three";
import type { Key } from "./protocol";

export interface PathView {
  c2w: number[];
  fov_y_deg: number;
}

/** How long the path takes, seconds: each key's time to the next one; the last counts where the path is a loop. */
export function duration(keys: readonly Key[], loop: boolean): number {
  const legs = loop ? keys : keys.slice(0, -1);
  return keys.length < 2 ? 0 : legs.reduce((sum, key) => sum + key.seconds, 0);
}

/** The camera at a time: positions on a centripetal curve through the keys, directions turned between them. */
export function viewAt(keys: readonly Key[], loop: boolean, seconds: number): PathView {
  if (keys.length < 2) return { c2w: keys[0].c2w, fov_y_deg: keys[0].fov_y_deg };
  const legs = loop ? keys.length : keys.length - 1;
  let leg = 0;
  let rest = Math.min(Math.max(seconds, 0), duration(keys, loop));
  while (leg < legs - 1 && rest > keys[leg].seconds) rest -= keys[leg++].seconds;
  const t = MathUtils.clamp(rest / keys[leg].seconds, 0, 1);
  const poses = keys.map(({ c2w }) => new Matrix4().fromArray(c2w).transpose());
  const places = poses.map((pose) => new Vector3().setFromMatrixPosition(pose));
  const place = new CatmullRomCurve3(places, loop, "centripetal").getPoint((leg + t) / legs);
  const after = (leg + 1) % keys.length;
  const from = new Quaternion().setFromRotationMatrix(poses[leg]);
  const to = new Quaternion().setFromRotationMatrix(poses[after]);
  const pose = new Matrix4().compose(place, from.slerp(to, t), new Vector3(1, 1, 1));
  const fov_y_deg = MathUtils.lerp(keys[leg].fov_y_deg, keys[after].fov_y_deg, t);
  return { c2w: pose.transpose().toArray(), fov_y_deg };
}
