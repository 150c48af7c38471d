/** Camera path of an exported scene: closely spaced views, interpolated linearly. */
import { column, cross, poseMatrix, subtract, add, dot, normalize } from "./vectors";

export interface View {
  c2w: number[];
  fov_y_deg: number;
}

export interface Path {
  stills: View[];
  seconds: number;
  loop: boolean;
}

/** The view at a time in seconds; after the end of a path without a loop, its last view. */
export function viewAt({ stills, seconds, loop }: Path, time: number): View {
  const share = seconds > 0 ? time / seconds : 1;
  const last = stills.length - 1;
  const at = loop ? (share % 1) * stills.length : Math.min(share, 1) * last;
  const one = stills[Math.min(Math.floor(at), last)];
  const other = stills[loop ? (Math.floor(at) + 1) % stills.length : Math.min(Math.floor(at) + 1, last)];
  const t = at - Math.floor(at);
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
