"""`cagefield train` and `cagefield demo`: a short training from photos to a scene, and what they refuse."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from cagefield import Scene, load_dataset
from cagefield.cli import demo, main
from cagefield.images.image_files import read_image
from cagefield.procedural import make_scene
from commands import refused
from scenes import ball_scene, files_of

QUICK = ("--steps", "60", "--resolution", "48")
TRAIN_QUICK = (*QUICK, "--sh-degree", "1")
SHORT = ("--steps", "5", "--resolution", "16")
"""Enough for what is said about a training."""


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few small photos of the chair."""
    path = tmp_path_factory.mktemp("photos") / "chair"
    return make_scene("chair", path, views=8, size=48, test_views=2)


def test_train_writes_a_scene(photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", str(photos), "-o", str(tmp_path / "scene"), *TRAIN_QUICK]) == 0
    out, err = capsys.readouterr()
    match = re.search(
        r"60 steps, (\d+) voxels; train PSNR ([\d.]+) dB; "
        r"test PSNR ([\d.]+) dB \([\d.]+ color-corrected\), SSIM 0",
        out,
    )
    assert match and f"scene written to {tmp_path / 'scene'}" in out
    assert "Training 50%: loss 0." in err and "k rays/s" in err
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene"]
    scene = Scene.open(tmp_path / "scene")
    data = load_dataset(photos)
    assert len(scene.field.vertices) == int(match[1])
    assert scene.background == (1.0, 1.0, 1.0) and len(scene.edits) == 0
    assert scene.cameras["test"] == tuple(view.camera for view in data.test)
    # An all-white picture scores 11 dB on these photos; 60 steps reach about 18.
    assert float(match[3]) > 14.0


@pytest.mark.nightly
def test_photos_too_small_for_ssim_give_a_scene_without_that_figure(
    photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["train", str(photos), "-o", str(tmp_path / "scene"), "--steps", "5", "--resolution", "16"]
    assert main([*argv, "--downscale", "6"]) == 0  # to 8 x 8 pixels
    assert re.search(
        r"; test PSNR [\d.]+ dB \([\d.]+ color-corrected\), worst view ", capsys.readouterr().out
    )
    assert Scene.open(tmp_path / "scene").cameras["test"][0].width == 8


def test_train_refuses_before_it_trains(
    photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ball_scene().save(tmp_path / "scene")
    before = files_of(tmp_path)
    scene = tmp_path / "scene"
    assert "exists already" in refused(capsys, "train", photos, "-o", scene)
    assert "does not exist" in refused(capsys, "train", tmp_path / "nowhere", "-o", tmp_path / "new")
    assert "no camera file" in refused(capsys, "train", scene, "-o", tmp_path / "new")
    for option, value, message in (
        ("--minutes", 0, "minutes is 0"),
        ("--resolution", 4, "resolution is 4; it must be from 16"),
        ("--sh-degree", 3, "sh_degree is 3; it must be from 0 to 2"),
        ("--steps", 0, "steps is 0"),
        ("--downscale", 0, "downscale"),
    ):
        assert message in refused(capsys, "train", photos, "-o", tmp_path / "new", option, value)
    assert "no checkpoint" in refused(capsys, "train", photos, "-o", tmp_path / "new", *QUICK, "--resume")
    assert files_of(tmp_path) == before and not (tmp_path / "new").exists()


def test_interrupted_training_is_saved_and_resumed(
    photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    argv = ["train", str(photos), "-o", str(tmp_path / "scene"), *TRAIN_QUICK]
    from cagefield.training.voxels.voxel_run import VoxelRun

    advance = VoxelRun.advance

    def pressed_at_40(run: VoxelRun) -> None:
        import signal

        advance(run)
        if run.step == 40:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(VoxelRun, "advance", pressed_at_40)
    assert main(argv) == 130
    out, err = capsys.readouterr()
    assert "40 steps" in out and "--resume continues" in out and err.endswith("cagefield: interrupted\n")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["scene", "scene.training"]
    partial = Scene.open(tmp_path / "scene")
    monkeypatch.undo()

    assert "exists already" in refused(capsys, *argv)
    assert main([*argv, "--resume"]) == 0
    assert "60 steps" in capsys.readouterr().out
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene"]
    resumed = Scene.open(tmp_path / "scene").field
    assert not np.array_equal(resumed.density, partial.field.density)

    whole = tmp_path / "whole"
    assert main(["train", str(photos), "-o", str(whole), *TRAIN_QUICK]) == 0
    np.testing.assert_array_equal(Scene.open(whole).field.density, resumed.density)


@pytest.mark.nightly
def test_demo_runs_the_whole_chain(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(demo, "_PICTURE_SIZE", 160)
    monkeypatch.setattr(demo, "_VIDEO_SIZE", 64)
    out = tmp_path / "demo"
    argv = ["demo", "-o", str(out), "--views", "12", "--size", "48", *QUICK, "--frames", "2"]
    assert main(argv) == 0
    text = capsys.readouterr().out
    assert "training: " in text and f"{out}/before_after.png" in text
    assert text.rstrip().endswith(f"edit it by hand, in the browser: cagefield view {out}/edited")
    assert sorted(entry.name for entry in out.iterdir()) == [
        "after.png", "before.png", "before_after.png", "edited", "edits.yaml", "photos", "scene",
        "turntable.mp4",
    ]  # fmt: skip
    before, after = (read_image(out / f"{name}.png").astype(int) for name in ("before", "after"))
    changed = np.abs(before - after).max(axis=2) > 40
    # The arm is in the right half of the picture; the tracks and the plate on the left stay as they are.
    assert changed[:, 80:].mean() > 0.02 and changed[100:, :66].mean() < 1e-3
    edited = Scene.open(out / "edited")
    assert [edit.name for edit in edited.edits] == ["clear the gap under the bucket", "raise the arm"]
    before_files = files_of(tmp_path)
    assert "give a new one, or --overwrite" in refused(capsys, *argv)
    assert files_of(tmp_path) == before_files


def test_missing_photos_are_one_line_of_warning(
    photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(photos, tmp_path / "photos")
    (tmp_path / "photos" / "train" / "r_3.png").unlink()
    assert main(["train", str(tmp_path / "photos"), "-o", str(tmp_path / "scene"), *SHORT]) == 0
    warned = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    assert len(warned) == 1 and warned[0].startswith("cagefield: warning: ") and "r_3" in warned[0]
    assert len(Scene.open(tmp_path / "scene").cameras["train"]) == 7


def test_auto_takes_voxels_for_a_bounded_scene_and_says_so(
    photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", str(photos), "-o", str(tmp_path / "scene"), *SHORT]) == 0
    err = capsys.readouterr().err
    assert err.startswith("Training voxels, the scene is bounded (--field splat trains splats)\n")
    assert main(["train", str(photos), "-o", str(tmp_path / "told"), *SHORT, "--field", "voxel"]) == 0
    assert "the scene is bounded" not in capsys.readouterr().err
