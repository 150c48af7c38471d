"""Folded poses: a room whose other half lies on this one, and what only looks like it."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.cli import poses as poses_command
from cagefield.datasets import View
from cagefield.datasets.sfm import ambiguity_check
from cagefield.datasets.sfm.pose_refinement import RefinedPoses
from cagefield.datasets.sfm.pose_verification import describe
from cagefield.datasets.views import Dataset
from cagefield.images.image_files import write_png
from cagefield.procedural.textures import noise
from posed_photos import ring

COUNT, WIDTH, HEIGHT = 24, 72, 48


def cameras() -> list[Camera]:
    """Two rounds of a ring, half a step apart, look at the middle from 3 away."""
    return [Camera.from_fov(pose, WIDTH, HEIGHT, 1.0) for pose in ring(COUNT, 3.0)]


def photo(camera: Camera) -> np.ndarray:
    """A room of noise, 10 wide, and in its middle a ball that looks the same from the other side."""
    origins, directions = (np.asarray(part, np.float64) for part in camera.rays())
    with np.errstate(divide="ignore"):
        wall = ((np.where(directions > 0, 5.0, -5.0) - origins) / directions).min(axis=1)
    points = origins + wall[:, None] * directions
    along, off = (origins * directions).sum(axis=1), (origins**2).sum(axis=1) - 0.6**2
    inside = along**2 - off
    ball = np.where(inside > 0, -along - np.sqrt(np.maximum(inside, 0.0)), np.inf)
    hit = origins + np.where(np.isfinite(ball), ball, 0.0)[:, None] * directions
    turned = np.stack([hit[:, 0] ** 2 - hit[:, 1] ** 2, hit[:, 0] * hit[:, 1], hit[:, 2]], axis=1)
    value = 0.5 + 0.15 * np.where(np.isfinite(ball), noise(turned, 0.1), noise(points, 1.0))
    gray = np.rint(255 * np.clip(value, 0, 1)).astype(np.uint8).reshape(HEIGHT, WIDTH, 1)
    return np.repeat(gray, 3, axis=2)


def dataset(folder, poses: list[Camera], photos: list[np.ndarray]) -> Dataset:
    """The capture of these photos with these poses; every 8th held out."""
    folder.mkdir()
    views = []
    for index, (camera, pixels) in enumerate(zip(poses, photos, strict=True)):
        path = folder / f"{index:02}.png"
        write_png(path, pixels)
        views.append(View(path.name, camera, path))
    bounds = np.array([[-2.0] * 3, [2.0] * 3])
    test, train = tuple(views[::8]), tuple(view for i, view in enumerate(views) if i % 8)
    return Dataset("room", folder, train, test, (), True, bounds, False)


@pytest.fixture(scope="module")
def photos():
    return [photo(camera) for camera in cameras()]


def folded() -> list[Camera]:
    """The second half's poses lie between those of the first."""
    right = cameras()
    half = COUNT // 2
    step = 0.5 * (2 * np.pi / COUNT)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(step), -np.sin(step)], [np.sin(step), np.cos(step)]]
    return right[:half] + [camera.with_c2w(turn @ camera.c2w) for camera in right[:half]]


def test_right_poses_are_not_folded(photos, tmp_path):
    assert ambiguity_check.check_ambiguity(dataset(tmp_path / "room", cameras(), photos)) is None


def test_two_sides_that_lie_on_each_other_are_found(photos, tmp_path):
    steps = []
    fold = ambiguity_check.check_ambiguity(
        dataset(tmp_path / "room", folded(), photos), lambda done, note: steps.append((done, note))
    )
    assert fold is not None and fold.compared == COUNT and fold.photos >= COUNT // 2
    first, second = sorted(int(name[:2]) for name in fold.pair)
    assert first < COUNT // 2 <= second and second - first - COUNT // 2 in (-1, 0, 1)
    assert steps[-1][0] == 1.0 and "pairs of photos compared" in steps[-1][1]


def test_one_wrong_pose_blur_and_darkness_are_no_fold(photos, tmp_path):
    poses = cameras()
    poses[5] = poses[17]
    shown = list(photos)
    shown[9] = np.full_like(shown[9], 128)
    shown[13] = (shown[13] * 0.4).astype(np.uint8)
    assert ambiguity_check.check_ambiguity(dataset(tmp_path / "room", poses, shown)) is None


def test_few_photos_and_walls_without_texture_are_no_fold(photos, tmp_path):
    assert ambiguity_check.check_ambiguity(dataset(tmp_path / "two", folded()[:2], photos[:2])) is None
    plain = [np.full_like(pixels, 200) for pixels in photos]
    assert ambiguity_check.check_ambiguity(dataset(tmp_path / "plain", folded(), plain)) is None


def test_photos_that_agree_with_nobody_do_not_count():
    pairs = [(0, 1), (1, 2), (2, 3), (4, 5)]
    alike = np.array([0.9, 0.1, 0.9, 0.1])
    assert ambiguity_check.find_contradicting_photos(pairs, alike, 6) == {1, 2}
    assert ambiguity_check.find_contradicting_photos(pairs, np.full(4, np.nan), 6) == set()


class _Solver:
    """Takes the place of structure from motion: the cameras of a data set."""

    def __init__(self, answer: Dataset) -> None:
        self.answer, self.calls = answer, []

    def __call__(self, views, folder, on_progress, seed):
        self.calls.append([view.name for view in views])
        return self

    def refine(self, *_):
        raise AssertionError("a folded model is not bundle-adjusted")

    def rebuild(self, *_):
        cameras = {view.name: view.camera for view in (*self.answer.train, *self.answer.test)}
        return RefinedPoses(cameras, None, 0.5, True)


@pytest.mark.nightly
def test_training_finds_folded_poses_anew_and_holds_out_the_same_photos(
    photos, tmp_path, monkeypatch, capsys
):
    wrong, right = (
        dataset(tmp_path / "wrong", folded(), photos),
        dataset(tmp_path / "right", cameras(), photos),
    )
    solver = _Solver(right)
    monkeypatch.setattr("cagefield.datasets.sfm.pose_verification.PoseSolver", solver)
    monkeypatch.setattr(
        "cagefield.datasets.sfm.pose_verification.poses_cache_folder", lambda: tmp_path / "cache"
    )
    found = poses_command.verified(wrong).dataset
    said = capsys.readouterr().out
    assert len(solver.calls) == 1 and "poses are folded" in said and "--keep-poses" in said
    assert [view.name for view in found.test] == [view.name for view in wrong.test]
    assert [view.name for view in found.train] == [view.name for view in wrong.train]
    assert found.train[0].camera == right.train[0].camera
    again = poses_command.verified(wrong).dataset
    assert len(solver.calls) == 1 and again.train[0].camera == right.train[0].camera
    assert poses_command.verified(wrong, correct=False).dataset is wrong
    assert poses_command.verified(right).dataset is right and len(solver.calls) == 1


@pytest.mark.nightly
def test_a_fold_that_structure_from_motion_finds_too_is_kept_and_said(photos, tmp_path, monkeypatch, capsys):
    wrong = dataset(tmp_path / "wrong", folded(), photos)
    monkeypatch.setattr("cagefield.datasets.sfm.pose_verification.PoseSolver", _Solver(wrong))
    monkeypatch.setattr(
        "cagefield.datasets.sfm.pose_verification.poses_cache_folder", lambda: tmp_path / "cache"
    )
    assert poses_command.verified(wrong).dataset is wrong
    said = capsys.readouterr().out
    assert "poses look folded" in said and "structure from motion finds the same poses" in said


@pytest.mark.nightly
def test_bundle_adjustment_that_stays_folded_confirms_no_fold(photos, tmp_path, monkeypatch):
    """Rough and folded poses: adjusted ones agree with them and are as folded; new ones are taken."""
    from cagefield.datasets.sfm import pose_verification
    from cagefield.datasets.sfm.epipolar_error import PoseError

    wrong, right = dataset(tmp_path / "a", folded(), photos), dataset(tmp_path / "b", cameras(), photos)
    solver = _Solver(right)
    monkeypatch.setattr(solver.__class__, "refine", lambda *_: _Solver(wrong).rebuild())
    monkeypatch.setattr(pose_verification, "PoseSolver", solver)
    monkeypatch.setattr(pose_verification, "match_photos", lambda *_: None)
    rough, good = (PoseError(m, m, 20, 40, 800, ("a", m), capped=m) for m in (6.0, 0.3))
    errors = iter([rough, good, good])
    monkeypatch.setattr(pose_verification, "pose_error", lambda *_: next(errors))
    found = pose_verification.verify_poses(wrong)
    assert found.outcome == "rebuilt" and not found.same_fold
    assert found.dataset.train[0].camera == right.train[0].camera


def test_poses_without_moving_things_win_though_matches_on_these_contradict_them(
    photos, tmp_path, monkeypatch
):
    from dataclasses import replace as changed

    from cagefield.datasets.sfm import pose_verification
    from cagefield.datasets.sfm.epipolar_error import PoseError

    data = changed(dataset(tmp_path / "a", cameras(), photos), unbounded=False)
    solver = _Solver(data)
    plain = solver.rebuild()
    monkeypatch.setattr(solver.__class__, "refine", lambda *_: plain)
    monkeypatch.setattr(solver.__class__, "rebuild", lambda *_: changed(plain, moving=5))
    monkeypatch.setattr(pose_verification, "PoseSolver", solver)
    monkeypatch.setattr(pose_verification, "match_photos", lambda *_: None)
    rough = PoseError(6.0, 6.0, 20, 40, 800, ("a", 6.0), capped=6.0)
    by_all = PoseError(0.3, 0.4, 20, 40, 800, ("a", 0.3), capped=0.8, contradicted=0.1)
    errors = iter([rough, by_all, changed(by_all, capped=1.0)])
    monkeypatch.setattr(pose_verification, "pose_error", lambda *_: next(errors))
    for _ in range(2):  # found, and read from the cache
        found = pose_verification.verify_poses(data, cache=tmp_path)
        assert found.outcome == "rebuilt" and found.moving == 5
        assert "5 photos show things that move: features on these were left out" in describe(found)
