"""The published edit benchmark: written by one command, evaluated without the package."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.edits.edit_quality import mean_psnr
from benchmarks.edits.publication import OURS, UNEDITED

from cagefield.cli import main
from cagefield.edits import load_edits
from cagefield.images.image_files import read_image
from commands import refused

pytestmark = pytest.mark.nightly

OPTIONS = (
    "--views", "8", "--size", "32", "--test-views", "2", "--exact-size", "24", "--exact-views", "1",
    "--steps", "40", "--resolution", "20",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a continuous edit and a move of the digger, and one peer."""
    out = tmp_path_factory.mktemp("published") / "data"
    edits = ("--edits", "turn_cabin", "move_cone", "--methods", "trilinear")
    assert main(["bench", "publish", str(out), *edits, *OPTIONS]) == 0
    return out


def test_the_script_needs_no_package_and_gives_the_table(folder: Path, tmp_path: Path) -> None:
    """Isolated Python that cannot import cagefield; the figures are those of the package's own metric."""
    blocked = tmp_path / "cagefield.py"
    blocked.write_text('raise ImportError("not here")')
    rows_file = tmp_path / "rows.json"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [sys.executable, str(folder / "evaluate.py"), "--json", str(rows_file)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == (folder / "table.md").read_text(encoding="utf-8")
    rows = json.loads(rows_file.read_text())
    assert rows == json.loads((folder / "table.json").read_text())
    found = {(row["case"], row["method"]): row for row in rows}
    cases = ("digger-turn_cabin", "digger-move_cone")
    assert set(found) == {(case, m) for case in cases for m in (OURS, UNEDITED)} | {(cases[0], "trilinear")}
    for (case, method), row in found.items():
        place = folder / "cases" / case
        truth = place / ("truth, trilinear" if method == "trilinear" else "truth")
        pictures = [
            np.stack([read_image(file) for file in sorted(where.iterdir())])
            for where in (folder / "results" / method / case, truth)
        ]
        # The package compares float32 pictures.
        assert row["psnr"] == pytest.approx(mean_psnr(*pictures), abs=1e-4)
    # Doing nothing is worse than the edit where a part moves.
    assert found[cases[1], OURS]["psnr_changed"] > found[cases[1], UNEDITED]["psnr_changed"]


def test_the_folder_has_what_its_readme_says(folder: Path) -> None:
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert "@" not in readme.split("## Licence")[1] and "cagefield bench publish OUT --edits" in readme
    for entry in json.loads((folder / "cases.json").read_text())["cases"]:
        place = folder / "cases" / entry["id"]
        assert len(load_edits(place / "edit.yaml")) >= 1
        assert len(json.loads((place / "cameras.json").read_text())) == entry["views"]
        for name in ("before", "truth", "changed"):
            assert len(list((place / name).iterdir())) == entry["views"]
            assert read_image(place / name / "000.png").shape[:2] == (entry["height"], entry["width"])
    assert (folder / "scenes" / "digger" / "transforms_train.json").is_file()


def test_overwrite_replaces_what_a_call_wrote_and_keeps_the_rest(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another edit, without peers, in place of two: nothing of the two is left."""
    out = tmp_path / "again"
    shutil.copytree(folder, out)
    (out / "notes.txt").write_text("mine")
    (out / "results" / "mine").mkdir()
    words = ("bench", "publish", out, "--edits", "copy_cone", "--methods", *OPTIONS, "--overwrite")
    assert "mine is not of this command; move it away" in refused(capsys, *words)
    assert (out / "cases" / "digger-move_cone").is_dir()
    (out / "results" / "mine").rmdir()
    assert main([str(word) for word in words]) == 0
    assert [entry.name for entry in (out / "cases").iterdir()] == ["digger-copy_cone"]
    assert {entry.name for entry in (out / "results").iterdir()} == {OURS, UNEDITED}
    assert (out / "notes.txt").read_text() == "mine"


def test_a_folder_of_something_else_is_left(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    message = refused(capsys, "bench", "publish", tmp_path, *OPTIONS, "--overwrite")
    assert "holds no cases.json and is left as it is" in message
