"""Killed at every call that changes something: nothing lost, a readable scene, nothing left over.

`benchmarks/robustness/kills.py` does it with all commands, and at random moments.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from kill_points import Ended, Say, adopted, children, forked
from kills import COMMANDS, SLOW_COMMANDS, Killed, calls_of, hidden, kill

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="this system forks no processes"),
    pytest.mark.filterwarnings("ignore"),  # of threads that numpy has, which the children do not use
]


@pytest.mark.parametrize(
    ("name", "least", "step"), [("edit --overwrite", 15, 3), ("changes and saves", 60, 9), ("save as", 15, 5)]
)
def test_killed_at_a_call_that_writes(tmp_path: Path, name: str, least: int, step: int) -> None:
    command, found = COMMANDS[name], Killed()
    calls, _ = calls_of(name, tmp_path)
    assert calls >= least
    for at in range(1 + step // 2, calls + 1, step):
        (tmp_path / str(at)).mkdir()
        assert kill(command, name, tmp_path / str(at), at, found)
    assert found.faults == []
    assert found.kills >= calls // step


def test_what_would_be_lost_is_seen(tmp_path: Path) -> None:
    """The checks themselves: a scene whose edit, or whose user's file, is gone, and hidden files."""
    command = COMMANDS["edit --overwrite"]
    command.make(tmp_path)
    assert command.check(tmp_path, 0) is None
    assert command.check(tmp_path, 1) == "lost: the edit"
    (tmp_path / "scene" / "notes.txt").unlink()
    assert command.check(tmp_path, 0) == "lost: the user's file"
    (tmp_path / "scene" / "field.safetensors").write_bytes(b"half")
    assert (command.check(tmp_path, 0) or "").startswith("unreadable")
    session = COMMANDS["changes and saves"]
    (tmp_path / "other").mkdir()
    session.make(tmp_path / "other")
    assert (session.check(tmp_path / "other", 4) or "").startswith("lost: change 2 was kept")


def test_poses_that_would_be_lost_are_seen(tmp_path: Path) -> None:
    """The checks of data sets: a photo, a model, or the user's file that is gone, and work that is left."""
    pytest.importorskip("pycolmap", reason="poses are found by pycolmap")
    command = SLOW_COMMANDS["poses"]
    command.make(tmp_path)
    assert command.check(tmp_path, 0) is None and hidden(tmp_path) == []
    (tmp_path / "data.work").mkdir()
    assert hidden(tmp_path) == ["data.work"]
    points = tmp_path / "data" / "sparse" / "0" / "points3D.bin"
    content = points.read_bytes()
    points.write_bytes(content[:-5])
    assert (command.check(tmp_path, 0) or "").startswith("unreadable")
    points.write_bytes(content)
    (tmp_path / "data" / "images" / "02.png").write_bytes(b"half")
    assert (command.check(tmp_path, 0) or "").startswith("unreadable")
    (tmp_path / "data" / "notes.txt").unlink()
    assert command.check(tmp_path, 0) == "lost: the user's file"


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="the system does not tell what is open")
def test_calls_in_open_folders_are_kill_points(tmp_path: Path) -> None:
    """Trees are removed by names in folders that are open: one call for each file."""
    (tmp_path / "tree").mkdir()
    for name in "abc":
        (tmp_path / "tree" / name).touch()
    ended = forked(lambda say: shutil.rmtree(tmp_path / "tree"), tmp_path, 3)
    assert ended.killed and len(list((tmp_path / "tree").iterdir())) == 1


def test_processes_that_go_on_are_seen(tmp_path: Path) -> None:
    """A killed process's own process, which it has started, goes on: it is counted, and ended."""
    others = adopted()

    def work(say: Say) -> None:
        sleeping = subprocess.Popen(["sleep", "600"])
        say(sleeping.pid)
        (tmp_path / "a").write_text("b")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("kill_points.STAYS", 0.2)
        ended = forked(work, tmp_path, 1)
    assert ended.killed and ended.outlived == 1 and ended.stayed >= 0.2
    assert children(os.getpid()) == others and not Path(f"/proc/{ended.said}").exists()
    assert forked(lambda say: say(3), tmp_path, 1) == Ended(False, 0, 3, 0, pytest.approx(0, abs=0.2))
