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


@pytest.mark.parametrize("shrink", [2, 3])
def test_photos_that_were_all_scaled_down_take_their_intrinsics_with_them(tmp_path, shrink):
    _write(tmp_path, n=5)
    small = WIDTH // shrink, HEIGHT // shrink  # 32x21 at a third: the aspect agrees to a pixel
    for index, pose in enumerate(ring(5)):
        position = project(pose, POINT, (FOCAL, FOCAL), (WIDTH / 2, HEIGHT / 2))
        scaled = position * (small[0] / WIDTH, small[1] / HEIGHT)
        save(tmp_path / f"images/IMG_{index:02}.png", spot(scaled, *small, 3 / shrink))
    said = rf"96x64 pixels, all photos have {small[0]}x{small[1]}: the intrinsics are scaled by 0\.[35]"
    with pytest.warns(UserWarning, match=said) as caught:
        data = load_dataset(tmp_path)
    assert len(caught) == 1
    for view in (*data.train, *data.test):
        camera = view.camera
        assert (camera.width, camera.height) == small and camera.fx == pytest.approx(FOCAL / shrink)
        (at,), _ = camera.project((data.source_to_world[:3, :3] @ TILT @ POINT)[None])
        weights = view.load()[..., 0].astype(float)
        brightest = np.unravel_index(weights.argmax(), weights.shape)
        assert np.abs(at - (brightest[1] + 0.5, brightest[0] + 0.5)).max() < 1.0


def _model(folder: Path, rows: np.ndarray, k: float = 0.09, turned: float = 0.0, names=None) -> None:
    """The COLMAP model of the capture, in another world: turned, twice as large, moved."""
    pycolmap = pytest.importorskip("pycolmap", reason="COLMAP models are read by pycolmap")
    other = Rotation.from_euler("XYZ", (0.3, 0.9, -0.2)).as_matrix()
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        model="SIMPLE_RADIAL", width=WIDTH, height=HEIGHT, params=(FOCAL, 47.0, 33.0, k), camera_id=1
    )
    model.add_camera_with_trivial_rig(camera)
    track = pycolmap.Track()
    for index, row in enumerate(rows):
        matrix = row[:15].reshape(3, 5)
        axes = other @ np.stack([matrix[:, 1], matrix[:, 0], -matrix[:, 2]], axis=1)  # right, down, forward
        axes = axes @ Rotation.from_euler("Y", turned * index, degrees=True).as_matrix()
        eye = 2.0 * other @ matrix[:, 3] + (1.0, 2.0, 3.0)
        name = f"IMG_{index:02}.png" if names is None else names[index]
        image = pycolmap.Image(name=name, camera_id=1, image_id=index + 1)
        image.points2D = pycolmap.Point2DList([pycolmap.Point2D(np.array([48.0, 32.0]))])
        model.add_image_with_trivial_frame(
            image, pycolmap.Rigid3d(pycolmap.Rotation3d(axes.T), -axes.T @ eye)
        )
        if index in (1, 2, 3):
            track.add_element(index + 1, 0)
    point = 2.0 * other @ TILT @ POINT + (1.0, 2.0, 3.0)
    model.add_point3D(point, track, np.array([9, 8, 7], np.uint8))
    (folder / "sparse/0").mkdir(parents=True)
    model.write_binary(folder / "sparse/0")


def test_lens_and_points_come_from_the_model_in_the_same_folder(tmp_path):
    rows = _write(tmp_path, n=5, factors=(1, 2))
    plain = load_dataset(tmp_path, downscale=1)
    assert plain.points is None and plain.train[0].camera.distortion == ()
    _model(tmp_path, rows)
    data = load_dataset(tmp_path, downscale=1)
    np.testing.assert_allclose(data.source_to_world, plain.source_to_world)
    assert data.depths == plain.depths
    for view, before in zip(data.train, plain.train, strict=True):
        np.testing.assert_allclose(view.camera.c2w, before.camera.c2w)
        assert view.camera.distortion == (0.09, 0.0, 0.0, 0.0) and view.camera.cx == 47.0
    expected = data.source_to_world[:3, :3] @ TILT @ POINT
    np.testing.assert_allclose(data.points.positions, expected[None], atol=1e-9)
    assert data.points.seen_by == (frozenset({"IMG_01.png", "IMG_02.png", "IMG_03.png"}),)
    half = load_dataset(tmp_path, downscale=2)  # photos from images_2, whose names differ
    assert half.points.seen_by == (frozenset({"image001.png", "image002.png", "image003.png"}),)
    assert half.train[0].camera.cx == 23.5


@pytest.mark.parametrize("change", ["turned", "fewer", "damaged"])
def test_another_model_is_not_used(tmp_path, change):
    rows = _write(tmp_path, n=5)
    _model(tmp_path, rows[:4] if change == "fewer" else rows, turned=2.0 if change == "turned" else 0.0)
    if change != "damaged":
        data = load_dataset(tmp_path)
    else:
        file = tmp_path / "sparse/0/images.bin"
        file.write_bytes(file.read_bytes()[:-9])
        with pytest.warns(UserWarning, match=r"cut off .*poses_bounds.npy is used without lens and points"):
            data = load_dataset(tmp_path)
    assert data.points is None and data.train[0].camera.distortion == ()
