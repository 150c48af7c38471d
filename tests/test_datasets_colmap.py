"""COLMAP: models written by pycolmap, binary and text, in every camera model that is read."""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from cagefield.datasets import load_dataset
from cagefield.datasets.colmap import colmap_files
from cagefield.datasets.colmap.colmap_files import check_complete
from cagefield.datasets.nerf_normalization import normalize_to_unit_cube
from cagefield.errors import DatasetError
from posed_photos import HEIGHT, POINT, WIDTH, assert_spot_is_where_the_camera_says, project, ring, save, spot
from tiers import nightly_except

pycolmap = pytest.importorskip("pycolmap", reason="COLMAP models are read by pycolmap")

TILT = Rotation.from_euler("XYZ", (0.7, -0.4, 1.1)).as_matrix()
F, C = (90.0, 94.0), (46.0, 33.5)
SQUARE = (90.0, 90.0)
CAMERAS = {  # COLMAP parameters, and the same for the oracle
    "SIMPLE_PINHOLE": ((90.0, *C), {"focal": SQUARE}),
    "PINHOLE": ((*F, *C), {"focal": F}),
    "SIMPLE_RADIAL": ((90.0, *C, 0.12), {"focal": SQUARE, "k": (0.12, 0.0)}),
    "RADIAL": ((90.0, *C, 0.12, -0.07), {"focal": SQUARE, "k": (0.12, -0.07)}),
    "OPENCV": ((*F, *C, 0.12, -0.07, 0.004, -0.003), {"focal": F, "k": (0.12, -0.07), "p": (0.004, -0.003)}),
    "OPENCV_FISHEYE": (
        (*F, *C, 0.06, -0.02, 0.004, -0.001),
        {"focal": F, "fisheye": (0.06, -0.02, 0.004, -0.001)},
    ),
}


def _write(
    folder: Path, model="PINHOLE", text=False, n=9, where="sparse/0", factors=(1,), params=None
) -> None:
    """A capture in a tilted world with a cloud of 300 points within half a unit of the origin."""
    params, oracle = (params, {"focal": F}) if params is not None else CAMERAS[model]
    reconstruction = pycolmap.Reconstruction()
    camera = pycolmap.Camera(model=model, width=WIDTH, height=HEIGHT, params=params, camera_id=1)
    reconstruction.add_camera_with_trivial_rig(camera)
    for index, pose in enumerate(ring(n)):
        position = project(pose, POINT, axis=C, **oracle)
        for factor in factors:
            images = folder / ("images" if factor == 1 else f"images_{factor}")
            pixels = spot(position / factor, WIDTH // factor, HEIGHT // factor, 3 / factor)
            save(images / f"cam/{index:02}.png", pixels)
        tilted = TILT @ pose[:3] * (1, -1, -1, 1)  # OpenCV axes
        rotation = tilted[:, :3].T
        rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), -rotation @ tilted[:, 3])
        image = pycolmap.Image(name=f"cam/{index:02}.png", camera_id=1, image_id=index + 1)
        reconstruction.add_image_with_trivial_frame(image, rigid)
    for point in np.random.default_rng(0).uniform(-0.5, 0.5, (300, 3)):
        reconstruction.add_point3D(TILT @ point, pycolmap.Track(), np.zeros(3, dtype=np.uint8))
    target = folder / where
    target.mkdir(parents=True, exist_ok=True)
    (reconstruction.write_text if text else reconstruction.write_binary)(target)


@pytest.mark.parametrize("text", [False, True], ids=["binary", "text"])
@pytest.mark.parametrize("model", CAMERAS)
def test_the_point_is_where_the_camera_says(tmp_path, model, text):
    _write(tmp_path, model, text)
    data = load_dataset(tmp_path)
    assert [v.name for v in data.test] == ["cam/00.png", "cam/08.png"] and len(data.train) == 7
    assert data.unbounded and not data.white_background and data.name == tmp_path.name
    point = data.source_to_world[:3, :3] @ TILT @ POINT
    for view in (*data.train, *data.test):
        assert_spot_is_where_the_camera_says(view, point)
        assert view.camera.c2w[2, 0] == pytest.approx(0, abs=1e-9) and view.camera.c2w[2, 1] > 0  # level
    # levelled, the cloud's cube is turned about z: between 0.5 and 0.5 sqrt(2) wide to each side
    np.testing.assert_allclose(data.bounds.mean(axis=0), 0, atol=0.02)
    assert 0.45 < data.bounds[1, 0] < 0.71


@pytest.mark.parametrize("where", ["sparse/0", "sparse", ".", "colmap/sparse/0"])
def test_places_of_the_model(tmp_path, where):
    _write(tmp_path, where=where, n=3)
    for path in (tmp_path, tmp_path / where, tmp_path / where / "cameras.bin"):
        data = load_dataset(path)
        assert data.path.resolve() == tmp_path.resolve()
        assert len(data.train) == 2


@pytest.mark.parametrize(
    ("factors", "downscale", "folder", "shrink"),
    [
        ((1, 4), 4, "images_4", 1),
        ((1, 4), 2, "images", 2),
        ((1, 2), 4, "images_2", 2),
        ((4,), None, "images_4", 1),
    ],
)
def test_the_nearest_stored_size_is_used(tmp_path, factors, downscale, folder, shrink):
    _write(tmp_path, "OPENCV", n=3, factors=factors)
    data = load_dataset(tmp_path, downscale=downscale)
    point = data.source_to_world[:3, :3] @ TILT @ POINT
    for view in data.train:
        assert view.image_path.parents[1].name == folder and view.downscale == shrink
        assert_spot_is_where_the_camera_says(view, point)


def test_a_frame_missing_from_the_stored_size_comes_from_the_full_one(tmp_path):
    _write(tmp_path, n=3, factors=(1, 4))
    (tmp_path / "images_4/cam/01.png").unlink()
    (tmp_path / "images_4/cam/02.png").rename(tmp_path / "images_4/cam/02.bmp")
    views = load_dataset(tmp_path, downscale=4).train
    assert [v.image_path.relative_to(tmp_path).as_posix() for v in views] == [
        "images/cam/01.png",
        "images_4/cam/02.bmp",
    ]
    assert [v.load().shape for v in views] == [(HEIGHT // 4, WIDTH // 4, 3)] * 2


def test_missing_photos_are_named_and_none_left_is_an_error(tmp_path):
    _write(tmp_path, n=4)
    (tmp_path / "images/cam/02.png").unlink()
    with pytest.warns(UserWarning, match=r"1 of 4 frames are left out, their photos are missing: cam/02.png"):
        data = load_dataset(tmp_path)
    assert [v.name for v in data.train] == ["cam/01.png", "cam/03.png"]
    for photo in (tmp_path / "images/cam").iterdir():
        photo.unlink()
    with pytest.raises(DatasetError, match="none of the photos of its 4 frames is there"):
        load_dataset(tmp_path)


def test_points_are_in_the_levelled_world_with_colors_errors_and_the_views_that_see_them(tmp_path):
    _write(tmp_path, n=4)
    model = pycolmap.Reconstruction(tmp_path / "sparse/0")
    for image_id in (1, 2, 3, 4):  # the marked point's image in each, so that it has a track
        model.image(image_id).points2D = pycolmap.Point2DList([pycolmap.Point2D(np.array([48.0, 32.0]))])
    track = pycolmap.Track()
    for image_id in (2, 3, 4):
        track.add_element(image_id, 0)
    marked = model.add_point3D(TILT @ POINT, track, np.array([200, 100, 50], dtype=np.uint8))
    model.point3D(marked).error = 0.75
    model.write_binary(tmp_path / "sparse/0")
    (tmp_path / "images/cam/02.png").unlink()
    with pytest.warns(UserWarning, match="cam/02.png"):
        data = load_dataset(tmp_path)
    points = data.points
    assert points is not None and len(points) == 301
    last = points.take(np.array([300]))
    np.testing.assert_allclose(last.positions[0], data.source_to_world[:3, :3] @ TILT @ POINT, atol=1e-9)
    assert last.rgb.tolist() == [[200, 100, 50]]
    assert last.seen_by == (frozenset({"cam/01.png", "cam/03.png"}),)  # the view without a photo is not named
    assert points.seen_by[0] == frozenset()
    assert last.errors is not None and last.errors[0] == pytest.approx(0.75)
    for view in (*data.train, *data.test):  # and the cameras see the point where the photo shows it
        assert_spot_is_where_the_camera_says(view, last.positions[0])


def test_points_follow_the_data_set_into_another_world(tmp_path):
    _write(tmp_path, n=5)
    data = load_dataset(tmp_path)
    moved = normalize_to_unit_cube(data)
    for before, after in zip(data.train, moved.train, strict=True):
        old, _ = before.camera.project(data.points.positions)
        new, _ = after.camera.project(moved.points.positions)
        np.testing.assert_allclose(new, old, atol=1e-6)
    np.testing.assert_array_equal(moved.points.rgb, data.points.rgb)


def test_a_model_without_points_has_none(tmp_path):
    _write(tmp_path, n=3)
    model = pycolmap.Reconstruction(tmp_path / "sparse/0")
    for point in list(model.points3D):
        model.delete_point3D(point)
    model.write_binary(tmp_path / "sparse/0")
    assert load_dataset(tmp_path).points is None


def test_photos_that_were_all_scaled_down_take_their_intrinsics_with_them(tmp_path):
    _write(tmp_path, "OPENCV", n=4)
    for photo in (tmp_path / "images/cam").iterdir():
        with Image.open(photo) as pixels:
            small = pixels.reduce(2)
        small.save(photo)
    with pytest.warns(
        UserWarning, match="96x64 pixels, all photos have 48x32: the intrinsics are scaled by 0.5"
    ):
        data = load_dataset(tmp_path)
    for view in (*data.train, *data.test):
        assert_spot_is_where_the_camera_says(view, data.source_to_world[:3, :3] @ TILT @ POINT)
    (tmp_path / "images/cam/01.png").unlink()
    save(tmp_path / "images/cam/01.png", np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8))
    with pytest.raises(DatasetError, match="is 48 pixels wide, the intrinsics say 96; use"):
        load_dataset(tmp_path)  # photos of two sizes were not all scaled alike


def test_impossible_intrinsics_and_sizes(tmp_path):
    _write(tmp_path / "a", params=(-1.0, 94.0, *C), n=2)
    with pytest.raises(
        DatasetError, match=r"camera 1: fx must be a positive focal length in pixels, got -1.0"
    ):
        load_dataset(tmp_path / "a")
    _write(tmp_path / "b", n=2)
    save(tmp_path / "b/images/cam/01.png", np.zeros((HEIGHT // 2, WIDTH, 3), dtype=np.uint8))
    with pytest.raises(
        DatasetError, match=r"image cam/01.png: .* is 32 pixels high, the intrinsics say 64; use"
    ):
        load_dataset(tmp_path / "b")


@pytest.fixture(scope="module")
def rigs(tmp_path_factory):
    """A model with two rigs of three sensors, tracks and image points."""
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig = 2, 3, 2
    options.num_points3D = 10
    folder = tmp_path_factory.mktemp("rigs")
    pycolmap.synthesize_dataset(options).write_binary(folder)
    return folder


COLMAP_FILES = ("cameras.bin", "images.bin", "points3D.bin", "rigs.bin", "frames.bin")


@pytest.mark.parametrize(
    ("name", "part"),
    nightly_except(product(COLMAP_FILES, [1 << 20, 64, 5]), *product(COLMAP_FILES, [64])),
)
def test_binary_files_cut_off_anywhere_are_noticed(rigs, tmp_path, monkeypatch, name, part):
    """However much of them is held at a time, at least one byte; what is asked for is read anew."""
    monkeypatch.setattr(colmap_files, "_WINDOW_BYTES", part)
    check_complete(rigs)
    whole = (rigs / name).read_bytes()
    for length in {*range(0, len(whole), 7), len(whole) - 1}:
        (tmp_path / name).write_bytes(whole[:length])
        with pytest.raises(
            DatasetError, match=rf"{name}: the file is cut off after {length} bytes; copy or export"
        ):
            check_complete(tmp_path)
    (tmp_path / name).write_bytes(whole)
    check_complete(tmp_path)


def test_a_model_cut_off_is_refused(tmp_path):
    _write(tmp_path, n=2)
    file = tmp_path / "sparse/0/cameras.bin"
    file.write_bytes(file.read_bytes()[:-8])  # pycolmap alone would read the last parameter as zero
    with pytest.raises(DatasetError, match=r"cameras.bin: the file is cut off after 56 bytes"):
        load_dataset(tmp_path)


def test_damaged_and_missing_parts(tmp_path):
    _write(tmp_path / "a", n=2, text=True)
    file = tmp_path / "a/sparse/0/images.txt"
    whole = file.read_text()
    for part in ("", whole[: len(whole) // 2]):
        file.write_text(part)
        message = r"images.txt, line 5: must be IMAGE_ID .*export" if part else "no registered images"
        with pytest.raises(DatasetError, match=message):
            load_dataset(tmp_path / "a")
    file.unlink()
    with pytest.raises(DatasetError, match=r"images.txt: cannot be read \(No such file.*export"):
        load_dataset(tmp_path / "a")
    _write(tmp_path / "b", n=2, factors=())
    with pytest.raises(DatasetError, match="no folder images in it or up to three levels above it"):
        load_dataset(tmp_path / "b")
    _write(tmp_path / "c", n=0)
    (tmp_path / "c/images").mkdir()
    with pytest.raises(DatasetError, match="the model has no registered images"):
        load_dataset(tmp_path / "c")


def test_without_pycolmap_the_cure_is_named(tmp_path, monkeypatch):
    _write(tmp_path, n=2)
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.raises(DatasetError, match=r"needs pycolmap; pip install -U pycolmap"):
        load_dataset(tmp_path)
