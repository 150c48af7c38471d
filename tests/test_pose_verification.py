"""Poses that come with photos: measured, left alone where right, corrected in their world where wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.captures.perturbation import perturbed
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.datasets.natural_order import natural_key
from cagefield.datasets.sfm import pose_verification
from cagefield.datasets.sfm.epipolar_error import (
    PoseError,
    epipolar_errors,
    focal_spread,
    match_photos,
    pose_error,
)
from cagefield.datasets.sfm.pose_alignment import align_poses
from cagefield.datasets.sfm.pose_refinement import camera_groups
from cagefield.datasets.sfm.pose_verification import describe, sorted_views, verify_poses
from cagefield.datasets.sfm.transforms_writer import write_transforms
from cagefield.datasets.views import Dataset
from posed_photos import ring, textured_capture

COUNT, WIDTH, HEIGHT = 12, 360, 270


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Dataset:
    folder = textured_capture(tmp_path_factory.mktemp("posed"), COUNT, 1.9, size=(WIDTH, HEIGHT))
    return replace(load_dataset(folder, downscale=1), unbounded=False)  # no search for folds: test_folds


@pytest.fixture(scope="module")
def large_capture(tmp_path_factory) -> Dataset:
    """More and larger photos."""
    folder = textured_capture(tmp_path_factory.mktemp("posed"), 16, 1.9, size=(480, 360))
    return replace(load_dataset(folder, downscale=1), unbounded=False)


def disagreement(one: Dataset, other: Dataset) -> tuple[float, float]:
    """(largest turn in degrees, largest offset) between aligned cameras: errors of the shape alone."""
    poses = np.stack([view.camera.c2w for view in sorted_views(one)])
    target = np.stack([view.camera.c2w for view in sorted_views(other)])
    found = align_poses(poses, target)
    moved = np.stack([found.transform_pose(pose) for pose in poses])
    turns = Rotation.from_matrix(moved[:, :3, :3].transpose(0, 2, 1) @ target[:, :3, :3]).magnitude()
    return np.degrees(turns.max()), float(np.linalg.norm(moved[:, :3, 3] - target[:, :3, 3], axis=1).max())


def test_the_error_is_the_distance_to_the_epipolar_line():
    one = Camera.look_at((0, -4, 1), (0, 0, 0), width=400, height=300, fov_x=1.0)
    other = Camera.look_at((2, -4, 0), (0, 0, 0), width=400, height=300, fov_x=1.0)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 3))
    first, second = one.project(points)[0], other.project(points)[0]
    # Rays are unit vectors in float64: nothing but rounding is left.
    assert epipolar_errors(one, other, first, second).max() < 1e-6
    # The epipolar line of each first pixel in the second photo, by two points of its ray.
    near, far = (other.project(one.origin + t * (points - one.origin))[0] for t in (0.8, 1.5))
    along = (far - near) / np.linalg.norm(far - near, axis=1, keepdims=True)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    errors = epipolar_errors(one, other, first, second + 2.0 * across)
    # In pixels at the axis; 20 degrees off it a pixel is a smaller angle by cos(20 degrees)^2 at most.
    assert np.all(errors < 2.6) and np.all(errors > 1.6)
    assert np.median(errors) == pytest.approx(2.0, abs=0.2)


def test_alignment_withstands_a_minority_of_wrong_poses():
    rng = np.random.default_rng(1)
    target = np.stack(ring(20))
    turn = Rotation.from_rotvec((0.4, -1.0, 0.3)).as_matrix()
    poses = target.copy()
    poses[:, :3, :3] = turn @ target[:, :3, :3]
    poses[:, :3, 3] = 0.2 * (target[:, :3, 3] @ turn.T) + (1, 2, 3)
    for n in (3, 8, 15):
        poses[n, :3, 3] += rng.normal(size=3)
        poses[n, :3, :3] = Rotation.random(random_state=n).as_matrix()
    found = align_poses(poses, target)
    assert found.scale == pytest.approx(5.0, rel=1e-4)
    np.testing.assert_allclose(found.rotation, turn.T, atol=1e-5)
    good = [n for n in range(20) if n not in (3, 8, 15)]
    np.testing.assert_allclose(found.transform_points(poses[good, :3, 3]), target[good, :3, 3], atol=1e-3)


def test_unrelated_poses_are_not_aligned():
    target = np.stack(ring(12))
    poses = target.copy()
    poses[:, :3, :3] = Rotation.random(12, random_state=0).as_matrix()
    assert align_poses(poses, target) is None


def test_right_poses_are_left_as_they_are_and_measured_once(capture, tmp_path, monkeypatch):
    found = verify_poses(capture, cache=tmp_path)
    assert found.dataset is capture and found.outcome == "kept"
    assert found.before.median < 0.5
    assert describe(found)[0] == f"poses: {found.before}"
    monkeypatch.setattr(pose_verification, "match_photos", None)  # cannot be called
    again = verify_poses(capture, cache=tmp_path)
    assert again.dataset is capture and (again.before, again.outcome) == (found.before, "kept")


@pytest.mark.nightly
def test_perturbed_poses_are_adjusted_in_their_world_and_kept_for_next_time(capture, tmp_path, monkeypatch):
    wrong = perturbed(capture)
    found = verify_poses(wrong, cache=tmp_path)
    assert found.outcome == "adjusted" and found.aligned and found.before.is_wrong
    assert found.after.median < 0.5
    # The truth, up to a similarity: a tenth of the noise that was added.
    turn, offset = disagreement(found.dataset, capture)
    assert turn < 0.3 and offset < 0.02
    # The given world, up to the mean of the noise: 1 degree over the root of the number of photos, twice.
    given = np.stack([view.camera.c2w[:3, :3] for view in sorted_views(capture)])
    now = np.stack([view.camera.c2w[:3, :3] for view in sorted_views(found.dataset)])
    assert np.degrees(Rotation.from_matrix(now.transpose(0, 2, 1) @ given).magnitude()).max() < 2 / COUNT**0.5
    focals = {round(view.camera.fx, 6) for view in sorted_views(found.dataset)}
    assert len(focals) == 1 and focals.pop() == pytest.approx(capture.train[0].camera.fx, rel=0.02)
    assert len(found.dataset.points) > 100 and [v.name for v in found.dataset.test] == [
        v.name for v in capture.test
    ]
    assert verify_poses(wrong, correct=False, cache=tmp_path).before == found.before
    monkeypatch.setattr(pose_verification, "match_photos", None)  # cannot be called
    again = verify_poses(wrong, cache=tmp_path)
    assert [v.camera for v in again.dataset.train] == [v.camera for v in found.dataset.train]
    assert (again.before, again.after, again.fold) == (found.before, found.after, found.fold)
    (file,) = tmp_path.glob("*.json")
    file.write_text(file.read_text()[:100])
    with pytest.raises(TypeError):
        verify_poses(wrong, cache=tmp_path)


@pytest.mark.nightly
def test_poses_of_other_photos_are_found_anew(large_capture):
    order = np.random.default_rng(2).permutation(len(large_capture.train))
    cameras = [large_capture.train[n].camera for n in order]
    mixed = [replace(view, camera=camera) for view, camera in zip(large_capture.train, cameras, strict=True)]
    found = verify_poses(replace(large_capture, train=tuple(mixed)))
    assert found.outcome == "rebuilt" and found.after.median < 0.5
    turn, offset = disagreement(found.dataset, large_capture)
    # Of 480x360 pixels, .1 degrees each: noise of features bends the arc of cameras by some pixels.
    assert turn < 0.6 and offset < 0.04


def test_wrong_poses_are_measured_and_kept_where_that_is_asked_for(capture, tmp_path):
    wrong = perturbed(capture)
    found = verify_poses(wrong, correct=False, cache=tmp_path)
    assert found.dataset is wrong and found.before.is_wrong and found.outcome == "kept"


def test_photos_without_texture_are_not_measured(capture, tmp_path):
    from PIL import Image

    views = []
    for view in capture.train:
        Image.new("RGB", (WIDTH, HEIGHT), (90, 90, 90)).save(tmp_path / view.name.replace("/", "-"))
        views.append(replace(view, image_path=tmp_path / view.name.replace("/", "-")))
    found = verify_poses(replace(capture, train=tuple(views), test=()))
    assert found.outcome == "unmeasured" and found.before is None
    assert "not measured" in describe(found)[0]


def test_photos_of_one_size_share_a_camera_unless_the_file_groups_them():
    base = Camera.look_at((0, -4, 0), (0, 0, 0), width=64, height=48, fov_x=1.0)
    own = [replace(base, fx=base.fx + n) for n in range(6)]
    assert camera_groups(own) == [0] * 6
    assert camera_groups([*own[:2]] * 3) == [0, 1] * 3
    tall = Camera.look_at((0, -4, 0), (0, 0, 0), width=48, height=64, fov_x=1.0)
    assert camera_groups([*own, tall, tall]) == [0] * 6 + [1] * 2
    assert focal_spread([base] * 6) == 0.0
    low, high = np.quantile([camera.fx for camera in own], (0.1, 0.9))
    assert focal_spread(own) == pytest.approx((high - low) / np.median([camera.fx for camera in own]))


def test_scattered_focals_of_one_lens_are_shared_only_where_that_fits_as_well():
    right = PoseError(0.4, 0.6, 20, 40, 800, ("a", 0.7), focal_spread=0.2)
    assert right.has_scattered_focals and not right.is_wrong
    assert pose_verification._is_better(right, replace(right, median=0.45, focal_spread=0.0), None)
    assert not pose_verification._is_better(right, replace(right, median=0.7, focal_spread=0.0), None)
    wrong = replace(right, median=5.0, capped=5.0)
    assert pose_verification._is_better(wrong, replace(right, median=3.0, capped=3.0), None)
    assert not pose_verification._is_better(wrong, replace(right, median=4.0, capped=4.0), None)


@pytest.mark.nightly
def test_a_camera_for_each_photo_of_one_lens_becomes_one_camera(large_capture):
    """Focal lengths from .7 to 1.4 of the lens's, and distances that make up for them, as COLMAP has them."""
    rng = np.random.default_rng(5)

    def zoomed(view):
        scale = float(np.exp(rng.uniform(-0.35, 0.35)))
        c2w = view.camera.c2w.copy()
        c2w[:3, 3] *= scale  # the cameras look at the origin
        camera = replace(view.camera, c2w=c2w, fx=view.camera.fx * scale, fy=view.camera.fy * scale)
        return replace(view, camera=camera)

    given = replace(
        large_capture,
        train=tuple(map(zoomed, large_capture.train)),
        test=tuple(map(zoomed, large_capture.test)),
    )
    found = verify_poses(given)
    assert found.before.has_scattered_focals and found.outcome in ("adjusted", "rebuilt")
    assert found.after.median < 0.5
    focals = {round(view.camera.fx, 6) for view in sorted_views(found.dataset)}
    assert len(focals) == 1 and focals.pop() == pytest.approx(large_capture.train[0].camera.fx, rel=0.03)
    turn, offset = disagreement(found.dataset, large_capture)
    assert turn < 0.6 and offset < 0.04


def test_names_are_in_the_order_of_their_numbers():
    assert sorted(["a10b2", "a9", "a10b10", "b1", "a"], key=natural_key) == [
        "a",
        "a9",
        "a10b2",
        "a10b10",
        "b1",
    ]


def test_masked_features_do_not_count(capture, tmp_path):
    from PIL import Image

    from cagefield.datasets.views import PhotoMask

    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[:, : WIDTH // 2] = 255
    Image.fromarray(mask).save(tmp_path / "mask.png")
    views = [replace(view, mask=PhotoMask(tmp_path / "mask.png")) for view in sorted_views(capture)]
    matches = match_photos(views)
    assert matches.pairs and all(p[:, 0].max() < WIDTH // 2 + 1 for pair in matches.pixels for p in pair)
    assert pose_error(matches, views).median < 0.5


def test_a_written_data_set_is_read_back(capture, tmp_path):
    write_transforms(capture, tmp_path / "out")
    found = load_dataset(tmp_path / "out", downscale=1)
    assert [view.name for view in found.test] == [f"images/{view.name}" for view in capture.test]
    for one, other in zip(sorted_views(found), sorted_views(capture), strict=True):
        np.testing.assert_allclose(one.camera.c2w, other.camera.c2w, atol=1e-12)
        assert one.camera.fx == pytest.approx(other.camera.fx) and one.camera.model == other.camera.model
        np.testing.assert_allclose(one.camera.distortion[:4], other.camera.distortion[:4])
        np.testing.assert_array_equal(one.load(), other.load())
