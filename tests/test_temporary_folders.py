"""Temporary folders of killed programs are removed by the next one; those of others, and links, stay."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from cagefield.files import temporary_folders
from cagefield.files.temporary_folders import TemporaryFolder, remove_abandoned
from cagefield.scene.scene import Scene
from cagefield.server.editor.persistence import SceneStore
from scenes import ball_scene

pytest.importorskip("fcntl", reason="without locks nothing is removed")

_KILLED = """
    import os, signal
    from cagefield.files.temporary_folders import TemporaryFolder
    with TemporaryFolder("copy") as folder:
        (folder / "scene").mkdir()
        (folder / "scene" / "half").write_text("h")
        print(folder, flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder for temporary files, of this process and those that it starts."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    yield folder


def killed() -> Path:
    """The folder of a program that was killed while it wrote there."""
    code = "\n".join(line[4:] for line in _KILLED.splitlines())
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == -9, done.stderr
    return Path(done.stdout.strip())


def test_a_folder_goes_with_what_made_it(temporary: Path) -> None:
    with TemporaryFolder("fit") as folder:
        assert folder.parent == temporary and folder.stat().st_mode & 0o777 == 0o700
        (folder / "a").write_text("b")
        remove_abandoned()
        assert (folder / "a").read_text() == "b"
    assert list(temporary.iterdir()) == []
    kept = TemporaryFolder("export")
    kept.close()
    kept.close()
    assert list(temporary.iterdir()) == []


def test_the_folder_of_a_killed_program_goes_with_the_next_one(temporary: Path) -> None:
    folder = killed()
    assert (folder / "scene" / "half").is_file()
    with TemporaryFolder("splats") as own:
        assert list(temporary.iterdir()) == [own]


def test_an_editor_that_starts_removes_the_copies_of_killed_ones(temporary: Path, tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "ball")
    folder = killed()
    store = SceneStore(Scene.open(tmp_path / "ball"), tmp_path / "ball")
    store.lock()
    store.close()
    assert not folder.exists()


def test_what_may_be_somebody_elses_stays(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another user's, one that a process holds, other hosts', other names, files and links."""
    folder = killed()
    with monkeypatch.context() as patch:
        patch.setattr(os, "geteuid", lambda: os.getuid() + 1)
        remove_abandoned()
    holding = os.open(folder, os.O_RDONLY)
    temporary_folders.fcntl.flock(holding, temporary_folders.fcntl.LOCK_EX)
    remove_abandoned()
    os.close(holding)
    assert (folder / "scene" / "half").is_file()
    _, role, host, process, _ = folder.name.split("-")
    mine = temporary.with_name("mine")
    mine.mkdir()
    (mine / "notes.txt").write_text("mine")
    (temporary / f"cagefield-{role}-{host}-{process}-link").symlink_to(mine)
    (temporary / f"cagefield-{role}-{host}-{process}-file").write_text("mine")
    for name in (
        f"cagefield-{role}-{'0' * 6}-{process}-x",
        f"cagefield-other-{host}-{process}-x",
        "cagefield-x",
    ):
        (temporary / name).mkdir()
    (folder / "scene" / "link").symlink_to(mine)
    before = set(temporary.iterdir())
    remove_abandoned()
    assert set(temporary.iterdir()) == before - {folder}
    assert (mine / "notes.txt").read_text() == "mine"
