/**
 * Carriers: affine maps by which the parents of an edit carry its cages. The server has cages and operations at rest;
 * the page draws and picks the carried cages, and brings motions back to rest.
 */
import { Matrix3, Quaternion, Vector3 } from "three";
import { orthogonalFactor, type Posed } from "./cage";
import type { Cages } from "./drag";
import type { Operation } from "./operations";
import type { Carried, Corners, EditState, State, Vec3 } from "../net/protocol";

/** A matrix [3,4], row by row; null for an edit that nothing carries. */
export type Carrier = EditState["carrier"];

/** The point at rest, carried. */
export function carryPoint(carrier: Carrier, [x, y, z]: Vec3): Vec3 {
  if (carrier === null) return [x, y, z];
  return [0, 4, 8].map(
    (row) => carrier[row] * x + carrier[row + 1] * y + carrier[row + 2] * z + carrier[row + 3],
  ) as Vec3;
}

/** The cages of an edit where its parents carry them. */
export function carryCages(carrier: Carrier, cages: Cages): Cages {
  if (carrier === null) return cages;
  return {
    inner: carryCage(carrier, cages.inner),
    deformed: carryCage(carrier, cages.deformed),
    outer: cages.outer && carryCage(carrier, cages.outer),
  };
}

/** The rotation of a carrier; none without a carrier. */
export function carrierRotation(carrier: Carrier): Quaternion {
  return carrier === null ? new Quaternion() : orthogonalFactor(linearPart(carrier));
}

/**
 * The operation at rest whose carried effect is that of an operation on carried cages. Vectors go back through the
 * linear part; rotations and factors are along the gizmo's axes, which are carried already.
 */
export function operationAtRest(carrier: Carrier, operation: Operation): Operation {
  if (carrier === null || !("by" in operation) || operation.kind === "scale") return operation;
  const by = new Vector3(...operation.by).applyMatrix3(linearPart(carrier).invert()).toArray();
  return { ...operation, by: by.map((x) => Math.round(x * 1e9) / 1e9) as Vec3 };
}

/** The state with other carriers of some edits. */
export function withCarriers(state: State, carried: readonly Carried[]): State {
  const carriers = new Map(carried.map(({ edit, carrier }) => [edit, carrier]));
  const edits = state.edits.map((edit) => {
    const carrier = carriers.get(edit.id);
    return carrier === undefined ? edit : { ...edit, carrier };
  });
  return { ...state, edits };
}

function carryCage(carrier: Carrier, cage: Posed): Posed {
  const carried = {
    ...cage,
    corners: cage.corners.map((corner) => carryPoint(carrier, corner)) as Corners,
    pivot: carryPoint(carrier, cage.pivot),
  };
  if (cage.points === undefined) return carried;
  return { ...carried, points: cage.points.map((point) => carryPoint(carrier, point)) };
}

function linearPart(carrier: NonNullable<Carrier>): Matrix3 {
  const [a, b, c, , d, e, f, , g, h, i] = carrier;
  return new Matrix3().set(a, b, c, d, e, f, g, h, i);
}
