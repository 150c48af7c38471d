"""What ended programs leave under hidden names: each belongs to one target, whatever others are called."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.common.workbench import Settings, Workbench

from cagefield.cameras.camera import Camera
from cagefield.datasets.sfm import sparse_points
from cagefield.datasets.views import SparsePoints
from cagefield.files import stale_files
from cagefield.files.atomic import recover_folder
from cagefield.files.stale_files import hidden_name, remove_leftovers

LONG = "scene-" + "x" * 150


@pytest.fixture(scope="module")
def ended() -> str:
    """The number of a process that has ended."""
    code = "import os; print(os.getpid())"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip()


def left(target: Path, role: str, process: str) -> Path:
    """What a process has left for a target: a folder with a file."""
    name = hidden_name(target, role).rsplit("-", 2)
    folder = target.with_name("-".join((name[0], process, name[2])))
    folder.mkdir(parents=True)
    (folder / "mine.txt").write_text("mine")
    return folder


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("ball", "ball2"),
        ("ball", "ball.old"),
        ("ball", "ball.work"),
        ("ball", ".ball.cagefield-autosave.json"),
        ("[ab]", "a"),
        (LONG, LONG + "2"),
    ],
)
def test_a_folder_that_was_put_aside_is_of_exactly_one_name(
    tmp_path: Path, ended: str, name: str, other: str
) -> None:
    """Another scene, whose name begins with it, neither removes it nor takes it for its own."""
    folder = left(tmp_path / other, "old", ended)
    assert recover_folder(tmp_path / name, lambda f: True) is None
    (tmp_path / name).mkdir()
    remove_leftovers(tmp_path / name, inside=True)
    assert folder.exists()
    with pytest.warns(UserWarning, match="it is back"):
        assert recover_folder(tmp_path / other, lambda f: True) == folder
    assert (tmp_path / other / "mine.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["ball", LONG, "\N{BASEBALL}" * 60])
def test_what_is_of_a_name_goes_once_something_is_there(tmp_path: Path, ended: str, name: str) -> None:
    target = tmp_path / name
    aside = left(target, "old", ended)
    autosave = left(tmp_path / f".{name}.cagefield-autosave.json", "part", ended)
    training = left(tmp_path / f"{name}.training", "part", ended)
    remove_leftovers(target)
    assert aside.exists() and not autosave.exists() and not training.exists()
    left(target, "new", ended)
    target.mkdir()
    remove_leftovers(target)
    assert list(tmp_path.iterdir()) == [target]


def test_a_folder_put_aside_in_another_stays(tmp_path: Path, ended: str) -> None:
    """A scene in the folder may have no other copy."""
    (tmp_path / "pictures").mkdir()
    aside, half = (left(tmp_path / "pictures" / "ball", role, ended) for role in ("old", "new"))
    remove_leftovers(tmp_path / "pictures", inside=True)
    assert aside.exists() and not half.exists()


@pytest.mark.parametrize("host", ["this", "another"])
def test_a_folder_whose_maker_cannot_be_known_to_have_ended_comes_back_later(
    tmp_path: Path, ended: str, host: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its number is a process's again, or a container has made it; nothing else removes it."""
    target = tmp_path / "ball"
    folder = left(target, "old", str(os.getpid()) if host == "this" else ended)
    if host == "another":
        monkeypatch.setattr(stale_files, "host", lambda: "0a0a0a")
    assert recover_folder(target, lambda f: True) is None
    target.mkdir()
    remove_leftovers(target)
    target.rmdir()
    monkeypatch.setattr(stale_files, "ABANDONED_AFTER_SECONDS", -1.0)
    with pytest.warns(UserWarning, match="it is back"):
        assert recover_folder(target, lambda f: True) == folder


def test_half_a_file_with_a_digests_name_goes_with_the_next_that_is_written(
    tmp_path: Path, ended: str
) -> None:
    """Its own name may not come again: the digest is of a run that was killed."""
    half = [left(tmp_path / "chair" / f"{kind}-00.npz", "part", ended) for kind in ("truth", "other")]
    camera = Camera.look_at((3.0, 0.0, 0.0), (0.0, 0.0, 0.0), width=16, height=16, fov_x=0.5)
    Workbench(Settings(), tmp_path).modeled("chair", [camera])
    assert not any(file.exists() for file in half)
    assert [file.suffix for file in (tmp_path / "chair").iterdir()] == [".npz"]

    half = [left(tmp_path / "points" / "00.npz", "part", ended)]
    sparse_points.write_cached_points(
        tmp_path / "points" / "01.npz", SparsePoints(np.zeros((1, 3)), np.zeros((1, 3), np.uint8))
    )
    assert [file.name for file in (tmp_path / "points").iterdir()] == ["01.npz"]
