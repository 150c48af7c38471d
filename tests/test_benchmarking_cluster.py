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
from commands import printed

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
        revealed = [None if one.revealed is None else asdict(one.revealed) for one in (score, expected)]
        np.testing.assert_equal(*revealed)


def test_the_command_prints_the_scores_of_one_process(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "bench", "edits", "--scenes", "chair", "--edits", "delete_back", "--views", 8, "--size", 32,
        "--test-views", 3, "--steps", 60, "--resolution", 24, "--workdir", tmp_path / "work", "--no-methods",
    ]  # fmt: skip
    many = printed(capsys, *words, "-o", tmp_path / "many.md", "--cluster", 2)
    one = printed(capsys, *words, "-o", tmp_path / "one.md")
    (line,) = [line for line in one.splitlines() if line.startswith("chair, delete_back: PSNR ")]
    assert line in many.splitlines() and "chair: done" in many
    texts = [(tmp_path / name).read_text(encoding="utf-8") for name in ("one.md", "many.md")]
    assert [text.count("| chair | delete back |") for text in texts] == [1, 1]
    assert texts[0].count("--cluster") == texts[1].count("--cluster") == 0
