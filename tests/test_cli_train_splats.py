"""`cagefield train` on captures: splats, their options, interrupted and resumed; what voxels say there."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from cagefield import Scene, load_dataset
from cagefield.cli import main
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.procedural import make_scene
from commands import refused
from posed_photos import room_capture
from splat_scenes import assert_same_splats

STEPS = ("--steps", "40", "--splats", "1500")


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few small photos of an unbounded room."""
    return room_capture(tmp_path_factory.mktemp("capture") / "room")


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few small photos of the chair."""
    path = tmp_path_factory.mktemp("photos") / "chair"
    return make_scene("chair", path, views=6, size=48, test_views=2)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Points that are found stay out of the user's cache."""
    monkeypatch.setattr(
        "cagefield.training.splats.train_splats.points_cache_folder", lambda: tmp_path / "points"
    )
    return tmp_path / "points"


def test_auto_takes_splats_for_a_capture_and_says_so(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", str(capture), "-o", str(tmp_path / "scene"), *STEPS]) == 0
    out, err = capsys.readouterr()
    assert "Training splats, the capture is unbounded (--field voxel trains voxels)" in err.splitlines()
    assert "Finding points 100%: " in err and "Training 50%: " in err
    match = re.search(r"40 steps, (\d+) splats; train PSNR ([\d.]+) dB", out)
    assert match and f"scene written to {tmp_path / 'scene'}" in out
    scene = Scene.open(tmp_path / "scene")
    assert isinstance(scene.field, SplatField) and scene.field.unbounded
    assert len(scene.field) == int(match[1]) <= 1500
    assert scene.cameras["train"] == tuple(view.camera for view in load_dataset(capture).train)
    assert scene.field.sh_degree == 2
    assert sorted(path.name for path in tmp_path.iterdir() if path.name != "points") == ["scene"]


def test_splats_of_a_bounded_scene_where_they_are_asked_for(
    photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["train", str(photos), "-o", str(tmp_path / "scene"), *STEPS, "--field", "splat"]
    assert main([*argv, "--sh-degree", "3"]) == 0
    out = capsys.readouterr().out
    match = re.search(
        r"test PSNR ([\d.]+) dB \([\d.]+ color-corrected\), SSIM 0[.\d]*, worst view \S+ [\d.]+ dB", out
    )
    scene = Scene.open(tmp_path / "scene")
    assert isinstance(scene.field, SplatField) and not scene.field.unbounded
    assert scene.field.sh_degree == 3 and scene.background == (1.0, 1.0, 1.0)
    # An all-white picture scores 11 dB on these photos.
    assert match and float(match[1]) > 14.0


def test_interrupted_training_is_saved_and_resumed(
    photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import signal

    from cagefield.training.splats.splat_run import SplatRun

    argv = ["train", str(photos), "-o", str(tmp_path / "scene"), *STEPS, "--field", "splat"]
    advance = SplatRun.advance

    def pressed_at_20(run: SplatRun) -> None:
        advance(run)
        if run.step == 20:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(SplatRun, "advance", pressed_at_20)
    assert main(argv) == 130
    out, err = capsys.readouterr()
    assert "20 steps" in out and "--resume continues" in out and err.endswith("cagefield: interrupted\n")
    assert (tmp_path / "scene.training").is_file()
    partial = Scene.open(tmp_path / "scene").field
    monkeypatch.setattr(SplatRun, "advance", advance)
    assert main([*argv, "--resume"]) == 0
    assert "40 steps" in capsys.readouterr().out and not (tmp_path / "scene.training").exists()
    resumed = Scene.open(tmp_path / "scene").field
    assert isinstance(resumed, SplatField) and isinstance(partial, SplatField)
    assert len(resumed) != len(partial) or not np.array_equal(resumed.means, partial.means)
    assert main([*argv[:3], str(tmp_path / "whole"), *argv[4:]]) == 0
    whole = Scene.open(tmp_path / "whole").field
    assert isinstance(whole, SplatField)
    assert_same_splats(resumed, whole)


@pytest.mark.nightly
def test_voxels_of_a_capture_say_what_they_are_not_good_at(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["train", str(capture), "-o", str(tmp_path / "scene"), "--field", "voxel"]
    assert main([*argv, "--steps", "20", "--resolution", "24"]) == 0
    warned = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    assert [line for line in warned if "by fog in front of the cameras; --field splat is made for it" in line]
    assert isinstance(Scene.open(tmp_path / "scene").field, VoxelField)


def test_what_is_refused(
    photos: Path, capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for data, argv, message in (
        (photos, ("--splats", 500), "--splats is for splats, these photos get voxels"),
        (photos, ("--splats", 500, "--field", "voxel"), "--splats is for splats; give --field splat too"),
        (photos, ("--refine-poses",), "--refine-poses is for splats, these photos get voxels"),
        (capture, ("--refine-poses", "--field", "voxel"), "--refine-poses is for splats; give --field splat"),
        (photos, ("--splats", 5, "--field", "splat"), "splats is 5; it must be from 100"),
        (capture, ("--sh-degree", 4), "sh_degree is 4; it must be from 0 to 3"),
        (photos, ("--sh-degree", 3), "sh_degree is 3; it must be from 0 to 2"),
        (capture, ("--minutes", 0), "minutes is 0"),
        (capture, ("--preset", "small"), "give --field nerf too"),
        (capture, ("--field", "mesh"), "invalid choice 'mesh'"),
    ):
        error = refused(capsys, "train", data, "-o", tmp_path / "new", *argv)
        assert message in error
    assert not (tmp_path / "new").exists()
