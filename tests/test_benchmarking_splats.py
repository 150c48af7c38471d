"""`bench edits` on splats: what is trained, and what the table says of it."""

from __future__ import annotations

from pathlib import Path

from benchmarks.captures.train_captures import Budget, splat_config
from benchmarks.commands.bench_edits import BenchEdits
from benchmarks.common.workbench import Settings
from benchmarks.edits.edits_table import table

from cagefield.cli.options import TrainingOptions
from cagefield.training.splats.splat_config import SplatConfig
from commands import refused


def test_the_command_trains_splats_for_the_time_or_the_steps_that_are_given() -> None:
    timed = BenchEdits(field="splat", training=TrainingOptions(minutes=2.0, seed=3))._config()
    assert timed == SplatConfig(minutes=2.0, seed=3)
    counted = BenchEdits(field="splat", training=TrainingOptions(steps=70, sh_degree=1))._config()
    assert counted == SplatConfig(steps=70, sh_degree=1)
    assert splat_config(Budget(steps=9, splats=500)) == SplatConfig(steps=9, splats=500)


def test_methods_are_not_compared_on_splats(tmp_path: Path, capsys) -> None:
    text = refused(capsys, "bench", "edits", "--field", "splat", "-o", tmp_path / "edits.md")
    assert "methods are compared on voxels only; give --no-methods with --field splat" in text


def test_the_table_says_that_the_fields_are_splats() -> None:
    text = table([], Settings(config=SplatConfig(steps=70, splats=5000, sh_degree=1))).markdown()
    assert "trained for 70 steps: splats of degree 1, 5000 at most." in text
    assert "voxels along" not in text and "samples a ray" not in text
    assert (
        "trained for 5 minutes: splats of degree 2."
        in table([], Settings(config=SplatConfig(minutes=5.0))).markdown()
    )
