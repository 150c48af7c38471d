"""A full disk: one line, exit code 2, and what was there as it was."""

from __future__ import annotations

import errno
import os
import pickle
import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from benchmarks.common.tables import write_texts

from cagefield import Scene, datasets
from cagefield.errors import line_of
from cagefield.files.atomic import check_writable, replaced_file
from cagefield.formats.splats.splat_files import write_splats
from cagefield.images.image_files import video_writer
from cagefield.procedural import make_scene
from cagefield.training.checkpoint import read_checkpoint, write_checkpoint
from cagefield.training.loop import run_to_end
from commands import given_up, printed
from full_disks import files_up_to, fill, small_disk
from scenes import ball_field, ball_scene, files_of
from splat_scenes import ball_of_splats


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A small scene folder."""
    ball_scene().save(tmp_path / "scene")
    return tmp_path / "scene"


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (128, 128, 3)).astype(np.uint8)


@pytest.mark.parametrize("limit", [0, 1, 20_000, 60_000])
def test_a_video_that_does_not_fit_leaves_the_old_one(tmp_path: Path, limit: int) -> None:
    """Whether ffmpeg fails at its first byte, within its frames, or when it ends."""
    file = tmp_path / "a.mp4"
    file.write_bytes(b"the old one")
    with (
        files_up_to(limit),
        pytest.raises(OSError) as caught,
        video_writer(file, (128, 128), quality=0) as add,
    ):
        for number in range(8):
            add(noise(number))
    assert caught.value.filename == str(file)
    assert files_of(tmp_path) == {"a.mp4": b"the old one"}


def test_rendering_to_a_full_disk_keeps_the_old_video(
    tmp_path: Path, scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with small_disk(tmp_path / "disk", 120) as disk:
        video = disk / "r.mp4"
        arguments = ("render", scene, "-o", video, "--turntable", "6", "--size", "200")
        printed(capsys, *arguments)
        before = video.read_bytes()
        filler = fill(disk, 0)
        line = given_up(capsys, *arguments, "--overwrite")
        assert "No space left on device" in line and str(video) in line
        assert video.read_bytes() == before
        assert sorted(disk.iterdir()) == [filler, video]


def test_pictures_that_do_not_all_fit_leave_the_old_ones(
    tmp_path: Path, scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first picture fits, the second does not: both stay as they were."""
    out = tmp_path / "out"
    printed(capsys, "render", scene, "-o", out, "--turntable", "2", "--size", "64")
    (out / "notes.txt").write_text("mine")
    before = files_of(out)
    sizes = sorted(len(before[name]) for name in ("0000.png", "0001.png"))
    with files_up_to(3 * sizes[1]):
        line = given_up(capsys, "render", scene, "-o", out, "--size", "400", "--overwrite")
    assert "File too large" in line and str(out) in line
    assert files_of(out) == before
    printed(capsys, "render", scene, "-o", out, "--size", "32", "--overwrite")
    after = files_of(out)
    assert (
        after["notes.txt"] == b"mine"
        and set(after) == set(before)
        and after["0000.png"] != before["0000.png"]
    )


EDITS = """edits:
  - adjustment: discrete
    inner: {center: [0, 0, 0], size: 1}
    operations: [{translate: [1, 0, 0]}]
"""


@pytest.mark.parametrize("limit", [20, 2_000])
def test_a_scene_that_does_not_fit_leaves_the_old_one(
    tmp_path: Path, scene: Path, capsys: pytest.CaptureFixture[str], limit: int
) -> None:
    """Whether the first file fails, which safetensors writes, or one after it."""
    file = tmp_path / "e.yaml"
    file.write_text(EDITS)
    before = files_of(tmp_path)
    for arguments in (("-o", tmp_path / "new"), ("--overwrite",)):
        with files_up_to(limit):
            line = given_up(capsys, "edit", scene, file, *arguments)
        assert "File too large" in line and "/." not in line
        assert files_of(tmp_path) == before


def test_a_field_that_does_not_fit_is_an_error_of_the_system(tmp_path: Path) -> None:
    file = tmp_path / "field.safetensors"
    file.write_bytes(b"old")
    with files_up_to(1_000), pytest.raises(OSError, match="File too large") as caught:
        ball_field().save(file)
    assert caught.value.filename == str(file) and files_of(tmp_path) == {file.name: b"old"}


def test_import_and_demo_on_a_full_disk(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    splats = tmp_path / "ball.ply"
    write_splats(ball_of_splats(), splats)
    for limit, arguments in (
        (2_000, ("import", splats, "-o", tmp_path / "scene")),
        (700, ("demo", "-o", tmp_path / "demo", "--views", "2", "--size", "32")),
    ):
        with files_up_to(limit):
            line = given_up(capsys, *arguments)
        assert "File too large" in line and "/." not in line
        assert list(tmp_path.iterdir()) == [splats]


def test_a_place_that_cannot_be_written_is_noticed_at_the_start(
    tmp_path: Path, scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(datasets, "load_dataset", lambda *_, **__: pytest.fail("began"))
    monkeypatch.setattr(Scene, "save", lambda *_, **__: pytest.fail("began"))
    monkeypatch.setattr(Scene, "render", lambda *_, **__: pytest.fail("began"))
    (tmp_path / "e.yaml").write_text(EDITS)
    before = files_of(tmp_path)
    for arguments in (
        ("train", tmp_path, "-o", tmp_path / "new"),
        ("demo", "-o", tmp_path / "new"),
        ("import", tmp_path / "x.ply", "-o", tmp_path / "new"),
        ("edit", scene, tmp_path / "e.yaml", "-o", tmp_path / "new"),
        ("render", scene, "-o", tmp_path / "new.mp4"),
        ("render", scene, "-o", tmp_path / "new"),
        ("export", scene, "-o", tmp_path / "new.ply"),
    ):
        with files_up_to(0):
            line = given_up(capsys, *arguments)
        assert f"{arguments[arguments.index('-o') + 1]}: File too large" in line
    assert files_of(tmp_path) == before


class Steps:
    """A run of so many steps of a minute each, whose state is written or not."""

    def __init__(self, count: int) -> None:
        self.step, self.count = 0, count

    @property
    def seconds(self) -> float:
        return 61.0 * self.step

    @property
    def done(self) -> float:
        return self.step / self.count

    def advance(self) -> None:
        self.step += 1

    def progress(self) -> None:
        return None

    def store(self, path: Path) -> None:
        write_checkpoint(path, "steps", {"step": self.step}, {"noise": noise(self.step)})

    def restore(self, path: Path) -> None:
        self.step = read_checkpoint(path, "steps")[0]["step"]


def test_a_training_goes_on_where_its_checkpoint_does_not_fit(tmp_path: Path) -> None:
    file = tmp_path / "a.training"
    options = {"checkpoint": file, "on_progress": None}
    run = Steps(2)
    with files_up_to(1_000), pytest.warns(UserWarning, match="there is none to resume from, and training"):
        assert run_to_end(run, resume=False, **options)
    assert run.step == 2 and list(tmp_path.iterdir()) == []
    run_to_end(Steps(2), resume=False, **options)
    before = file.read_bytes()
    run = Steps(5)
    with files_up_to(1_000), pytest.warns(UserWarning, match=r"File too large\); the last one, of \d+ s ago"):
        assert run_to_end(run, resume=True, **options)
    assert run.step == 5 and file.read_bytes() == before and list(tmp_path.iterdir()) == [file]
    again = Steps(5)
    again.restore(file)
    assert again.step == 2


@pytest.mark.nightly
def test_a_scene_without_room_says_where_its_training_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    photos = make_scene("chair", tmp_path / "chair", views=4, size=24, test_views=1)
    out = tmp_path / "out"
    arguments = ("train", photos, "-o", out, "--steps", "3", "--resolution", "16")
    with files_up_to(10_000):
        line = given_up(capsys, *arguments)
    assert "File too large; the training is lost" in line
    assert sorted(tmp_path.iterdir()) == [photos]
    save = Scene.save

    def full(scene: Scene, path: Path, overwrite: bool = False) -> None:
        with files_up_to(10_000):
            save(scene, path, overwrite)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Scene, "save", full)
        line = given_up(capsys, *arguments)
    assert f"the training is kept in {out}.training" in line
    assert "scene written" in printed(capsys, *arguments, "--resume")
    assert sorted(tmp_path.iterdir()) == [photos, out]


def test_files_that_belong_together_are_written_together(tmp_path: Path) -> None:
    table, figures = tmp_path / "a.md", tmp_path / "a.json"
    write_texts({figures: "1", table: "2"})
    with files_up_to(1_000), pytest.raises(OSError) as caught:
        write_texts({figures: "3", table: "4" * 2_000})
    assert caught.value.filename == str(table)
    assert files_of(tmp_path) == {"a.json": b"1", "a.md": b"2"}


def _missing(call: Callable[[int], None]) -> Callable[[int], None]:
    """The same call, which says of files, once it has been done, that there was no room."""

    def late(handle: int) -> None:
        is_file = stat.S_ISREG(os.fstat(handle).st_mode)
        call(handle)
        if is_file:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    return late


def test_room_that_is_missed_when_a_file_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As file systems of networks say it: nothing hidden stays."""
    file = tmp_path / "a.txt"
    file.write_bytes(b"old")
    monkeypatch.setattr(os, "close", _missing(os.close))
    with pytest.raises(OSError, match="No space left") as caught:
        check_writable(file)
    assert caught.value.filename == str(file)
    with pytest.raises(OSError, match="No space left") as caught, replaced_file(file):
        pytest.fail("began")
    assert caught.value.filename == str(file)
    monkeypatch.undo()
    assert files_of(tmp_path) == {"a.txt": b"old"}


def test_a_field_that_is_missed_when_its_file_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What writes it does not ask: the old one stays all the same."""
    file = tmp_path / "field.safetensors"
    file.write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", _missing(os.fsync))
    with pytest.raises(OSError, match="No space left") as caught:
        ball_field().save(file)
    monkeypatch.undo()
    assert caught.value.filename == str(file) and files_of(tmp_path) == {file.name: b"old"}


@pytest.mark.nightly
def test_a_curve_stays_where_the_scene_that_goes_with_it_does_not_fit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    photos = make_scene("chair", tmp_path / "chair", views=4, size=24, test_views=1)
    curve, scene = tmp_path / "curve.csv", tmp_path / "new"
    arguments = ("bench", "training", photos, "-o", curve, "--steps", "3", "--resolution", "16")
    printed(capsys, *arguments, "--scene-out", scene)
    before = files_of(tmp_path)
    save = Scene.save

    def full(scene: Scene, path: Path, overwrite: bool = False) -> None:
        with files_up_to(10_000):
            save(scene, path, overwrite)

    monkeypatch.setattr(Scene, "save", full)
    line = given_up(capsys, *arguments, "--scene-out", scene, "--overwrite")
    assert "File too large" in line and str(scene) in line
    assert files_of(tmp_path) == before


def test_a_place_that_is_none_is_named_and_not_what_is_hidden_there(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(OSError) as told, replaced_file(tmp_path / "file" / "x.png", parents=False):
        raise AssertionError
    assert "part-" not in str(told.value) and "x.png" in str(told.value)


@pytest.mark.parametrize(
    "error", [OSError("6144 requested and 2016 written"), OSError(errno.ENOSPC, "No space left on device")]
)
def test_a_worker_names_the_place_too(tmp_path: Path, error: OSError) -> None:
    """NumPy's error has words alone; from another process it comes as what pickle keeps of it."""
    with pytest.raises(OSError) as told, replaced_file(tmp_path / "x.npy"):
        raise error
    for one in (told.value, pickle.loads(pickle.dumps(told.value))):
        assert line_of(one) == f"{tmp_path / 'x.npy'}: {error.args[-1]}"
