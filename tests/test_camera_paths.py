"""nerfstudio camera paths against projection by hand; orbits against the circle they come from."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield.cameras.camera import Camera, turntable
from cagefield.cameras.camera_paths import load_camera_path, orbit
from cagefield.errors import CameraError


def path_document(**changes: Any) -> dict[str, Any]:
    pose = Camera.look_at((3, 1, 2), (0, 0, 0), width=8, height=6, fov_x=1.0).c2w
    entry = {"camera_to_world": pose.ravel().tolist(), "fov": 50.0, "aspect": 1.5}
    return {
        "camera_type": "perspective",
        "render_width": 60,
        "render_height": 40,
        "fps": 30,
        "seconds": 2,
        "camera_path": [entry, entry],
        **changes,
    }


def written(folder: Path, document: object, name: str = "path.json") -> Path:
    file = folder / name
    file.write_text(json.dumps(document))
    return file


def test_fov_is_vertical_and_poses_are_row_by_row(tmp_path: Path) -> None:
    path = load_camera_path(written(tmp_path, path_document()))
    assert path.fps == 30 and len(path.cameras) == 2
    camera = path.cameras[0]
    assert (camera.width, camera.height) == (60, 40)
    np.testing.assert_allclose(camera.origin, (3, 1, 2), atol=1e-12)
    # A point half the vertical field of view above the axis lands on the upper edge of the picture.
    distance = 5.0
    point = camera.origin + distance * (camera.forward + math.tan(math.radians(25.0)) * camera.c2w[:3, 1])
    pixels, depth = camera.project(point[None])
    np.testing.assert_allclose(pixels[0], (30.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(depth, distance, atol=1e-9)


def test_frame_rate_follows_from_seconds_without_fps(tmp_path: Path) -> None:
    document = path_document(seconds=4)
    del document["fps"]
    assert load_camera_path(written(tmp_path, document)).fps == 0.5


def test_dataparser_transform_is_undone(tmp_path: Path) -> None:
    # nerfstudio: pose' = transform @ pose, then the translation is scaled.
    transform = np.array([[0.0, 1.0, 0.0, 0.3], [-1.0, 0.0, 0.0, -0.2], [0.0, 0.0, 1.0, 0.1]])
    scale = 0.25
    pose = Camera.look_at((3, 1, 2), (0, 0, 0), width=8, height=6, fov_x=1.0).c2w
    moved = np.eye(4)
    moved[:3] = transform @ pose
    moved[:3, 3] *= scale
    document = path_document()
    document["camera_path"] = [{"camera_to_world": moved.ravel().tolist(), "fov": 50}]
    parser = written(
        tmp_path, {"transform": transform.tolist(), "scale": scale}, "dataparser_transforms.json"
    )
    camera = load_camera_path(written(tmp_path, document), parser).cameras[0]
    np.testing.assert_allclose(camera.c2w, pose, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"camera_path": []}, '"camera_path" must be a list with at least one camera'),
        ({"camera_path": [3]}, r"camera_path\[0\] must be an object"),
        ({"camera_path": [{"camera_to_world": [1, 2], "fov": 50}]}, "must hold 16 numbers"),
        ({"camera_path": [{"camera_to_world": [math.nan] * 16, "fov": 50}]}, "not finite"),
        (
            {"camera_path": [{"camera_to_world": [0.0] * 16, "fov": 50}]},
            r"camera_path\[0\]: c2w is not a rigid",
        ),
        ({"camera_path": [{"camera_to_world": np.eye(4).ravel().tolist(), "fov": 180}]}, '"fov" is 180'),
        ({"camera_type": "equirectangular"}, "camera_type 'equirectangular' is not supported"),
        ({"render_width": 0}, '"render_width" is 0; give a whole number of pixels'),
        ({"render_height": 10.5}, '"render_height" is 10.5'),
        ({"fps": 0}, "'fps' is 0; give a number above 0"),
        ({"fps": 1e-9}, "'fps' is 1e-09, 1e-09 pictures a second; give what makes 0.001 to 1000"),
        ({"fps": None, "seconds": 1e-300}, "'seconds' is 1e-300, .* pictures a second"),
    ],
)
def test_bad_paths_name_the_entry(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(CameraError, match=message):
        load_camera_path(written(tmp_path, path_document(**change)))


def test_bad_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match=r"missing\.json cannot be read: No such file"):
        load_camera_path(tmp_path / "missing.json")
    (tmp_path / "broken.json").write_text('{"camera_path": [')
    with pytest.raises(CameraError, match=r"broken\.json is not valid JSON"):
        load_camera_path(tmp_path / "broken.json")
    good = written(tmp_path, path_document())
    flat = written(tmp_path, {"transform": np.zeros((3, 4)).tolist(), "scale": 1.0}, "flat.json")
    with pytest.raises(CameraError, match="singular"):
        load_camera_path(good, flat)
    for transform, scale in ((1.0, 1e154), (1.0, 0.0), (1e154, 1.0)):
        document = {"transform": (transform * np.eye(3, 4)).tolist(), "scale": scale}
        huge = written(tmp_path, document, "huge.json")
        with pytest.raises(CameraError, match='"scale" must be above 0'):
            load_camera_path(good, huge)


def test_orbit_of_a_full_circle_lies_on_that_circle() -> None:
    center, radius, elevation = np.array([0.5, -1.0, 2.0]), 4.0, 0.4
    seen = turntable(center, radius, 12, elevation=elevation, width=40, height=30, fov_x=0.9)
    path = orbit(seen, 7, width=80, height=60)
    offsets = np.stack([camera.origin - center for camera in path])
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), radius, atol=1e-9)
    np.testing.assert_allclose(offsets[:, 2], radius * math.sin(elevation), atol=1e-9)
    steps = np.diff(np.unwrap(np.arctan2(offsets[:, 1], offsets[:, 0])))
    np.testing.assert_allclose(steps, 2 * math.pi / 7, atol=1e-9)
    # twice the size at the same field of view
    assert path[0].fx == pytest.approx(2 * seen[0].fx)


def test_orbit_of_a_one_sided_capture_stays_on_its_side() -> None:
    azimuths = np.radians(np.linspace(20, 100, 9))
    seen = [
        Camera.look_at((3 * math.cos(a), 3 * math.sin(a), 1), (0, 0, 0), width=40, height=30, fov_x=0.9)
        for a in azimuths
    ]
    path = orbit(seen, 24, width=40, height=30)
    angles = np.degrees([math.atan2(camera.origin[1], camera.origin[0]) for camera in path])
    assert angles.min() == pytest.approx(28, abs=1e-6) and angles.max() == pytest.approx(92, abs=1e-6)
    # closed: no step, the one from last to first included, exceeds the fastest of 32 degrees * 2 pi / 24
    assert np.abs(np.diff(angles, append=angles[0])).max() < 32 * math.pi / 12 + 1e-9


def test_orbit_of_parallel_cameras_looks_ahead() -> None:
    seen = [Camera.look_at((x, -3, 0), (x, 0, 0), width=40, height=30, fov_x=0.9) for x in (-1.0, 0.0, 1.0)]
    for camera in orbit(seen, 5, width=40, height=30):
        assert camera.forward[1] > 0.5


def test_orbit_needs_a_camera_and_a_count() -> None:
    with pytest.raises(CameraError, match="at least one camera"):
        orbit([], 5, width=40, height=30)
    camera = Camera.look_at((3, 0, 1), (0, 0, 0), width=40, height=30, fov_x=0.9)
    with pytest.raises(CameraError, match="an orbit has 0 cameras"):
        orbit([camera], 0, width=40, height=30)
    assert len(orbit([camera], 3, width=40, height=30)) == 3
