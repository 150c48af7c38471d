"""Killed at every call that changes something: nothing lost, a readable scene, nothing left over.

`benchmarks/robustness/kills.py` does it with all commands, and at random moments.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
import write_points
from kill_command import renamed
from kill_points import Ended, Say, adopted, children, forked
from kills import COMMANDS, SLOW_COMMANDS, Killed, calls_of, hidden, kill

from cagefield.files.stale_files import hidden_name
from cagefield.images.image_files import write_png
from scenes import files_of
from tiers import nightly_after_first

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="this system forks no processes"),
    pytest.mark.filterwarnings("ignore"),  # of threads that numpy has, which the children do not use
]


@pytest.mark.parametrize(
    ("name", "least", "step"),
    [
        ("edit --overwrite, renames", 15, 9),
        ("convert .sog", 8, 4),
        ("export .glb", 8, 4),
        ("hotspot", 4, 2),
        pytest.param("edit --overwrite", 15, 3, marks=pytest.mark.nightly),
        pytest.param("changes and saves", 60, 15, marks=pytest.mark.nightly),
        pytest.param("changes and saves, free-form", 30, 15, marks=pytest.mark.nightly),
        pytest.param("save as", 15, 5, marks=pytest.mark.nightly),
        pytest.param("export, a sequence", 12, 5, marks=pytest.mark.nightly),
        pytest.param("export, a streamed SOG", 20, 7, marks=pytest.mark.nightly),
    ],
)
def test_killed_at_a_call_that_writes(tmp_path: Path, name: str, least: int, step: int) -> None:
    command, found = (COMMANDS | SLOW_COMMANDS)[name], Killed()
    calls, _ = calls_of(name, tmp_path)
    assert calls >= least
    for at in range(1 + step // 2, calls + 1, step):
        (tmp_path / str(at)).mkdir()
        assert kill(command, name, tmp_path / str(at), at, found)
    assert found.faults == []
    assert found.kills >= calls // step


needs_counted_writes = pytest.mark.skipif(
    write_points.why_not() is not None, reason=str(write_points.why_not())
)

_WRITES = """
    import os, shutil, sys
    from pathlib import Path
    import numpy as np
    sys.path.insert(0, sys.argv[3])
    import write_points
    folder = Path(sys.argv[1])
    write_points.arm(folder, int(sys.argv[2]))
    (folder / "a").write_bytes(b"ab" * 5)
    with open(folder / "b", "wb") as file:
        np.arange(10, dtype="<u2").tofile(file)
    shutil.copyfile(folder / "b", folder / "c")
    os.pwrite(os.open(folder / "a", os.O_WRONLY), b"cdefgh", 0)
    (folder.parent / "elsewhere").write_bytes(b"ab")
    print(write_points.count())
"""


@needs_counted_writes
def test_a_process_ends_in_the_middle_of_a_write(tmp_path: Path) -> None:
    """Python's writes, NumPy's and copies: half of the bytes are there; other folders' are not counted."""

    def run(at: int) -> tuple[int, str, dict[str, bytes]]:
        folder = tmp_path / str(at) / "x"
        folder.mkdir(parents=True)
        arguments = [str(folder), str(at), str(Path(__file__).parent)]
        done = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(_WRITES), *arguments],
            env=os.environ | write_points.preloading(),
            capture_output=True,
            text=True,
        )
        return done.returncode, done.stdout.strip(), files_of(folder)

    first, numbers = b"ababababab", np.arange(10, dtype="<u2").tobytes()
    # A copy asks once more for nothing at its end.
    assert run(0) == (0, "5", {"a": b"cdefghabab", "b": numbers, "c": numbers})
    assert run(1) == (-9, "", {"a": b"ababa"})
    assert run(2) == (-9, "", {"a": first, "b": numbers[:10]})
    assert run(3) == (-9, "", {"a": first, "b": numbers, "c": numbers[:10]})
    assert run(5) == (-9, "", {"a": b"cdebababab", "b": numbers, "c": numbers})


@needs_counted_writes
@pytest.mark.parametrize(
    ("name", "least", "step"), nightly_after_first([("edit --overwrite", 6, 3), ("changes and saves", 14, 6)])
)
def test_killed_in_the_middle_of_a_write(tmp_path: Path, name: str, least: int, step: int) -> None:
    found = Killed()
    calls, _ = calls_of(name, tmp_path, writes=True)
    assert calls >= least
    for at in range(step, calls + 1, step):
        (tmp_path / str(at)).mkdir()
        assert kill(COMMANDS[name], name, tmp_path / str(at), at, found, writes=True)
    assert found.faults == [] and found.kills >= 2


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


def test_pictures_and_files_that_would_be_lost_are_seen(tmp_path: Path) -> None:
    """Pictures neither old nor new, old ones at the end, files gone or cut off, a folder put aside."""
    command = SLOW_COMMANDS["render, pictures"]
    command.make(tmp_path)
    assert command.check(tmp_path, 0) is None
    assert (command.check(tmp_path, 1) or "").startswith("lost: pictures")
    write_png(tmp_path / "out" / "0001.png", np.zeros((32, 32, 3), np.uint8))
    assert command.check(tmp_path, 0) is None
    assert command.check(tmp_path, 1) == "lost: pictures [4, 32] pixels wide"
    write_png(tmp_path / "out" / "0002.png", np.zeros((16, 16, 3), np.uint8))
    assert command.check(tmp_path, 0) == "lost: pictures [4, 16, 32] pixels wide"
    write_png(tmp_path / "out" / "0002.png", np.zeros((4, 4, 3), np.uint8))
    aside = tmp_path / hidden_name(tmp_path / "out", "old").replace(f"-{os.getpid()}-", "-999999999-")
    (tmp_path / "out").rename(aside)
    assert command.check(tmp_path, 0) == "lost: the user's file"
    aside_too = renamed(command, "out")
    assert aside_too.check(tmp_path, 0) is None and aside_too.check(tmp_path, 1) is not None
    shutil.rmtree(aside)
    assert aside_too.check(tmp_path, 0) == "lost: the folder"
    converted = COMMANDS["convert .sog"]
    (tmp_path / "b").mkdir()
    converted.make(tmp_path / "b")
    assert converted.check(tmp_path / "b", 0) is None
    (tmp_path / "b" / "out.sog").write_bytes(b"half")
    assert (converted.check(tmp_path / "b", 0) or "").startswith("unreadable")
    (tmp_path / "b" / "out.sog").unlink()
    assert converted.check(tmp_path / "b", 0) == "lost: out.sog"


@pytest.mark.nightly
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
