import type { Posed } from "../src/editing/cage";
import { describe, expect, it } from "vitest";
import cases from "../../tests/fixtures/cage_operations.json";
import { apply, scaleOperation } from "../src/editing/operations";
import type { Operation } from "../src/editing/operations";
import { expectClose } from "./cages";

/** A case of the fixture that `tests/cage_operations.py` writes. */
interface Case {
  cage: Posed;
  operation: Operation;
  share: number;
  expected: Posed;
  expected_share: Posed;
}

function expectCage(cage: Posed, expected: Posed): void {
  cage.corners.forEach((corner, k) => expectClose(corner, expected.corners[k]));
  expectClose(cage.pivot, expected.pivot);
}

describe("operations on cages, as Python applies them", () => {
  it("cover every kind", () => {
    const kinds = new Set(cases.map(({ operation }) => operation.kind));
    expect([...kinds].sort()).toEqual(["move_corners", "rotate", "scale", "shear", "translate"]);
  });

  it.each(cases.map((each, n) => ({ name: `${n}: ${each.operation.kind}`, each: each as unknown as Case })))(
    "$name",
    ({ each }) => {
      expectCage(apply(each.operation, each.cage), each.expected);
      expectCage(apply(scaleOperation(each.operation, each.share), each.cage), each.expected_share);
    },
  );
});
