"""Folders that are replaced: whole at every moment, at whichever system call the program is ended."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from cagefield.errors import line_of
from cagefield.files import atomic
from cagefield.files.atomic import recover_folder, replaced_folder
from cagefield.files.rename_exchange import exchange_names
from cagefield.scene.scene import Scene
from scenes import ball_scene, files_of

EDIT = """edits:
  - adjustment: discrete
    inner: {center: [0, 0, 0], size: 1}
    operations: [{translate: [1, 0, 0]}]
"""


def test_two_names_are_exchanged(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(name)
    if not exchange_names(tmp_path / "a", tmp_path / "b"):
        pytest.skip("this system exchanges no names")
    assert (tmp_path / "a" / "file").read_text() == "b" and (tmp_path / "b" / "file").read_text() == "a"
    with pytest.raises(FileNotFoundError):
        exchange_names(tmp_path / "a", tmp_path / "missing")


@pytest.mark.parametrize("can_exchange", [True, False])
def test_the_users_own_files_are_kept(
    tmp_path: Path, can_exchange: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not can_exchange:
        monkeypatch.setattr(atomic, "exchange_names", lambda one, other: False)
    target = tmp_path / "out"
    (target / "mine").mkdir(parents=True)
    (target / "mine" / "deep.txt").write_text("mine")
    (target / "link").symlink_to("nowhere")
    (target / "ours").write_text("old")
    with replaced_folder(target, ("ours", "gone")) as draft:
        (draft / "ours").write_text("new")
    assert files_of(target) == {"mine/deep.txt": b"mine", "ours": b"new"}
    assert os.readlink(target / "link") == "nowhere"
    assert list(tmp_path.iterdir()) == [target]


def test_a_folder_that_is_to_replace_another_has_none_beside_it(tmp_path: Path) -> None:
    """`make-scene` writes photos into such a folder: a kill leaves one hidden name, known to the next run."""
    with replaced_folder(tmp_path / "out", ()) as outer, replaced_folder(outer, ()) as inner:
        (inner / "photo").write_text("new")
        assert list(tmp_path.iterdir()) == [outer]
    assert files_of(tmp_path) == {"out/photo": b"new"} and os.listdir(tmp_path) == ["out"]


_KILLED = textwrap.dedent("""
    import os, shutil, signal, sys
    from pathlib import Path
    import cagefield.edits.edit_files, cagefield.scene.scene
    from cagefield.files import atomic
    from cagefield.cli import main
    source, edits, way = sys.argv[1:]

    def run_until(left):
        def counted(module, name):
            function = getattr(module, name)

            def call(*args, **kwargs):
                nonlocal left
                left -= 1
                if left < 0:
                    os.kill(os.getpid(), signal.SIGKILL)
                return function(*args, **kwargs)

            setattr(module, name, call)

        if way == "renames":
            atomic.exchange_names = lambda one, other: False
        else:
            counted(atomic, "exchange_names")
        for name in ("rename", "replace", "link", "unlink", "rmdir", "mkdir", "chmod", "open"):
            counted(os, name)
        return main(["edit", "out", edits, "--overwrite"])

    # Imports of the command at first use are made here, not by each child.
    shutil.copytree(source, "../first")
    assert main(["edit", "../first", edits, "-o", "../edited"]) == 0
    for point in range(200):
        os.mkdir(str(point))
        os.chdir(str(point))
        shutil.copytree(source, "out")
        child = os.fork()
        if not child:
            os._exit(run_until(point))
        ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        os.chdir("..")
        if ended != -9:
            sys.exit(ended)
""")


@pytest.mark.nightly
@pytest.mark.parametrize("way", ["exchange", "renames"])
def test_an_edit_that_is_killed_leaves_a_scene_at_its_place(tmp_path: Path, way: str) -> None:
    """Killed at every call that changes a folder: the old scene or the new one, and the user's own files."""
    source, script, edits = tmp_path / "source", tmp_path / "killed.py", tmp_path / "e.yaml"
    ball_scene().save(source)
    script.write_text(_KILLED)
    edits.write_text(EDIT)
    own = {"camera_path.json": b"{}", "notes/a.txt": b"mine"}
    (source / "notes").mkdir()
    for name, content in own.items():
        (source / name).write_bytes(content)
    (tmp_path / "points").mkdir()
    ended = subprocess.run(
        [sys.executable, str(script), str(source), str(edits), way],
        cwd=tmp_path / "points",
        capture_output=True,
        timeout=300,
    )
    assert ended.returncode == 0, ended.stderr.decode()
    recovered, outcomes = 0, set()
    points = list((tmp_path / "points").iterdir())
    for place in points:
        target = place / "out"
        if target.exists():
            opened = Scene.open(target)
        else:
            recovered += 1
            with pytest.warns(UserWarning, match="it is back"):
                opened = Scene.open(target)
        outcomes.add(len(opened.edits))
        found = files_of(target)
        assert {name: found.get(name) for name in own} == own, place
    assert len(points) > 15 and outcomes == {0, 1}
    assert recovered == (1 if way == "renames" else 0)


def test_recovering_takes_the_newest_whole_folder(tmp_path: Path) -> None:
    for n, name in enumerate((".out.old-1", ".out.old-2", ".out.old-3", ".other.old-4")):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (n, n))
    whole = {".out.old-1", ".out.old-2"}
    with pytest.warns(UserWarning, match="it is back"):
        assert recover_folder(tmp_path / "out", lambda f: f.name in whole) == tmp_path / ".out.old-2"
    assert recover_folder(tmp_path / "out", lambda f: True) is None
    assert sorted(f.name for f in tmp_path.iterdir()) == [".other.old-4", ".out.old-1", ".out.old-3", "out"]


def test_saving_over_what_was_left_takes_no_scene_for_new(tmp_path: Path) -> None:
    """The folder is not there: `--overwrite` is wanted all the same, for what comes back."""
    ball_scene().save(tmp_path / ".out.old-12345678")
    with pytest.warns(UserWarning, match="it is back"), pytest.raises(ValueError, match="exists already"):
        ball_scene().with_edits(Scene.open(tmp_path / ".out.old-12345678").edits).save(tmp_path / "out")
    assert (tmp_path / "out" / "scene.json").is_file()


def test_copies_that_do_not_fit_name_the_target_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk without links, full at the user's own files; no name of the hidden folder is told."""
    target = tmp_path / "out"
    (target / "mine").mkdir(parents=True)
    for name in "abc":
        (target / "mine" / name).write_text("mine")
    tried: list[Path] = []

    def full(one: Path, other: Path, **_: object) -> None:
        tried.append(other)
        raise OSError(errno.ENOSPC, "No space left on device", str(one), None, str(other))

    monkeypatch.setattr(os, "link", full)
    monkeypatch.setattr(atomic.shutil, "copy2", full)
    with pytest.raises(OSError) as failed, replaced_folder(target, ()):
        pass
    assert line_of(failed.value) == f"{target}: No space left on device"
    assert len(tried) == 2 and len(files_of(target)) == 3
