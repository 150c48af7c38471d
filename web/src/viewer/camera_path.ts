/** Camera path of an exported scene: closely spaced views, interpolated linearly. */
import { column, cross, poseMatrix, subtract, add, dot, normalize } from "./vectors";
import type { Vec3 } from "./vectors";

export interface View {
  c2w: number[];
  fov_y_deg: number;
}

export interface Path {
  stills: View[];
  seconds: number;
  loop: boolean;
}

/** The numbers of the stills before and after a time in seconds, and the share of the way between them. */
function stillsAt(
  { stills, seconds, loop }: Path,
  time: number,
): { one: number; other: number; share: number } {
  const passed = seconds > 0 ? time / seconds : 1;
  const last = stills.length - 1;
  const at = loop ? (passed % 1) * stills.length : Math.min(passed, 1) * last;
  const one = Math.min(Math.floor(at), last);
  const other = loop ? (Math.floor(at) + 1) % stills.length : Math.min(Math.floor(at) + 1, last);
  return { one, other, share: at - Math.floor(at) };
}

/** The place of a point at a time, of its places at the path's stills; null where either neighbor has none. */
export function placeAt(places: readonly (Vec3 | null)[], path: Path, time: number): Vec3 | null {
  const { one, other, share } = stillsAt(path, time);
  const from = places[one];
  const to = places[other];
  return from === null || to === null ? null : add(from, subtract(to, from), share);
}

/** The view at a time in seconds; after the end of a path without a loop, its last view. */
export function viewAt(path: Path, time: number): View {
  const found = stillsAt(path, time);
  const one = path.stills[found.one];
  const other = path.stills[found.other];
  const t = found.share;
  const mixed = (n: number): [number, number, number] =>
    add(column(one.c2w, n), subtract(column(other.c2w, n), column(one.c2w, n)), t);
  const back = normalize(mixed(2));
  const up = mixed(1);
  const level = normalize(
    subtract(up, [back[0] * dot(up, back), back[1] * dot(up, back), back[2] * dot(up, back)]),
  );
  return {
    c2w: poseMatrix(cross(level, back), level, back, mixed(3)),
    fov_y_deg: one.fov_y_deg + t * (other.fov_y_deg - one.fov_y_deg),
  };
}

/**
 * The interval of rising times around a moment: the index of its start, and the share of it that has passed,
 * in [0,1].
 */
export function intervalAt(times: Float32Array, seconds: number): { first: number; share: number } {
  const last = times.length - 1;
  let first = 0;
  while (first < last - 1 && times[first + 1] <= seconds) first++;
  const share = (seconds - times[first]) / Math.max(1e-9, times[first + 1] - times[first]);
  return { first, share: Math.max(0, Math.min(1, share)) };
}
