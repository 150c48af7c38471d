"""Commands on disks without room: exit code 2, one line that names the place, and what was there as it was.

`benchmarks/robustness/full_disks.py` does it with all commands, and with editors.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import disks
import pytest
import write_limits
from disk_commands import DISK_COMMANDS, DiskCommand, sources
from disks import BYTES, Filled, disk, room_for
from shortages import PAGE, SHORTAGES


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("source")
    try:
        with disk(folder / "disk"):
            pass
    except (PermissionError, FileNotFoundError):
        pytest.skip("only root, on Linux, may mount a small file system")
    sources(folder)
    yield folder


@pytest.mark.parametrize(
    "name", ["edit --overwrite", "edit -o", "import", "export .sog", "convert to .spz", "export, a page"]
)
def test_a_command_on_a_full_disk(source: Path, name: str) -> None:
    command, found = DISK_COMMANDS[name], Filled()
    need = room_for(command, source)
    for again in (True,) if command.on_disk else (False, True):
        for left in BYTES.levels(need, 3):
            disks.fill(name, command, source, left, again, found)
    assert found.faults == []
    assert found.runs - found.fitted >= 3  # what stays as it is takes no room


@pytest.mark.parametrize("name", ["edit --overwrite", "edit -o", "edit --append", "export --embed"])
def test_a_command_on_a_disk_without_names(source: Path, name: str) -> None:
    command, found, short = DISK_COMMANDS[name], Filled(), SHORTAGES["names"]
    need = room_for(command, source, short)
    for again in (True,) if command.on_disk else (False, True):
        for left in short.levels(need, 3):
            disks.fill(name, command, source, left, again, found, short)
    assert found.faults == []
    assert found.runs - found.fitted >= 3


@pytest.mark.nightly
@pytest.mark.skipif(write_limits.why_not() is not None, reason=str(write_limits.why_not()))
@pytest.mark.parametrize("short", ["closing", "quota", "names of a quota"])
def test_a_command_whose_writes_are_refused(source: Path, short: str) -> None:
    """In processes of their own: a library that counts what is written is loaded before the C library."""
    root = Path(__file__).resolve().parents[2]
    module = ["-m", "benchmarks.robustness.full_disks"]
    words = ["--short", short, "--levels", "3", "--only", "edit -o", "edit --overwrite"]
    done = subprocess.run([sys.executable, *module, *words], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = [line.strip("| ").split(" | ") for line in done.stdout.splitlines() if line.startswith("|")]
    assert [row[0] for row in rows] == ["edit -o", "edit --overwrite"], done.stdout
    assert all(int(row[2]) > 2 and row[4:] == ["0"] * 4 for row in rows), done.stdout


@pytest.mark.nightly
def test_poses_on_a_full_disk(source: Path) -> None:
    """COLMAP's database fills the disk, over an old data set: that stays, and what is done is kept."""
    pytest.importorskip("pycolmap", reason="poses are found by pycolmap")
    command, found = DISK_COMMANDS["poses"], Filled()
    need = room_for(command, source)
    for share in (0.9, 1.2):
        disks.fill("poses", command, source, round(share * need / PAGE) * PAGE, True, found)
    assert found.faults == [] and found.runs - found.fitted == 2


def test_what_is_wrong_is_seen(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The checks themselves: a command that ends well, changes a file, leaves one, and says nothing."""
    found = Filled()
    command = DiskCommand("edit {out} {s}/e.yaml", "scene", on_disk="voxels")
    assert not disks.fill("room", command, source, 1 << 20, True, found)
    assert (found.runs, found.fitted, found.faults) == (1, 1, [])

    def damaging(arguments: list[str]) -> tuple[int, list[str]]:
        (Path(arguments[1]) / "notes.txt").write_text("")
        (Path(arguments[1]) / ".hidden").touch()
        return 2, ["cagefield: No space left on device"]

    monkeypatch.setattr(disks, "ran", damaging)
    assert disks.fill("bad", command, source, 0, True, found)
    assert (found.code, found.line, found.changed, found.left) == (0, 1, 1, 1)
    monkeypatch.setattr(disks, "ran", lambda arguments: (-1, ["OSError: [Errno 28]"]))
    disks.fill("worse", command, source, PAGE, True, found)
    assert (found.runs, found.code, found.left) == (3, 1, 1)
