"""Points that a training starts from: triangulated from known poses, random ones, cache, split."""

from __future__ import annotations

import dataclasses
import json
import shutil
import sys
import warnings
import zipfile

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.datasets.nerf_normalization import Similarity
from cagefield.datasets.sfm.sparse_points import (
    random_points,
    read_cached_points,
    starting_points,
    training_points,
)
from cagefield.datasets.sfm.triangulation import nearest_pairs, triangulate
from cagefield.datasets.views import SparsePoints
from cagefield.errors import DatasetError
from posed_photos import distance_to_textures, photo_of_textures, ring, save, textured_capture

pytest.importorskip("pycolmap", reason="points are triangulated by pycolmap")


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    return textured_capture(tmp_path_factory.mktemp("textured"))


@pytest.fixture(scope="module")
def data(capture):
    return load_dataset(capture, holdout=5)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def points(data, cache):
    return starting_points(data, cache)


def test_points_lie_on_the_surfaces_that_the_photos_show(data, points):
    assert len(points) > 300
    # half a pixel at distance 4 and focal length 350 is 0.006 across, and several times that in depth
    assert np.median(distance_to_textures(points.positions)) < 0.01
    assert np.quantile(distance_to_textures(points.positions), 0.9) < 0.06
    assert np.median(points.errors) < 1.0 and points.errors.max() <= 4.0


def test_colors_are_those_of_the_photos_at_the_points(data, points):
    camera, photo = data.train[0].camera, data.train[0].load()
    rows = [i for i, seen in enumerate(points.seen_by) if data.train[0].name in seen]
    at, _ = camera.project(points.positions[rows])
    inside = np.all((at >= 0) & (at < (camera.width, camera.height)), axis=1)
    columns, lines = at[inside].astype(int).T
    off = np.abs(photo[lines, columns].astype(float) - points.rgb[rows][inside])
    assert inside.mean() > 0.95 and np.median(off) < 12  # of 255; features sit on edges


@pytest.mark.nightly
def test_training_views_alone_make_the_points_of_a_training(data, points, tmp_path):
    tested = {view.name for view in data.test}
    trained = {view.name for view in data.train}
    assert len(tested) == 2 and all(seen <= trained for seen in points.seen_by)
    everything = starting_points(data, tmp_path, views="all")
    assert any(seen & tested for seen in everything.seen_by)


@pytest.mark.nightly
@pytest.mark.parametrize(("lens", "cut_out"), [("opencv_fisheye", False), ("opencv", True)])
def test_fisheyes_and_cut_outs(tmp_path, lens, cut_out):
    data = load_dataset(textured_capture(tmp_path, 8, 1.2, cut_out, lens), holdout=0)
    found = starting_points(data)
    assert len(found) > 100
    distances = distance_to_textures(found.positions)
    if cut_out:  # the outline is no place: all points are on the ball
        distances = np.abs(np.linalg.norm(found.positions, axis=1) - 1.0)
    assert np.median(distances) < 0.012 and np.quantile(distances, 0.9) < 0.06


@pytest.mark.nightly
def test_another_world_gives_the_same_points_there(data, points):
    rigid = np.eye(4)
    rigid[:3, :3] = Camera.look_at((1, 2, 3), (0, 0, 0), width=2, height=2, fov_x=1.0).c2w[:3, :3]
    rigid[:3, 3] = 5000.0, -300.0, 20.0
    similarity = Similarity(rigid, 100.0)
    moved = starting_points(similarity.transform_dataset(data, np.array([[-1e4] * 3, [1e4] * 3])))
    assert abs(len(moved) - len(points)) <= 0.01 * len(points)
    back = (moved.positions - rigid[:3, 3]) @ rigid[:3, :3] / 100.0
    assert np.median(distance_to_textures(back)) < 0.01


@pytest.mark.nightly
def test_points_made_again_are_the_same(data, points):
    np.testing.assert_allclose(starting_points(data).positions, points.positions, atol=1e-6)


@pytest.mark.nightly
def test_shrunk_photos_give_the_same_points(capture, points):
    found = triangulate(load_dataset(capture, downscale=2, holdout=5).train)
    np.testing.assert_allclose(found.positions, points.positions, atol=1e-6)


@pytest.mark.nightly
def test_poses_off_by_a_little_still_give_points(data):
    rng = np.random.default_rng(1)

    def shaken(view):
        pose = view.camera.c2w.copy()
        pose[:3, 3] += rng.normal(0, 0.008, 3)  # 0.7 pixels at the ball's distance
        return dataclasses.replace(view, camera=view.camera.with_c2w(pose))

    found = triangulate([shaken(view) for view in data.train])
    assert len(found) > 200 and np.median(distance_to_textures(found.positions)) < 0.05


def test_the_cache_serves_the_same_capture_and_no_other(data, points, cache, tmp_path, monkeypatch):
    first = points
    shutil.copytree(cache, tmp_path, dirs_exist_ok=True)
    (file,) = tmp_path.iterdir()
    asked = []

    def made_again(views, **_):
        asked.append(len(views))
        return first.take(np.arange(60))

    monkeypatch.setattr("cagefield.datasets.sfm.sparse_points.triangulate", made_again)
    again = starting_points(data, tmp_path)
    assert not asked
    np.testing.assert_array_equal(again.positions, first.positions)
    np.testing.assert_array_equal(again.rgb, first.rgb)
    np.testing.assert_array_equal(again.errors, first.errors)
    assert again.seen_by == first.seen_by
    moved = dataclasses.replace(data.train[0], camera=data.train[1].camera)
    assert len(starting_points(dataclasses.replace(data, train=(moved, *data.train[1:])), tmp_path)) == 60
    assert len(starting_points(data, tmp_path, seed=1)) == 60
    file.write_bytes(file.read_bytes()[:2000])  # a damaged file is made again
    assert len(starting_points(data, tmp_path)) == 60
    photo = data.train[0].image_path
    before = photo.read_bytes()
    save(photo, photo_of_textures(data.train[1].camera))
    try:
        asked.clear()
        starting_points(data, tmp_path)
        assert asked == [len(data.train)]
    finally:
        photo.write_bytes(before)


WHOLE = {
    "positions": np.zeros((2, 3)),
    "rgb": np.zeros((2, 3), np.uint8),
    "errors": np.zeros(2, np.float32),
    "names": np.array(["a", "b"]),
    "counts": np.array([1, 1]),
    "seen": np.array([0, 1]),
}


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999,)}\n",
        "{'descr': '<f8', 'fortran_order': False, 'shape': ((1,),)}\n",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}\n",
        "{'descr': '|O', 'fortran_order': False, 'shape': (1,)}\n",
        "{'descr': '<U0', 'fortran_order': False, 'shape': (99999999999,)}\n",
        "(((((",
    ],
)
def test_a_cache_whose_arrays_do_not_fit_the_file_is_none(tmp_path, header):
    file = tmp_path / "points.npz"
    with zipfile.ZipFile(file, "w") as archive:
        for name in WHOLE:
            start = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little")
            archive.writestr(f"{name}.npy", start + header.encode() + bytes(8))
    assert read_cached_points(file) is None


@pytest.mark.parametrize(
    "changed",
    [
        {"names": np.zeros(3)},
        {"names": np.array("a")},
        {"counts": np.array(3)},
        {"counts": np.array([[1, 1]])},
        {"counts": np.array([-1, 3])},
        {"counts": np.array([-1, 10**18])},
        {"counts": np.array([2, 1])},
        {"seen": np.array(["x"])},
        {"seen": np.array([0, -1])},
        {"seen": np.array([0, 2])},
        {"positions": np.zeros((2, 2))},
        {"positions": np.full((2, 3), np.nan)},
        {"errors": np.array(["x", "y"])},
    ],
)
def test_a_cache_that_does_not_fit_together_is_none(tmp_path, changed):
    file = tmp_path / "points.npz"
    np.savez(file, **WHOLE)
    assert len(read_cached_points(file)) == 2
    np.savez(file, **{**WHOLE, **changed})
    assert read_cached_points(file) is None


def test_a_cache_with_bytes_changed_raises_nothing(tmp_path):
    file = tmp_path / "points.npz"
    np.savez(file, **WHOLE)
    content, rng = file.read_bytes(), np.random.default_rng(1)
    for _ in range(500):
        changed = np.frombuffer(content, np.uint8).copy()
        changed[rng.integers(len(changed), size=4)] = rng.integers(256, size=4)
        file.write_bytes(changed.tobytes())
        read_cached_points(file)


def test_a_data_set_s_own_points_are_used_without_those_of_held_out_photos(data):
    names = [view.name for view in data.train]
    seen = [frozenset(names[:2])] * 60 + [frozenset({names[0], data.test[0].name})] * 40
    seen += [frozenset(view.name for view in data.test)] * 20
    positions = np.random.default_rng(0).normal(size=(120, 3))
    own = SparsePoints(positions, np.zeros((120, 3), np.uint8), tuple(seen))
    with_points = dataclasses.replace(data, points=own)
    assert len(training_points(with_points)) == 60
    np.testing.assert_array_equal(starting_points(with_points).positions, positions[:60])
    assert starting_points(with_points, views="all") is own
    unknown = SparsePoints(positions, np.zeros((120, 3), np.uint8))
    assert training_points(dataclasses.replace(data, points=unknown)) is unknown
    assert training_points(data) is None


@pytest.mark.nightly
def test_photos_without_texture_give_none_with_one_warning(tmp_path):
    textured_capture(tmp_path, 4)
    for photo in tmp_path.glob("*/*.png"):
        save(photo, np.full((240, 320, 3), 90, np.uint8))
    with pytest.warns(UserWarning, match=r"the photos give 0 points, too few to start from") as caught:
        assert starting_points(load_dataset(tmp_path, holdout=0), tmp_path / "cache") is None
    assert len(caught) == 1


def test_without_pycolmap_the_warning_names_the_cure(data, monkeypatch):
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.warns(UserWarning, match=r"pip install -U pycolmap") as caught:
        assert starting_points(data) is None
    assert len(caught) == 1


@pytest.mark.nightly
def test_progress_grows_to_one_and_nothing_is_printed(data, capfd):
    shares = []
    triangulate(data.train[:4], on_progress=lambda done, note: shares.append(done))
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert capfd.readouterr() == ("", "")


def test_pairs_of_many_cameras_are_the_nearest_and_never_face_each_other():
    poses = ring(120)
    cameras = [Camera.from_fov(pose, 40, 30, 1.0) for pose in poses]
    pairs = nearest_pairs(cameras)
    steps = [min(j - i, 120 - (j - i)) for i, j in pairs]
    assert len(pairs) == len(set(pairs)) and max(steps) < 30  # 90 degrees
    assert {1, 2, 3, 4} <= set(steps) and len(pairs) < 2000
    opposite = [cameras[0], cameras[60]]
    assert nearest_pairs(opposite) == []


def test_random_points_are_seen_and_have_the_photos_colors(data):
    found = random_points(data, 400, seed=3)
    assert len(found) == 400
    inside = np.all((found.positions >= data.bounds[0]) & (found.positions <= data.bounds[1]), axis=1)
    assert inside.sum() == 200
    for point, rgb in list(zip(found.positions, found.rgb, strict=True))[::40]:
        colors = []
        for view in data.train:
            (at,), (depth,) = view.camera.project(point[None])
            if depth > 0 and 0 <= at[0] < view.camera.width and 0 <= at[1] < view.camera.height:
                colors.append(view.load()[int(at[1]), int(at[0])])
        assert len(colors) >= 2
        np.testing.assert_allclose(rgb, np.mean(colors, axis=0), atol=1)
    again, other = random_points(data, 400, seed=3), random_points(data, 400, seed=4)
    np.testing.assert_array_equal(found.positions, again.positions)
    assert not np.array_equal(found.positions, other.positions)


def test_random_points_of_cut_outs_lie_within_the_outline(tmp_path):
    data = load_dataset(textured_capture(tmp_path, 12, 2 * np.pi, cut_out=True), holdout=0)
    found = random_points(data, 300)
    # the visual hull of twelve views from one height is wider than the ball, by little at the sides
    assert len(found) == 300 and np.quantile(np.linalg.norm(found.positions, axis=1), 0.9) < 1.1


def test_random_points_that_no_camera_sees_are_an_error(data):
    with pytest.raises(DatasetError, match="no camera sees the scene's bounds"):
        bounds = np.array([[900.0] * 3, [901.0] * 3])
        random_points(dataclasses.replace(data, bounds=bounds, unbounded=False), 10)
    with pytest.raises(DatasetError, match="count must be at least 1, got 0"):
        random_points(data, 0)


def _with_ply(folder, text, data=b""):
    values = json.loads((folder / "transforms.json").read_text())
    (folder / "transforms.json").write_text(json.dumps({**values, "ply_file_path": "./sparse_pc.ply"}))
    (folder / "sparse_pc.ply").write_bytes(text.encode() + data)


PLY = (
    "ply\nformat {}\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
)


def test_nerfstudio_points_are_read(tmp_path):
    textured_capture(tmp_path, 3)
    _with_ply(tmp_path, PLY.format("ascii 1.0") + "0.5 -1 2 255 0 7\n1 2 3 4 5 6\nnan 0 0 1 1 1\n")
    points = load_dataset(tmp_path).points
    assert points.positions.tolist() == [[0.5, -1.0, 2.0], [1.0, 2.0, 3.0]]
    assert points.rgb.tolist() == [[255, 0, 7], [4, 5, 6]] and points.seen_by == ()
    rows = np.zeros(3, [("p", "<f4", 3), ("c", "u1", 3)])
    rows["p"], rows["c"] = np.eye(3), 9
    _with_ply(tmp_path, PLY.format("binary_little_endian 1.0"), rows.tobytes())
    points = load_dataset(tmp_path).points
    np.testing.assert_array_equal(points.positions, np.eye(3))
    assert points.rgb.tolist() == [[9, 9, 9]] * 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PLY.format("binary_little_endian 1.0"), r"sparse_pc.ply: it says 3 of vertex, and holds 0"),
        ("plx\n", r"sparse_pc.ply: not a PLY file; .*is used without its points"),
        (PLY.replace("x\n", "a\n").format("ascii 1.0") + "0 0 0 0 0 0\n" * 3, "its vertices have no x, y, z"),
    ],
)
def test_damaged_points_are_left_out_with_a_warning(tmp_path, text, message):
    textured_capture(tmp_path, 3)
    _with_ply(tmp_path, text)
    with pytest.warns(UserWarning, match=message):
        assert load_dataset(tmp_path).points is None
    (tmp_path / "sparse_pc.ply").unlink()
    with pytest.warns(UserWarning, match="sparse_pc.ply: no such file.*is used without its points"):
        assert load_dataset(tmp_path).points is None


def test_valid_data_sets_give_no_warning(tmp_path):
    textured_capture(tmp_path, 3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_dataset(tmp_path).points is None
