"""Folders of pictures, photos and pages that others replace: killed, their files are whole, old or new."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from kill_points import Say, forked

from cagefield.cli import main
from cagefield.cli.demo import Demo
from cagefield.files.atomic import merged_folder
from cagefield.files.stale_files import hidden_name
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
def test_killed_pictures_are_old_or_new_each(tmp_path: Path) -> None:
    """At every call that changes something, with the user's own files; the next run leaves nothing else."""
    outcomes: set[tuple[bytes, ...]] = set()
    for at in range(1, 200):
        out = tmp_path / str(at) / "out"
        old = old_pictures(out)

        def work(say: Say, out: Path = out) -> None:
            replace_pictures(out)

        killed = forked(work, out.parent, at).killed
        found = {name: file for name, file in files_of(out).items() if not name.startswith(".")}
        assert {found.pop(name) for name in ("0003.png", "mine/notes.txt")} == {b"mine"}
        assert set(found) == set(NAMES) and set(found.values()) <= {b"old", b"new"}, (at, found)
        outcomes.add(tuple(found[name] for name in NAMES))
        replace_pictures(out)
        assert files_of(out) == old | dict.fromkeys(NAMES, b"new")
        assert list(out.parent.iterdir()) == [out]
        if not killed:
            break
    # One after another, and none before all are written.
    assert not killed and outcomes == {(b"new",) * new + (b"old",) * (3 - new) for new in range(4)}


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


@pytest.fixture(scope="module")
def ended() -> str:
    """The number of a process that has ended."""
    code = "import os; print(os.getpid())"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip()


def put_aside(target: Path, process: str) -> None:
    """What a kill between two renames leaves: the old folder under a hidden name, nothing at its place."""
    name = hidden_name(target, "old").rsplit("-", 2)
    target.rename(target.with_name("-".join((name[0], process, name[2]))))


def demo_folder(folder: Path) -> list[str]:
    (folder / "out").mkdir()
    (folder / "out" / "before_after.png").write_bytes(b"old")
    return ["demo", "-o", str(folder / "out")]


def made_scene(folder: Path) -> list[str]:
    words = ["make-scene", "chair", "-o", str(folder / "out"), "--views", "2", "--test-views", "1", "--size"]
    assert main([*words, "12"]) == 0
    return [*words, "12"]


def made_room(folder: Path) -> list[str]:
    words = ["make-scene", "room-chair", "-o", str(folder / "out"), "--views", "8", "--size", "48"]
    assert main([*words, "--no-points"]) == 0
    return [*words, "--no-points"]


def made_page(folder: Path) -> list[str]:
    ball_scene().save(folder / "scene")
    words = ["export", str(folder / "scene"), "-o", str(folder / "out"), "--as", "page", "--embed"]
    assert main(words) == 0
    return words


def made_pictures(folder: Path) -> list[str]:
    ball_scene().save(folder / "scene")
    old_pictures(folder / "out")
    return ["render", str(folder / "scene"), "-o", str(folder / "out"), "--views", "0", "--size", "16"]


def made_poses(folder: Path) -> list[str]:
    (folder / "out").mkdir()
    (folder / "out" / "poses.json").write_text("{}")
    (folder / "photos").mkdir()
    return ["poses", str(folder / "photos"), "-o", str(folder / "out")]


@pytest.mark.parametrize(
    "make",
    [
        demo_folder,
        made_scene,
        pytest.param(made_room, marks=pytest.mark.nightly),
        made_page,
        made_pictures,
        made_poses,
    ],
)
def test_the_next_run_brings_back_what_an_end_between_two_renames_left(
    tmp_path: Path,
    ended: str,
    make: Callable[[Path], list[str]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """And says so; it is then there, so that only --overwrite replaces it, with the user's own file kept."""
    for name in ("_photograph", "_train", "_edit", "_render"):
        monkeypatch.setattr(Demo, name, lambda *_: (None, ""))
    words, out = make(tmp_path), tmp_path / "out"
    (out / "notes.txt").write_text("mine")
    before = files_of(out)
    put_aside(out, ended)
    capsys.readouterr()
    assert main(words) == 2
    said = capsys.readouterr().err
    assert f"{out} was left as .out.old-" in said and "it is back" in said
    assert said.splitlines()[-1].endswith("give a new one, or --overwrite")
    assert files_of(out) == before
    put_aside(out, ended)
    main([*words, "--overwrite"])  # of no photos there are no poses
    assert "it is back" in capsys.readouterr().err
    assert (out / "notes.txt").read_text() == "mine"
    assert [name for name in os.listdir(tmp_path) if name.startswith(".")] == []


def test_poses_that_a_training_used_come_back(
    tmp_path: Path, ended: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`train` on photos alone finds them again, and does not begin anew."""
    from cagefield.cli import poses
    from cagefield.datasets import dataset_loader
    from cagefield.datasets.sfm import structure_from_motion

    monkeypatch.setattr(dataset_loader, "has_photos_alone", lambda photos: True)
    monkeypatch.setattr(
        structure_from_motion,
        "is_built_from",
        lambda target, photos, masks=None: (target / "poses.json").is_file(),
    )
    made_poses(tmp_path)
    put_aside(tmp_path / "out", ended)
    with pytest.warns(UserWarning, match="it is back"):
        assert poses.posed(tmp_path / "photos", tmp_path / "out") == tmp_path / "out"
