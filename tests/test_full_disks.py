"""A full disk: one line, exit code 2, and what was there as it was."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cagefield.rendering.images import video_writer
from commands import given_up, printed
from full_disks import files_up_to, fill, small_disk
from scenes import ball_scene, files_of


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
