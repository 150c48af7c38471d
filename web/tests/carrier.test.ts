import { describe, expect, it } from "vitest";
import { Matrix3, Quaternion, Vector3 } from "three";
import {
  carrierRotation,
  carryCages,
  carryPoint,
  operationAtRest,
  withCarriers,
} from "../src/editing/carrier";
import { cagesOf } from "../src/editing/drag";
import { apply, type Operation } from "../src/editing/operations";
import { candidates } from "../src/ui/parent_row";
import type { State, Vec3 } from "../src/net/protocol";
import { expectClose } from "./cages";
import { edit } from "./fake_server";

/** A quarter turn about z, twice the size, and a shift. */
const CARRIER = [0, -2, 0, 0.5, 2, 0, 0, -0.25, 0, 0, 2, 1];

describe("carriers", () => {
  it("carry points and cages", () => {
    expectClose(carryPoint(CARRIER, [1, 2, 3]), [-3.5, 1.75, 7]);
    const cages = cagesOf(edit());
    const carried = carryCages(CARRIER, cages);
    cages.deformed.corners.forEach((corner, k) =>
      expectClose(carried.deformed.corners[k], carryPoint(CARRIER, corner)),
    );
    expectClose(carried.inner.pivot, [0.5, -0.25, 1]);
    expect(carryCages(null, cages)).toBe(cages);
  });

  it("turn the axes of the gizmo", () => {
    const quarter = new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), Math.PI / 2);
    expect(carrierRotation(CARRIER).angleTo(quarter)).toBeLessThan(1e-7);
    expect(carrierRotation(null).angleTo(new Quaternion())).toBe(0);
  });

  it("bring motions back to rest, where they have the carried effect", () => {
    const by: Vec3 = [0.2, -0.4, 0.1];
    const linear = new Matrix3().set(0, -2, 0, 2, 0, 0, 0, 0, 2);
    for (const operation of [
      { kind: "translate", by },
      { kind: "move_corners", corners: [0, 3], by },
    ] as Operation[]) {
      const { deformed } = cagesOf(edit());
      const atRest = operationAtRest(CARRIER, operation);
      const seen = apply(operation, carryCages(CARRIER, cagesOf(edit())).deformed);
      apply(atRest, deformed).corners.forEach((corner, k) =>
        expectClose(carryPoint(CARRIER, corner), seen.corners[k], 8),
      );
      expectClose(new Vector3(...(atRest as { by: Vec3 }).by).applyMatrix3(linear).toArray(), by, 8);
    }
    const turn: Operation = { kind: "rotate", rotation_deg: [0, 0, 30], axes: "world" };
    const scale: Operation = { kind: "scale", by: [2, 1, 1], axes: "world" };
    expect(operationAtRest(CARRIER, turn)).toBe(turn);
    expect(operationAtRest(CARRIER, scale)).toBe(scale);
    expect(operationAtRest(null, { kind: "translate", by })).toEqual({ kind: "translate", by });
  });
});

describe("carriers during a drag", () => {
  it("take the place of those of the edits that are carried, and of no others", () => {
    const finger = edit({ id: 2, carrier: null });
    const other = edit({ id: 3, carrier: CARRIER });
    const back = edit({ id: 4, carrier: CARRIER });
    const state = { edits: [finger, other, back] } as unknown as State;
    const { edits } = withCarriers(state, [
      { edit: 2, carrier: CARRIER },
      { edit: 4, carrier: null },
    ]);
    expect(edits.map((each) => each.carrier)).toEqual([CARRIER, CARRIER, null]);
    expect(edits[1]).toBe(other);
    expect(finger.carrier).toBeNull();
  });
});

describe("candidates for a parent", () => {
  it("are named edits that are no pastes and not carried by the edit itself", () => {
    const arm = edit({ id: 1, name: "arm" });
    const hand = edit({ id: 2, name: "hand", parent: 1 });
    const finger = edit({ id: 3, name: "finger", parent: 2 });
    const paste = edit({ id: 4, name: "paste", source: "x" });
    const nameless = edit({ id: 5, name: "" });
    const all = [arm, hand, finger, paste, nameless];
    expect(candidates(finger, all)).toEqual([
      ["arm", 1],
      ["hand", 2],
    ]);
    expect(candidates(arm, all)).toEqual([]);
    expect(candidates(hand, all)).toEqual([["arm", 1]]);
  });
});
