"""Writer of `fixtures/cage_operations.json`: operations on random cages, shared with the tests of the page.

Run `python tests/cage_operations.py` after an intended change of an operation. Each case has the cage
(corners [8,3], pivot [3]), the operation in the words of the protocol, a share t of it, and the expected
cages after the whole operation and after the share.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from cagefield import Cage
from cagefield.edits.operations import MoveCorners, Operation, Rotate, Scale, Shear, Translate

PATH = Path(__file__).parent / "fixtures" / "cage_operations.json"
CASES_PER_KIND = 4
KINDS = ("translate", "rotate", "scale", "shear", "move_corners")
SHEARS = ("xy", "xz", "yx", "yz", "zx", "zy")


def random_cases(seed: int = 42) -> list[dict[str, Any]]:
    """Cases of every kind of operation, without expected cages."""
    rng = np.random.default_rng(seed)
    cases = []
    for kind in KINDS:
        for index in range(CASES_PER_KIND):
            box = Cage.box(rng.uniform(-2, 2, 3), rng.uniform(0.5, 2, 3), rng.uniform(-3, 3, 3))
            cage = Cage(box.corners + rng.uniform(-0.05, 0.05, (8, 3)), pivot=rng.uniform(-2, 2, 3))
            operation: dict[str, Any] = {"kind": kind}
            if kind in ("translate", "move_corners"):
                operation["by"] = rng.uniform(-0.1, 0.1, 3).tolist()
            elif kind == "rotate":
                operation["rotation_deg"] = rng.uniform(-89, 89, 3).tolist()
            elif kind == "scale":
                operation["by"] = rng.uniform(0.5, 2, 3).tolist()
            else:
                operation |= {name: float(rng.uniform(-0.3, 0.3)) for name in SHEARS}
            if kind == "move_corners":
                operation["corners"] = sorted(rng.choice(8, 1 + index, replace=False).tolist())
            elif kind != "translate":
                operation["axes"] = ("world", "cage")[index % 2]
            cases.append(
                {"cage": cage_json(cage), "operation": operation, "share": float(rng.uniform(0.1, 0.9))}
            )
    return cases


def cage_json(cage: Cage) -> dict[str, Any]:
    """Corners [8,3] and pivot [3] of a cage."""
    return {"corners": cage.corners.tolist(), "pivot": cage.pivot.tolist()}


def operation_from_json(node: dict[str, Any]) -> Operation:
    """Operation of a case."""
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in node.items()}
    kind = values.pop("kind")
    if kind == "rotate":
        return Rotate(values.pop("rotation_deg"), **values)
    types: dict[str, type[Any]] = {
        "translate": Translate,
        "scale": Scale,
        "shear": Shear,
        "move_corners": MoveCorners,
    }
    operation: Operation = types[kind](**values)
    return operation


def results(case: dict[str, Any]) -> tuple[Cage, Cage]:
    """(cage after the whole operation, cage after its share) of a case, by `cagefield.edits.operations`."""
    cage = Cage(np.array(case["cage"]["corners"]), pivot=np.array(case["cage"]["pivot"]))
    operation = operation_from_json(case["operation"])
    return operation.apply(cage), operation.part(case["share"]).apply(cage)


def main() -> None:
    """Write the fixture."""
    cases = []
    for case in random_cases():
        whole, share = results(case)
        cases.append({**case, "expected": cage_json(whole), "expected_share": cage_json(share)})
    PATH.parent.mkdir(exist_ok=True)
    lines = ",\n".join(json.dumps(case) for case in cases)
    PATH.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
