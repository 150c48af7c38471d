"""Operations on cages against the fixture of the page's tests (`web/tests/cage_operations.test.ts`)."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from cage_operations import KINDS, PATH, results
from cagefield.edits.operations import Rotate

CASES: list[dict[str, Any]] = json.loads(PATH.read_text(encoding="utf-8"))


def test_the_fixture_has_every_kind_of_operation() -> None:
    assert {case["operation"]["kind"] for case in CASES} == set(KINDS)


@pytest.mark.parametrize("index", range(len(CASES)))
def test_operations_give_the_cages_of_the_fixture(index: int) -> None:
    case = CASES[index]
    for cage, expected in zip(results(case), (case["expected"], case["expected_share"]), strict=True):
        # Rounding of float64 in another order, on another machine's libraries.
        np.testing.assert_allclose(cage.corners, expected["corners"], rtol=0, atol=1e-12)
        np.testing.assert_allclose(cage.pivot, expected["pivot"], rtol=0, atol=1e-12)


def test_texts_of_rotations_have_no_rounding_of_fits() -> None:
    assert str(Rotate((-1.4e-09, 2.7e-09, 30.00000000001))) == "by (0, 0, 30) degrees"
    assert str(Rotate((0.25, -1e-4, 0.0))) == "by (0.25, -0.0001, 0) degrees"
