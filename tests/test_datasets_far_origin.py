"""Captures far from the origin: float32 holds their poses, exports have the files' coordinates."""

from __future__ import annotations

import json
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.datasets import load_dataset
from cagefield.datasets.sfm.pose_refinement import RefinedPoses
from cagefield.datasets.sfm.pose_verification import replace_cameras
from cagefield.files.ply import read_ply
from cagefield.scene.scene import Scene
from commands import printed
from posed_photos import ring, save
from splat_scenes import random_splats

UTM = np.array([500123.25, 5412345.5, 312.0])
EARTH_CENTERED = np.array([4_100_000.0, 600_000.0, 4_800_000.0])
N, WIDTH, HEIGHT = 9, 24, 16
SPARSE = np.array([(0.1 * k, 0.2, -0.05 * k) for k in range(20)])


def write_photos(folder, scale):
    poses = ring(N)
    for i, pose in enumerate(poses):
        save(folder / f"images/{i}.png", np.full((HEIGHT, WIDTH, 3), 20 * i, np.uint8))
        pose[:3, 3] *= scale
    return poses


def write_transforms(folder, far, scale=1.0, **more):
    poses = write_photos(folder, scale)
    for pose in poses:
        pose[:3, 3] += far
    frames = [{"file_path": f"images/{i}.png", "transform_matrix": p.tolist()} for i, p in enumerate(poses)]
    rows = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in (scale * SPARSE + far).tolist())
    header = "ply\nformat ascii 1.0\nelement vertex 20\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n"
    (folder / "points.ply").write_text(header + rows)
    values = {"fl_x": 30.0, "fl_y": 30.0, "ply_file_path": "points.ply", "frames": frames, **more}
    (folder / "transforms.json").write_text(json.dumps(values))
    return poses


def write_colmap(folder, far):
    poses = write_photos(folder, 1.0)
    lines = []
    for i, pose in enumerate(poses):
        pose[:3, 3] += far
        turn = (pose[:3, :3] * (1, -1, -1)).T
        x, y, z, w = Rotation.from_matrix(turn).as_quat()
        values = " ".join(repr(float(v)) for v in (w, x, y, z, *(-turn @ pose[:3, 3])))
        lines += [f"{i + 1} {values} 1 {i}.png", ""]
    model = folder / "sparse/0"
    model.mkdir(parents=True)
    (model / "cameras.txt").write_text("1 PINHOLE 24 16 30 30 12 8\n")
    (model / "images.txt").write_text("\n".join(lines) + "\n")
    points = [f"{k + 1} " + " ".join(map(repr, p)) for k, p in enumerate((SPARSE + far).tolist())]
    (model / "points3D.txt").write_text("".join(f"{point} 1 2 3 0.5\n" for point in points))
    return poses


@pytest.mark.parametrize("write", [write_transforms, write_colmap])
@pytest.mark.parametrize("far", [UTM, EARTH_CENTERED])
def test_cameras_and_points_lie_at_the_origin(tmp_path, write, far):
    poses = write(tmp_path, far)
    with pytest.warns(UserWarning, match=r"its coordinates are far from the origin; \(\d+, \d+, \d+\) is"):
        data = load_dataset(tmp_path)
    views = sorted((*data.train, *data.test), key=lambda view: view.name)
    expected = np.eye(4)
    expected[:3, 3] = -np.array(data.offset)
    # The file's axes, and no more of its coordinates than the offset.
    np.testing.assert_allclose(data.source_to_world, expected, atol=1e-8)
    for view, pose in zip(views, poses, strict=True):
        assert np.linalg.norm(view.camera.origin) < 8
        # float64 holds coordinates of millions to 1e-9; a quaternion's rounding counts as often.
        np.testing.assert_allclose(view.camera.c2w, expected @ pose, atol=1e-7)
    np.testing.assert_allclose(data.points.positions, SPARSE + far - data.offset, atol=1e-7)
    assert (data.bounds[0] < data.points.positions[0]).all()
    assert (data.points.positions[0] < data.bounds[1]).all()


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_the_rule_has_no_unit(tmp_path, scale):
    """The ring's cameras are 4.5 from its middle: 20000 away is far, 2000 is not, whatever the unit."""
    write_transforms(tmp_path, np.array([2e4 * scale, 0.0, 0.0]), scale)
    with pytest.warns(UserWarning, match="far from the origin"):
        data = load_dataset(tmp_path)
    assert np.abs(np.array(data.offset) - (2e4 * scale, 0, 0)).max() <= 8 * scale
    write_transforms(tmp_path, np.array([2e3 * scale, 0.0, 0.0]), scale)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_dataset(tmp_path).offset == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("write", [write_transforms, write_colmap])
def test_exports_of_trained_scenes_have_the_files_coordinates(tmp_path, capsys, write):
    write(tmp_path / "data", UTM)
    with pytest.warns(UserWarning, match="far from the origin"):
        data = load_dataset(tmp_path / "data")
    trained = SimpleNamespace(field=random_splats(50), gains=np.ones((len(data.train), 3), np.float32))
    scene = Scene.trained(trained, data)
    assert scene.field.offset == data.offset
    scene.save(tmp_path / "scene")
    printed(capsys, "export", tmp_path / "scene", "-o", tmp_path / "a.ply", "--up", "y-down")
    vertex = read_ply(tmp_path / "a.ply").elements["vertex"]
    found = np.stack([vertex[axis] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(found, trained.field.means + np.array(data.offset), atol=1e-6)


@pytest.mark.parametrize("aligned", [True, False])
def test_poses_in_another_world_have_no_offset(tmp_path, aligned):
    write_transforms(tmp_path, UTM)
    with pytest.warns(UserWarning, match="far from the origin"):
        data = load_dataset(tmp_path)
    cameras = {view.name: view.camera for view in (*data.train, *data.test)}
    found = replace_cameras(data, RefinedPoses(cameras, data.points, 0.5, aligned))
    assert found.offset == (data.offset if aligned else (0.0, 0.0, 0.0))
    np.testing.assert_array_equal(found.source_to_world, data.source_to_world if aligned else np.eye(4))
