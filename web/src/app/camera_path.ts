/** Camera path in the editor: the server's closely spaced cameras, interpolated between neighbors. */
import { MathUtils, Matrix4, Quaternion, Vector3 } from "three";
import type { HotspotTrack, Key, Still, Vec3 } from "../net/protocol";

/**
 * Duration of the path in seconds: the sum of the keys' times to the next key; the last key counts in a loop
 * only.
 */
export function pathDuration(keys: readonly Key[], loop: boolean): number {
  const legs = loop ? keys : keys.slice(0, -1);
  return keys.length < 2 ? 0 : legs.reduce((sum, key) => sum + key.seconds, 0);
}

/**
 * The camera at a share of the path's duration: position and field of view linear, rotation spherical linear.
 */
export function stillAt(stills: readonly Still[], share: number): Still {
  const at = MathUtils.clamp(share, 0, 1) * (stills.length - 1);
  const before = Math.min(Math.floor(at), stills.length - 2);
  const [one, other] = stills.slice(before);
  const t = at - before;
  const poses = [one, other].map(({ c2w }) => new Matrix4().fromArray(c2w).transpose());
  const [from, to] = poses.map((pose) => new Vector3().setFromMatrixPosition(pose));
  const [turned, turnedTo] = poses.map((pose) => new Quaternion().setFromRotationMatrix(pose));
  const pose = new Matrix4().compose(from.lerp(to, t), turned.slerp(turnedTo, t), new Vector3(1, 1, 1));
  return { c2w: pose.transpose().toArray(), fov_y_deg: MathUtils.lerp(one.fov_y_deg, other.fov_y_deg, t) };
}

/** The position of a hotspot at a share of the path's duration; null where it is hidden. */
export function trackAt(places: HotspotTrack["places"], share: number): Vec3 | null {
  const at = MathUtils.clamp(share, 0, 1) * (places.length - 1);
  const before = Math.min(Math.floor(at), places.length - 2);
  const [from, to] = places.slice(before);
  if (from === null || to === null) return null;
  return from.map((value, k) => MathUtils.lerp(value, to[k], at - before)) as Vec3;
}
