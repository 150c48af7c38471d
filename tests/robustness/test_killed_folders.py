"""Folders that others replace, of pictures, photos and pages: killed, they are whole, old or new."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import pytest
from kill_points import Say, forked

from cagefield import atomic_files
from cagefield.atomic_files import merged_folder, recover_folder
from cagefield.cli import main
from full_disks import files_up_to
from scenes import ball_scene, files_of

NAMES = ("0000.png", "0001.png", "0002.png")

needs_forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system forks no processes")


def old_pictures(out: Path) -> dict[str, bytes]:
    """Three old pictures, and what else the user has there."""
    (out / "mine").mkdir(parents=True)
    for name in NAMES:
        (out / name).write_bytes(b"old")
    (out / "mine" / "notes.txt").write_bytes(b"mine")
    (out / "0003.png").write_bytes(b"mine")
    return files_of(out)


def replace_pictures(out: Path) -> None:
    with merged_folder(out) as folder:
        for name in NAMES:
            (folder / name).write_bytes(b"new")


@needs_forks
@pytest.mark.parametrize("way", ["exchange", "renames"])
def test_killed_pictures_are_all_old_or_all_new(
    tmp_path: Path, way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At every call that changes something, with the user's own files; the next run leaves nothing else."""
    if way == "renames":
        monkeypatch.setattr(atomic_files, "exchanged", lambda one, other: False)
    outcomes, recovered = set(), 0
    for at in range(1, 200):
        out = tmp_path / str(at) / "out"
        old = old_pictures(out)

        def work(say: Say, out: Path = out) -> None:
            replace_pictures(out)

        killed = forked(work, out.parent, at).killed
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            recovered += recover_folder(out, Path.is_dir) is not None
        found = files_of(out)
        assert {found.pop(name) for name in ("0003.png", "mine/notes.txt")} == {b"mine"}
        assert set(found) == set(NAMES) and len(set(found.values())) == 1, (at, found)
        outcomes.add(found["0000.png"])
        replace_pictures(out)
        assert files_of(out) == old | dict.fromkeys(NAMES, b"new")
        assert list(out.parent.iterdir()) == [out]
        if not killed:
            break
    assert not killed and at > 10 and outcomes == {b"old", b"new"}
    assert recovered == (1 if way == "renames" else 0)


def test_pictures_keep_the_rights_of_their_folder(tmp_path: Path) -> None:
    old_pictures(tmp_path / "out")
    (tmp_path / "out").chmod(0o750)
    (tmp_path / "link").symlink_to("out")
    replace_pictures(tmp_path / "link")
    assert (tmp_path / "out").stat().st_mode & 0o777 == 0o750
    assert (tmp_path / "link" / "0000.png").read_bytes() == b"new"


def test_the_folder_that_one_works_in_stays_that_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = old_pictures(tmp_path / "out")
    monkeypatch.chdir(tmp_path / "out" / "mine")
    number = (tmp_path / "out").stat().st_ino
    replace_pictures(Path(".."))
    assert (tmp_path / "out").stat().st_ino == number
    assert files_of(tmp_path / "out") == old | dict.fromkeys(NAMES, b"new")
    assert sorted(os.listdir(tmp_path / "out")) == ["0000.png", "0001.png", "0002.png", "0003.png", "mine"]


def test_pictures_that_do_not_fit_leave_the_old_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`render -o FOLDER --overwrite` on a full disk: one line, exit code 2."""
    ball_scene().save(tmp_path / "scene")
    before = old_pictures(tmp_path / "out")
    with files_up_to(300):
        command = ["render", str(tmp_path / "scene"), "-o", str(tmp_path / "out"), "--overwrite"]
        assert main(command) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert str(tmp_path / "out") in last and "File too large" in last and "/." not in last
    assert files_of(tmp_path / "out") == before
    assert sorted(os.listdir(tmp_path)) == ["out", "scene"]
