"""The edit benchmark on a cluster: the scores of one process."""

from __future__ import annotations

import importlib.util
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from benchmarks.common.cases import chosen
from benchmarks.common.workbench import Workbench
from benchmarks.edits.edit_quality import measure
from benchmarks.edits.edits_cluster import measure_on

from benchmark_settings import TINY

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(
        importlib.util.find_spec("distributed") is None,
        reason="dask.distributed is not installed (extra cluster)",
    ),
]


def test_scores_of_a_cluster_are_those_of_one_process(tmp_path: Path) -> None:
    cases = chosen(["chair"], ["delete_back", "move_arm_rest"])
    bench = Workbench(TINY, tmp_path / "work")
    found = list(measure_on(2, cases, bench, device="cpu"))
    assert [score.case for score in found] == list(cases)
    assert len(list((tmp_path / "work/chair").glob("field-*"))) == 1
    # the fields are there by now: this process trains none
    for score, expected in zip(found, measure(cases, bench), strict=True):
        # figures that a case does not have are NaN
        np.testing.assert_equal(asdict(score.figures), asdict(expected.figures))
        np.testing.assert_equal(asdict(score.revealed), asdict(expected.revealed))
