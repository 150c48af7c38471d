"""LLFF: a capture written by the format's definition, read back, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.datasets import load_dataset
from cagefield.errors import DatasetError
from posed_photos import HEIGHT, POINT, WIDTH, assert_spot_is_where_the_camera_says, project, ring, save, spot

FOCAL = 90.0
TILT = Rotation.from_euler("XYZ", (0.7, -0.4, 1.1)).as_matrix()


def _write(folder: Path, n: int = 9, factors=(1,)) -> np.ndarray:
    """poses_bounds.npy in a tilted world, with photos at the given factors; returns the array."""
    rows = []
    for index, pose in enumerate(ring(n)):
        position = project(pose, POINT, (FOCAL, FOCAL), (WIDTH / 2, HEIGHT / 2))
        for factor in factors:
            name = f"IMG_{index:02}.png" if factor == 1 else f"image{index:03}.png"
            path = folder / ("images" if factor == 1 else f"images_{factor}") / name
            save(path, spot(position / factor, WIDTH // factor, HEIGHT // factor, 3 / factor))
        right, up, back, eye = (TILT @ column for column in pose[:3].T)
        matrix = np.stack([-up, right, back, eye, (HEIGHT, WIDTH, FOCAL)], axis=1)
        rows.append(np.concatenate([matrix.ravel(), (2.0, 7.0)]))
    np.save(folder / "poses_bounds.npy", np.array(rows))
    return np.array(rows)


def test_axes_split_and_levelled_world(tmp_path):
    _write(tmp_path)
    data = load_dataset(tmp_path)
    assert [v.name for v in data.test] == ["IMG_00.png", "IMG_08.png"] and len(data.train) == 7
    assert data.unbounded and not data.white_background
    point = data.source_to_world[:3, :3] @ TILT @ POINT
    for view in (*data.train, *data.test):
        assert_spot_is_where_the_camera_says(view, point)
        assert view.camera.c2w[2, 0] == pytest.approx(0, abs=1e-9)  # level: right axes are horizontal
        assert view.camera.c2w[2, 1] > 0
    np.testing.assert_allclose(data.bounds.mean(axis=0), 0, atol=1e-6)


@pytest.mark.parametrize(
    ("factors", "downscale", "folder", "shrink"),
    [
        ((1, 4), 4, "images_4", 1),
        ((1, 4), 2, "images", 2),
        ((4,), 8, "images_4", 2),
        ((4,), None, "images_4", 1),
        ((1, 2, 4), 4, "images_4", 1),
    ],
)
def test_the_nearest_stored_size_is_used(tmp_path, factors, downscale, folder, shrink):
    _write(tmp_path, n=3, factors=factors)
    data = load_dataset(tmp_path, downscale=downscale)
    point = data.source_to_world[:3, :3] @ TILT @ POINT
    for view in data.train:
        assert view.image_path.parent.name == folder and view.downscale == shrink
        assert_spot_is_where_the_camera_says(view, point)


def test_depth_bounds_size_the_cube_of_a_forward_facing_capture(tmp_path):
    rows = _write(tmp_path, n=5)
    for row in rows:  # all look the same way, side by side
        row[:15] = rows[0][:15]
    rows[:, [3, 8, 13]] += np.linspace(-0.1, 0.1, 5)[:, None]
    np.save(tmp_path / "poses_bounds.npy", rows)
    data = load_dataset(tmp_path)
    camera = data.train[1].camera
    depth = (data.bounds.mean(axis=0) - camera.origin) @ camera.forward
    assert depth == pytest.approx(4.0, abs=0.3)  # midway between 2 and 3 x 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: rows[:, :14], r"must be an array \[N,17\]"),
        (
            lambda rows: np.where(np.arange(17) == 3, np.nan, rows),
            "row 0, column 3 is nan; every entry must be",
        ),
        (
            lambda rows: rows[:-1],
            r"has poses of 4 photos, but images has 5; poses and photos are paired by order",
        ),
        (lambda rows: np.where(np.arange(17) == 4, 77, rows), "is 64 pixels high, the intrinsics say 77"),
        (
            lambda rows: np.where(np.arange(17) == 14, -1, rows),
            r"row 0 \(IMG_00.png\): fx must be a positive",
        ),
        (
            lambda rows: np.where(np.arange(17) == 0, 5, rows),
            r"row 0 \(IMG_00.png\): c2w is not a rigid motion",
        ),
        (
            lambda rows: np.where(np.arange(17) == 15, 9, rows),
            "row 0 has the depth bounds 9 to 7; they must be",
        ),
    ],
)
def test_bad_arrays(tmp_path, change, message):
    rows = _write(tmp_path, n=5)
    load_dataset(tmp_path / "poses_bounds.npy")
    np.save(tmp_path / "poses_bounds.npy", change(rows))
    with pytest.raises(DatasetError, match=message):
        load_dataset(tmp_path)


def test_truncated_array_and_missing_photos(tmp_path):
    _write(tmp_path, n=5, factors=())
    with pytest.raises(DatasetError, match="there is no folder images"):
        load_dataset(tmp_path)
    file = tmp_path / "poses_bounds.npy"
    file.write_bytes(file.read_bytes()[:300])
    with pytest.raises(
        DatasetError, match=r"poses_bounds.npy: cannot be read as a NumPy array .*copy it again"
    ):
        load_dataset(tmp_path)


def test_a_photo_of_another_size_is_named(tmp_path):
    _write(tmp_path, n=5)
    save(tmp_path / "images/IMG_03.png", np.zeros((HEIGHT, WIDTH // 2, 3), dtype=np.uint8))
    with pytest.raises(
        DatasetError, match=r"row 3 .*IMG_03.png is 48 pixels wide, the intrinsics say 96; use"
    ):
        load_dataset(tmp_path)
