"""`cagefield render`: which pictures are written, what is in them, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from cagefield import Cage, Edit, EditStack, Scene
from cagefield.cli import main
from cagefield.edits import Trilinear
from cagefield.images.image_files import read_image
from commands import refused
from scenes import ball_scene, files_of


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene folder whose ball is moved up."""
    path = tmp_path_factory.mktemp("render") / "scene"
    lift = Edit.move(Cage.box((0, 0, 0), 1.2)).translate((0, 0, 0.4))
    ball_scene().with_edits(EditStack([lift])).save(path)
    return path


def run(*argv: object) -> None:
    assert main([str(arg) for arg in argv]) == 0


def video(path: Path) -> tuple[dict[str, object], int]:
    """(what the container says, number of frames) of a video."""
    reader = imageio_ffmpeg.read_frames(str(path))
    return next(reader), sum(1 for _ in reader)


def test_test_views_are_the_scenes_own_renderings(scene: Path, tmp_path: Path) -> None:
    run("render", scene, "-o", tmp_path / "out")
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["0000.png", "0001.png"]
    opened = Scene.open(scene)
    for index, camera in enumerate(opened.cameras["test"]):
        picture = read_image(tmp_path / "out" / f"{index:04d}.png")
        np.testing.assert_array_equal(picture, opened.render(camera).rgb8())


def test_single_view_with_size_background_depth_and_normals(scene: Path, tmp_path: Path) -> None:
    run("render", scene, "-o", tmp_path / "one.png", "--split", "train", "--views", 2, "--size", "48x20",
        "--background", "0,0,1", "--depth", "--normals")  # fmt: skip
    assert sorted(files_of(tmp_path)) == ["one.png", "one_depth.npy", "one_depth.png", "one_normals.png"]
    opened = Scene.open(scene)
    frame = opened.render(opened.cameras["train"][2].resized(48, 20), background=(0, 0, 1), normals=True)
    np.testing.assert_array_equal(read_image(tmp_path / "one.png"), frame.rgb8())
    depth = np.load(tmp_path / "one_depth.npy")
    np.testing.assert_array_equal(depth, frame.depth)
    gray = read_image(tmp_path / "one_depth.png")[..., 0].astype(int)
    seen = frame.opacity > 0.9
    nearest, farthest = depth[seen].argmin(), depth[seen].argmax()
    assert gray[seen][nearest] > gray[seen][farthest] and gray[0, 0] == 0
    assert frame.normals is not None
    normals = read_image(tmp_path / "one_normals.png") / 255.0 * 2.0 - 1.0
    np.testing.assert_allclose(normals[seen], frame.normals[seen], atol=1.01 / 255)


def test_longer_side_keeps_the_aspect(scene: Path, tmp_path: Path) -> None:
    run("render", scene, "-o", tmp_path / "one.png", "--views", 0, "--size", "36")
    assert read_image(tmp_path / "one.png").shape == (24, 36, 3)


def test_no_background_gives_transparent_pictures(scene: Path, tmp_path: Path) -> None:
    run("render", scene, "-o", tmp_path / "one.png", "--views", 0, "--background", "none")
    picture = read_image(tmp_path / "one.png")
    assert picture.shape[2] == 4 and picture[0, 0, 3] == 0 and picture[..., 3].max() > 250


def test_compare_shows_before_and_after(scene: Path, tmp_path: Path) -> None:
    run("render", scene, "-o", tmp_path / "both.png", "--views", 0, "--compare")
    run("render", scene, "-o", tmp_path / "before.png", "--views", 0, "--unedited")
    run("render", scene, "-o", tmp_path / "after.png", "--views", 0)
    both, before, after = (read_image(tmp_path / f"{name}.png") for name in ("both", "before", "after"))
    np.testing.assert_array_equal(both[:, :24], before)
    np.testing.assert_array_equal(both[:, -24:], after)
    assert np.abs(before.astype(int) - after).max() > 100


def test_turntable_video(scene: Path, tmp_path: Path) -> None:
    run(
        "render",
        scene,
        "-o",
        tmp_path / "turn.mp4",
        "--turntable",
        5,
        "--size",
        "32x24",
        "--depth",
        "--fps",
        10,
    )
    about, frames = video(tmp_path / "turn.mp4")
    assert frames == 5 and about["fps"] == 10
    assert about["size"] == (32 + 4 + 32, 24)
    assert [file.name for file in tmp_path.iterdir()] == ["turn.mp4"]


def test_nerfstudio_camera_path(scene: Path, tmp_path: Path) -> None:
    camera = ball_scene().cameras["train"][0]
    entry = {"camera_to_world": camera.c2w.ravel().tolist(), "fov": 40.0, "aspect": 2.0}
    document = {
        "render_width": 40,
        "render_height": 20,
        "fps": 12,
        "seconds": 0.25,
        "camera_path": [entry] * 3,
    }
    (tmp_path / "path.json").write_text(json.dumps(document))
    run("render", scene, "-o", tmp_path / "out.mp4", "--camera-path", tmp_path / "path.json")
    about, frames = video(tmp_path / "out.mp4")
    assert (about["size"], about["fps"], frames) == ((40, 20), 12, 3)


def test_existing_results_are_kept_unless_told(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "0000.png").write_bytes(b"mine")
    (tmp_path / "turn.mp4").write_bytes(b"mine")
    before = files_of(tmp_path)
    assert "exists already and is not empty" in refused(capsys, "render", scene, "-o", tmp_path / "out")
    assert "turn.mp4 exists already" in refused(capsys, "render", scene, "-o", tmp_path / "turn.mp4")
    (tmp_path / "one_depth.npy").write_bytes(b"mine")
    error = refused(capsys, "render", scene, "-o", tmp_path / "one.png", "--views", 0, "--depth")
    assert "one_depth.npy exists already" in error
    (tmp_path / "one_depth.npy").unlink()
    assert files_of(tmp_path) == before
    run("render", scene, "-o", tmp_path / "out", "--overwrite")
    assert files_of(tmp_path)["out/0000.png"] != b"mine"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--split", "val"], "has no 'val' cameras, it has train (3), test (2)"),
        (["--views", 2], "--views 2 is out of range; test views go from 0 to 1"),
        (["--turntable", -1], "--turntable is -1"),
        (["--turntable", 3, "--camera-path", "x.json"], "exclude each other"),
        (["--dataparser-transforms", "x.json"], "belongs to --camera-path"),
        (["--camera-path", "x.json"], "x.json cannot be read: No such file"),
        (["--compare", "--unedited"], "exclude each other"),
        (["--compare", "--background", "none"], "give a color"),
        (["--background", "pink"], "is no color"),
        (["--background", "0,0,7"], "three numbers in [0, 1]"),
        (["--size", "0"], "out of range"),
        (["--size", ""], "is no size"),
        (["--size", "9" * 5000], "is no size"),
        (["--size", "10x20x30"], "is no size"),
        (["--size", "99999"], "out of range"),
        (["--fps", 0], "--fps is 0"),
        (["--fps", 1e-9], "--fps is 1e-09; give a number from 0.001 to 1000"),
    ],
)
def test_bad_options_are_refused(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[object], message: str
) -> None:
    assert message in refused(capsys, "render", scene, "-o", tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


def test_one_picture_needs_one_view(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    error = refused(capsys, "render", scene, "-o", tmp_path / "one.png")
    assert "is one picture, the views are 2" in error


def test_edits_that_fold_are_refused(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    inner = Cage.box((0, 0, 0), 1.2)
    twisted = Edit.continuous(inner, inner.grown(0.5), shell=Trilinear(), name="twist").rotate((0, 0, 1.5))
    Scene.open(scene).with_edits(EditStack([twisted])).save(tmp_path / "folded")
    error = refused(capsys, "render", tmp_path / "folded", "-o", tmp_path / "out")
    assert 'edit "twist"' in error and "is safe" in error
    assert not (tmp_path / "out").exists()
