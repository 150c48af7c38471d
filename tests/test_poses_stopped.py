"""Structure from motion that the system stops: full disks, kills, and COLMAP ending its process."""

from __future__ import annotations

import errno
import shutil
import subprocess
import sys
import tracemalloc
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from cagefield.datasets import load_dataset
from cagefield.datasets.raw_photos import RawPhoto
from cagefield.datasets.sfm import (
    colmap_process,
    features,
    registered_capture,
    sfm_workspace,
    structure_from_motion,
)
from cagefield.datasets.sfm.colmap_process import StoppedError
from cagefield.datasets.sfm.database_check import recorded_digest
from cagefield.datasets.sfm.sfm_workspace import (
    link_plain_names,
    prepare_photos,
    prepare_work,
    remove_work,
    work_folder,
)
from cagefield.datasets.sfm.structure_from_motion import make_poses
from cagefield.errors import DatasetError
from posed_photos import photos_alone

pytest.importorskip("pycolmap", reason="poses are found by pycolmap")


def _instead_of_python(folder: Path, lines: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """`sys.executable` becomes a shell's script."""
    script = folder / "python"
    script.write_text(f"#!/bin/sh\nread task\n{lines}\n")
    script.chmod(0o755)
    monkeypatch.setattr(colmap_process.sys, "executable", str(script))


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (
            "echo terminate called >&2; echo '  what():  [d.cc:7] disk is full' >&2\n"
            "echo '*** Aborted'\nkill -6 $$",
            r"finding features stopped with status -6: \[d.cc:7\] disk is full",
        ),
        ("echo failed a reason; exit 1", "finding features stopped with status 1: a reason"),
        ("echo last words; exit 3", "finding features stopped with status 3: last words"),
        ("exit 4", "finding features stopped with status 4: no words"),
    ],
)
def test_a_process_that_colmap_ends_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: str, reason: str
) -> None:
    _instead_of_python(tmp_path, lines, monkeypatch)
    with pytest.raises(StoppedError, match=f"^{reason}$"):
        features.extract(tmp_path / "d.db", tmp_path, ["a.png"], features=9, longer_side=9)


def test_one_that_fails_ends_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _instead_of_python(
        tmp_path, f'case "$task" in *slow*) touch {tmp_path}/begun; exec sleep 600;; esac\n'
        f"while [ ! -e {tmp_path}/begun ]; do sleep 0.1; done; exit 5", monkeypatch
    )  # fmt: skip
    with pytest.raises(StoppedError, match="work stopped with status 5"):
        colmap_process.run_tasks("work", [{"task": "slow"}, {"task": "quick"}], lambda done: None)


def test_what_processes_have_done_is_summed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _instead_of_python(tmp_path, "echo done 1; echo COLMAP says done; echo done 4", monkeypatch)
    seen: list[int] = []
    colmap_process.run_tasks("work", [{}, {}], seen.append)
    assert seen[-1] == 8


def test_a_process_ends_with_the_one_that_started_it() -> None:
    program = (
        "import time\nfrom cagefield.datasets.sfm import colmap_tasks\n"
        "def work(on_done):\n    on_done(1)\n    time.sleep(600)\n"
        "colmap_tasks._TASKS['wait'] = work\ncolmap_tasks.main()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write('{"task": "wait"}\n')
        process.stdin.flush()
        assert process.stdout.readline() == "done 1\n"
        process.stdin.close()
        assert process.wait(60) == 1


@pytest.mark.nightly
def test_a_stop_says_what_is_kept_and_the_same_command_continues(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    photos, target = photos_alone(tmp_path / "photos"), tmp_path / "data"
    with monkeypatch.context() as patch:

        def stops(*args: Any, **options: Any) -> None:
            raise OSError(errno.ENOSPC, "No space left on device", str(work_folder(target) / "database.db"))

        patch.setattr(structure_from_motion, "match", stops)
        with pytest.raises(
            StoppedError,
            match=r"No space left.*is kept in .*data\.work, the same command continues; if it stops there",
        ):
            make_poses(photos, target)
    assert not target.exists()
    monkeypatch.setattr(sfm_workspace, "write_upright", None)  # no photo is read again
    assert make_poses(photos, target).placed == 4
    assert not work_folder(target).exists()


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with `photos`, and the `data.work` of a run of them that was stopped after the matches."""
    folder = tmp_path_factory.mktemp("stopped")
    photos_alone(folder / "photos")

    def stops(*args: Any, **options: Any) -> None:
        raise OSError(errno.EIO, "Input/output error")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(structure_from_motion, "reconstruct", stops)
        with pytest.raises(StoppedError):
            make_poses(folder / "photos", folder / "data")
    return folder


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "cut off": lambda whole: whole[: len(whole) // 2],
    "garbage": lambda whole: b"no database at all" * 999,
    "empty": lambda whole: b"",
    "head": lambda whole: whole[:50],
    "other photos": lambda whole: whole.replace(b"000001.png", b"000009.png"),
    "zeros": lambda whole: whole[:4096] + bytes(len(whole) - 4096),
    "one bit": lambda whole: whole[:-1] + bytes([whole[-1] ^ 1]),
}


@pytest.mark.nightly
@pytest.mark.parametrize("name", DAMAGES)
def test_a_database_that_is_damaged_after_a_stop_is_made_anew(
    stopped: Path, tmp_path: Path, name: str
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(stopped, folder)
    database = folder / "data.work" / "database.db"
    database.write_bytes(DAMAGES[name](database.read_bytes()))
    with pytest.warns(UserWarning, match=r"database\.db is damaged \(its digest is another\); features and"):
        assert make_poses(folder / "photos", folder / "data").placed == 4
    assert not database.parent.exists()


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("cut off", "malformed"),
        ("garbage", "file is not a database"),
        ("empty", "no such table"),
        ("head", ""),
        ("zeros", ""),
    ],
)
def test_a_damaged_database_of_a_killed_run_is_made_anew(
    stopped: Path, tmp_path: Path, name: str, reason: str
) -> None:
    """A kill leaves no digest: SQLite's own check decides."""
    folder = tmp_path / "run"
    shutil.copytree(stopped, folder)
    database = folder / "data.work" / "database.db"
    database.with_name("database.db.digest").unlink()
    database.write_bytes(DAMAGES[name](database.read_bytes()))
    with pytest.warns(UserWarning, match=rf"database\.db is damaged \(.*{reason}.*; features and"):
        assert make_poses(folder / "photos", folder / "data").placed == 4


@pytest.mark.nightly
@pytest.mark.parametrize("killed", [False, True])
def test_a_database_that_is_whole_is_left(
    stopped: Path, tmp_path: Path, killed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next run finds the features and the matches of the last one, and makes no database."""
    folder = tmp_path / "run"
    shutil.copytree(stopped, folder)
    if killed:
        (folder / "data.work" / "database.db.digest").unlink()
    monkeypatch.setattr(features, "create_database", None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert make_poses(folder / "photos", folder / "data").placed == 4


def test_a_run_that_is_killed_leaves_no_digest(tmp_path: Path) -> None:
    """The digest of the last stop is of a database that goes on changing."""
    database = tmp_path / "database.db"
    database.write_bytes(b"features")
    note = tmp_path / "database.db.digest"
    with pytest.raises(KeyboardInterrupt), recorded_digest(database):
        raise KeyboardInterrupt
    assert note.is_file()
    with recorded_digest(database):
        assert not note.exists()
    assert not note.exists()


@pytest.mark.nightly
def test_a_database_that_may_not_be_written_says_what_helps(
    stopped: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(stopped, folder)
    database = folder / "data.work" / "database.db"
    with monkeypatch.context() as patch:  # root may write whatever its mode says
        patch.setattr(sfm_workspace.os, "access", lambda path, mode: path != database)
        with pytest.raises(DatasetError, match=r"may not be written; make it and .* writable, or move"):
            make_poses(folder / "photos", folder / "data")
    database.rename(tmp_path / "away.db")
    assert make_poses(folder / "photos", folder / "data").placed == 4


@pytest.mark.nightly
def test_a_folder_in_a_databases_place_is_moved_away(stopped: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(stopped, folder)
    database = folder / "data.work" / "database.db"
    database.unlink()
    database.mkdir()
    with pytest.raises(DatasetError, match=r"database\.db is in the way \(Is a directory\); move it away$"):
        make_poses(folder / "photos", folder / "data")
    database.rename(tmp_path / "away")
    assert make_poses(folder / "photos", folder / "data").placed == 4


DECODING_ERRORS = [
    b"{}",
    b"[]",
    b"nope",
    b"\xff\xfe\x80\x00",
    b'{"photos": [{"name": "a.png"}], "unreadable": {}}',
]


@pytest.mark.parametrize("content", DECODING_ERRORS)
def test_photos_are_read_again_where_their_list_is_damaged(tmp_path: Path, content: bytes) -> None:
    photos, work = photos_alone(tmp_path / "photos"), tmp_path / "data.work"
    prepare_work(work, {"files": 1})
    found = prepare_photos(photos, work, 1, lambda done, note: None)
    link_plain_names(found[0], work)
    (work / "database.db").touch()
    (work / "photos.json").write_bytes(content)
    assert prepare_photos(photos, work, 1, lambda done, note: None) == found
    assert (work / "database.db").is_file()  # of the same photos
    (work / "photos.json").write_bytes(content)
    next(photos.glob("*.png")).unlink()
    assert len(prepare_photos(photos, work, 1, lambda done, note: None)[0]) == len(found[0]) - 1
    assert not (work / "database.db").exists()


@pytest.mark.parametrize("content", DECODING_ERRORS[1:4])
def test_work_of_nobody_knows_what_is_left_alone(tmp_path: Path, content: bytes) -> None:
    work = tmp_path / "data.work"
    prepare_work(work, {"files": 1})
    (work / "made_of.json").write_bytes(content)
    with pytest.raises(DatasetError, match=r"data\.work is in the way, its made_of.json is damaged; move it"):
        prepare_work(work, {"files": 1})
    assert (work / "made_of.json").read_bytes() == content


@pytest.mark.nightly
def test_work_of_other_photos_takes_as_much_as_that_of_these(tmp_path: Path) -> None:
    """Of many photos; all of their names and numbers were built, to see that they are."""
    work = tmp_path / "data.work"
    files = [[f'{n} "\\ é.png', n, n] for n in range(100_000)]
    prepare_work(work, {"version": 1, "files": files})
    (work / "database.db").touch()
    same = _most_memory(lambda: prepare_work(work, {"version": 1, "files": files}))
    assert (work / "database.db").exists()
    content = (work / "made_of.json").read_bytes()
    middle = content.index(b"], [", len(content) // 2)
    for damaged in (
        content[:-1], content[:middle], content[:middle] + content[middle + 1 :],
        content[: middle + 1] + content[middle + 3 :], content[:middle] + b"x" + content[middle:],
    ):  # fmt: skip
        (work / "made_of.json").write_bytes(damaged)
        with pytest.raises(DatasetError, match=r"its made_of.json is damaged"):
            prepare_work(work, {"version": 1, "files": files})
    (work / "made_of.json").write_bytes(content)
    files[50_000][2] += 1
    other = _most_memory(lambda: prepare_work(work, {"version": 1, "files": files}))
    assert not (work / "database.db").exists()
    assert other < 1.5 * same


def _most_memory(work: Callable[[], object]) -> int:
    """Bytes that it takes at most."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.nightly
def test_a_model_that_is_cut_off_replaces_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """COLMAP does not notice that its disk is full."""
    photos, target = photos_alone(tmp_path / "photos"), tmp_path / "data"
    make_poses(photos, target)
    before = {file: file.read_bytes() for file in target.rglob("*") if file.is_file()}
    whole = registered_capture.write_model

    def cut_off(model: Any, folder: Path) -> None:
        def write(there: Path) -> None:
            model.write_binary(there)
            points = there / "points3D.bin"
            points.write_bytes(points.read_bytes()[:-5])

        whole(SimpleNamespace(write_binary=write), folder)

    monkeypatch.setattr(registered_capture, "write_model", cut_off)
    with pytest.raises(StoppedError, match=f"^{target}: No space left on device; what is done"):
        make_poses(photos, target)
    assert before == {file: file.read_bytes() for file in target.rglob("*") if file.is_file()}
    assert len(load_dataset(target, holdout=0).train) == 4


def test_a_database_that_fails_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "d.db").write_bytes(b"no database" * 99)
    failing = r"^COLMAP stopped at its database .*d\.db: .*$"
    with pytest.raises(StoppedError, match=failing) as caught, features.open_database(tmp_path / "d.db"):
        pass
    assert "free on its disk" not in str(caught.value)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=4096))
    told = r", and 4 kB are free on its disk$"
    with pytest.raises(StoppedError, match=told), features.open_database(tmp_path / "d.db"):
        pass
    with pytest.raises(DatasetError, match=r"^mine$"), features.open_database(tmp_path / "e.db"):
        raise DatasetError("mine")


def test_a_database_whose_journal_stays_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SQLite closes it without a word where the disk is full; without its journal it is empty."""
    opened = features.open_database

    def journalled(path: Path) -> Any:
        path.with_name(path.name + "-wal").write_bytes(b"rows")
        return opened(path.with_name("other.db"))

    monkeypatch.setattr(features, "open_database", journalled)
    with pytest.raises(OSError, match="No space left"):
        features.create_database(tmp_path / "d.db", [], [])
    assert not (tmp_path / "d.db").exists()
    monkeypatch.undo()
    features.create_database(tmp_path / "d.db", [], [])
    assert [file.name for file in tmp_path.glob("d.*")] == ["d.db"]


def test_the_work_folder_goes_as_a_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a kill in the middle leaves is no work, and is not in the way."""
    work = tmp_path / "data.work"
    prepare_work(work, {"files": 1})
    assert [file.name for file in work.iterdir()] == ["made_of.json"]
    (work / "more").touch()
    with monkeypatch.context() as patch:
        patch.setattr(shutil, "rmtree", lambda *args, **options: None)
        remove_work(work)
    assert not work.exists() and all(path.name.startswith(".") for path in tmp_path.iterdir())
    prepare_work(work, {"files": 2})
    assert [file.name for file in work.iterdir()] == ["made_of.json"]


def test_pictures_for_colmap_are_whole_or_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A picture that is there is not made again: a half one would stay."""
    pixels = np.zeros((8, 8, 4), np.uint8)
    Image.fromarray(pixels).save(tmp_path / "a.png")
    photo = RawPhoto("a.png", tmp_path / "a.png", 8, 8, None, 1.0, True)
    real = Image.Image.save

    def half(image: Image.Image, place: Path, **options: Any) -> None:
        if image.mode == "RGB":
            Path(place).write_bytes(b"half")
            raise OSError(errno.ENOSPC, "No space left on device")
        real(image, place, **options)

    with monkeypatch.context() as patch:
        patch.setattr(Image.Image, "save", half)
        with pytest.raises(OSError, match="No space left"):
            link_plain_names([photo], tmp_path)
    assert list((tmp_path / "colmap").iterdir()) == []
    assert link_plain_names([photo], tmp_path) == ["000000.png"]
    with Image.open(tmp_path / "colmap" / "000000.png") as image:
        assert image.size == (8, 8) and image.mode == "RGB"
