"""`cagefield import FILE.ply`: a scene of splats with cameras around them, on which every command works."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cagefield import Scene
from cagefield.cameras.camera_paths import shared_up
from cagefield.errors import FieldError
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import write_splats
from cagefield.scene.import_splats import import_splats
from commands import printed, refused
from scenes import files_of
from splat_scenes import assert_same_splats, ball_of_splats, random_splats

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data" / "splats"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A ball of splats in a file."""
    write_splats(ball_of_splats(), tmp_path / "ball.ply")
    return tmp_path / "ball.ply"


def test_import_makes_a_scene(capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path) -> None:
    text = printed(capsys, "import", file, "-o", tmp_path / "scene")
    assert "600 splats, SH degree 0; box 1.09 x 1.0" in text and "56 cameras all around, y-down" in text
    scene = Scene.open(tmp_path / "scene")
    assert isinstance(scene.field, SplatField) and not scene.field.unbounded
    assert_same_splats(scene.field, ball_of_splats(), atol=2e-6)
    assert scene.background == (1.0, 1.0, 1.0)
    assert {name: len(group) for name, group in scene.cameras.items()} == {"train": 48, "test": 8}
    for camera in scene.cameras["test"]:
        opacity = scene.render(camera.resized(80, 80)).opacity
        # All of the ball is in the picture, and fills a good part of it.
        assert opacity[40, 40] > 0.9 and 0.1 < (opacity > 0.5).mean() < 0.6
        assert max(opacity[0].max(), opacity[-1].max(), opacity[:, 0].max(), opacity[:, -1].max()) < 0.01
    assert "600 splats" in printed(capsys, "info", tmp_path / "scene")
    for options in (("--turntable", 2), ("--views", 0)):
        printed(capsys, "render", tmp_path / "scene", "-o", tmp_path / options[0], *options, "--size", 40)


@pytest.mark.parametrize(
    ("up", "axis"), [("y-down", (0, -1, 0)), ("z-up", (0, 0, 1)), ("x-down", (-1, 0, 0)), ("y-up", (0, 1, 0))]
)
def test_up_says_how_the_cameras_stand(
    capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path, up: str, axis: tuple[int, ...]
) -> None:
    printed(capsys, "import", file, "-o", tmp_path / "scene", "--up", up)
    cameras = Scene.open(tmp_path / "scene").cameras
    np.testing.assert_allclose(shared_up(np.stack([c.c2w for c in cameras["train"]])), axis, atol=1e-6)
    heights = [camera.origin @ np.array(axis) for camera in cameras["train"]]
    assert max(heights) > 1.0 and min(heights) > -0.1


def with_surroundings() -> SplatField:
    """The ball, and as many splats again around it: a few near, more and more far away."""
    ball, chance = ball_of_splats(), np.random.default_rng(0)
    away = chance.normal(size=(100, 3))
    away *= 10.0 ** chance.uniform(0.0, 1.5, (100, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    far = replace(ball.take(np.arange(100)), means=away)
    return SplatField(
        *(np.concatenate([getattr(ball, name), getattr(far, name)]) for name in (
            "means", "log_scales", "quaternions", "opacities", "sh",
        ))
    )  # fmt: skip


def test_surroundings_are_told_from_the_thing() -> None:
    found = import_splats(with_surroundings())
    assert found.field.unbounded and found.background == (0.0, 0.0, 0.0)
    # The box is about the ball of radius .5, the cameras stand outside of it.
    assert 0.4 < found.field.half_size.max() < 1.0
    assert np.abs(found.field.center).max() < 0.1
    distance = [np.linalg.norm(camera.origin - found.field.center) for camera in found.cameras["train"]]
    assert min(distance) > found.field.half_size.max()
    told = import_splats(with_surroundings(), unbounded=False)
    assert not told.field.unbounded and told.field.half_size.max() > 20.0
    assert not import_splats(ball_of_splats()).field.unbounded
    assert import_splats(ball_of_splats(), unbounded=True).field.unbounded
    large = with_surroundings()
    large = replace(large, means=100.0 * large.means, bounds=100.0 * large.bounds)
    scaled = import_splats(replace(large, log_scales=large.log_scales + np.log(100.0)))
    np.testing.assert_allclose(scaled.field.bounds, 100.0 * found.field.bounds, rtol=1e-4)


def test_invisible_splats_make_no_scene() -> None:
    with pytest.raises(FieldError, match="holds no splat that is visible; export it again"):
        import_splats(replace(random_splats(), opacities=np.full(40, 0.001)))


def test_the_cameras_of_a_data_set_see_the_splats_where_its_reconstruction_has_them(tmp_path: Path) -> None:
    from cagefield import load_dataset
    from cagefield.procedural import make_scene

    dataset = load_dataset(make_scene("plant", tmp_path / "photos", views=3, size=16, test_views=2))
    turned = np.array(
        [[0.0, -1.0, 0.0, 3.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )
    found = import_splats(random_splats(), dataset=replace(dataset, source_to_world=turned))
    for view, camera in zip(dataset.train, found.cameras["train"], strict=True):
        point = view.camera.origin + view.camera.forward
        place = (np.linalg.inv(turned) @ np.append(point, 1.0))[None, :3]
        np.testing.assert_allclose(camera.project(place)[0], view.camera.project(point[None])[0], atol=1e-6)
    assert len(found.cameras["test"]) == 2


def test_what_is_refused(capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path) -> None:
    before = files_of(tmp_path)
    scene = tmp_path / "scene"
    assert "are for NeRFs" in refused(capsys, "import", file, "-o", scene, "--fov-deg", 50)
    assert "invalid choice 'sideways'" in refused(capsys, "import", file, "-o", scene, "--up", "sideways")
    assert "no such file" in refused(capsys, "import", tmp_path / "other.ply", "-o", scene)
    assert "are for splats" in refused(capsys, "import", tmp_path / "a.ckpt", "-o", scene, "--up", "z-up")
    (tmp_path / "cut.ply").write_bytes(file.read_bytes()[:-500])
    assert "it is truncated" in refused(capsys, "import", tmp_path / "cut.ply", "-o", scene)
    (tmp_path / "cut.ply").unlink()
    assert files_of(tmp_path) == before
    printed(capsys, "import", file, "-o", scene)
    assert "exists already" in refused(capsys, "import", file, "-o", scene)


@pytest.mark.skipif(not SHARED.is_dir(), reason="../shared/data/splats is not there")
def test_a_real_capture_stands_upright(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = printed(capsys, "import", SHARED / "biker.compressed.ply", "-o", tmp_path / "scene")
    assert "152746 splats, SH degree 0" in text and "surroundings" not in text
    scene = Scene.open(tmp_path / "scene")
    opacity = scene.render(scene.cameras["test"][0].resized(100, 100)).opacity
    rows, columns = np.nonzero(opacity > 0.5)
    # A man stands: taller than wide, feet wider apart than his head is.
    assert np.ptp(rows) > 1.5 * np.ptp(columns) and np.ptp(rows) > 50
    head, feet = columns[rows < rows.min() + 8], columns[rows > rows.max() - 8]
    assert np.ptp(feet) > np.ptp(head)
