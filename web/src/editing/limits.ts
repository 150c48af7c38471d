/**
 * Estimated limit of a drag, ahead of the server's answer: from the outer cage, and from the share that the server
 * granted last. The server's answer is authoritative.
 */
import type { Posed } from "./cage";
import { Matrix3, Vector3 } from "three";
import { operationSize, apply, scaleOperation, type Operation } from "./operations";
import { handlesOf } from "./point_cages";
import type { Corners, Vec3 } from "../net/protocol";

const COORDINATE_TOLERANCE = 1e-9;

/** Whether a point lies in the cage; Newton's method inverts the trilinear map. */
export function contains(corners: Corners, point: Vec3): boolean {
  const target = new Vector3(...point);
  const u = new Vector3(0.5, 0.5, 0.5);
  for (let step = 0; step < 20; step++) {
    const { position, jacobian } = trilinearMap(corners, u);
    const change = target.clone().sub(position).applyMatrix3(jacobian.invert());
    u.add(change).clampScalar(-1, 2);
    if (change.lengthSq() < 1e-24) break;
  }
  if (trilinearMap(corners, u).position.distanceTo(target) > 1e-6) return false;
  return [u.x, u.y, u.z].every((x) => x >= -COORDINATE_TOLERANCE && x <= 1 + COORDINATE_TOLERANCE);
}

/**
 * Largest share of the operation, to 1e-3, for which the cage stays inside the outer cage; 1 without an outer
 * cage.
 */
export function containedShare(operation: Operation, cage: Posed, outer: Corners | null): number {
  if (outer === null) return 1;
  const inside = (t: number): boolean =>
    handlesOf(apply(scaleOperation(operation, t), cage)).every((handle) => contains(outer, handle));
  if (inside(1) || !inside(0)) return 1;
  const steps = operation.kind === "rotate" ? 16 : 4;
  let high = 1;
  for (let n = 1; n <= steps; n++) {
    if (!inside(n / steps)) {
      high = n / steps;
      break;
    }
  }
  let low = high - 1 / steps;
  while (high - low > 1e-3) {
    const mid = 0.5 * (low + high);
    if (inside(mid)) low = mid;
    else high = mid;
  }
  return low;
}

/** Estimated share of an operation that the server will grant, from the granted share of the last operation. */
export function expectedShare(
  operation: Operation,
  last: { operation: Operation; part: number } | null,
): number {
  if (last === null || last.part >= 1 || last.operation.kind !== operation.kind) return 1;
  const size = operationSize(operation);
  return size > 0 ? Math.min(1, (last.part * operationSize(last.operation)) / size) : 1;
}

function trilinearMap(corners: Corners, u: Vector3): { position: Vector3; jacobian: Matrix3 } {
  const position = new Vector3();
  const columns = [new Vector3(), new Vector3(), new Vector3()];
  const w = [u.x, u.y, u.z];
  corners.forEach((corner, k) => {
    const bits = [k & 1, (k >> 1) & 1, (k >> 2) & 1];
    const factor = bits.map((bit, axis) => (bit ? w[axis] : 1 - w[axis]));
    const v = new Vector3(...corner);
    position.addScaledVector(v, factor[0] * factor[1] * factor[2]);
    columns.forEach((column, axis) => {
      const others = factor[(axis + 1) % 3] * factor[(axis + 2) % 3];
      column.addScaledVector(v, bits[axis] ? others : -others);
    });
  });
  const [x, y, z] = columns;
  return { position, jacobian: new Matrix3().set(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z) };
}
