"""Features on things that move between photos: told by their matches, removed; a repeated side is none."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.datasets.sfm import features, structure_from_motion
from cagefield.datasets.sfm.moving_features import (
    MIN_MOVING_PHOTOS,
    MIN_STATIC_MATCHES,
    MatchedFeatures,
    capped_error,
    moving_features,
    read_features,
    remove_features,
)
from cagefield.datasets.sfm.registration_report import Matches

PHOTOS, OBJECT, BACKDROP = 12, 60, 150
MOVED_FROM = 6
"""The backdrop moves between the photos of numbers 5 and 6."""


def _cameras(sweep: float = 1.2) -> dict[int, Camera]:
    angles = np.linspace(-0.5 * sweep, 0.5 * sweep, PHOTOS)
    return {
        n: Camera.look_at((4 * np.sin(a), -4 * np.cos(a), 0.6), (0, 0, 0), width=400, height=300, fov_x=1.0)
        for n, a in enumerate(angles)
    }


def _scene(moves: bool, cameras: dict[int, Camera], pairs: list[tuple[int, int]]) -> MatchedFeatures:
    """An object before a backdrop; matches of everything, as a matcher finds them that knows no poses."""
    rng = np.random.default_rng(0)
    thing = rng.uniform(-0.6, 0.6, (OBJECT, 3)) * (1, 0.3, 1)
    backdrop = np.stack(
        [rng.uniform(-1.5, 1.5, BACKDROP), np.full(BACKDROP, 1.5), rng.uniform(0.7, 1.6, BACKDROP)], axis=1
    )
    keypoints = []
    for n, camera in cameras.items():
        turned = Rotation.from_rotvec((0.0, 0.3, 0.1)).as_matrix() if moves and n >= MOVED_FROM else np.eye(3)
        points = np.concatenate([thing, backdrop @ turned.T])
        keypoints.append(camera.project(points)[0] + rng.normal(0.0, 0.2, (len(points), 2)))
    rows = np.repeat(np.arange(OBJECT + BACKDROP)[:, None], 2, axis=1)
    return MatchedFeatures(keypoints, dict.fromkeys(pairs, rows))


def _near(step: int = 3) -> list[tuple[int, int]]:
    return [(i, i + k) for i in range(PHOTOS) for k in range(1, step + 1) if i + k < PHOTOS]


def test_a_backdrop_that_moved_is_told_from_the_object_before_it():
    cameras = _cameras()
    moving, photos = moving_features(_scene(True, cameras, _near()), cameras)
    assert set(photos) >= {MOVED_FROM - 2, MOVED_FROM - 1, MOVED_FROM, MOVED_FROM + 1}
    assert len(photos) >= MIN_MOVING_PHOTOS and 0 not in photos and PHOTOS - 1 not in photos
    for n in (MOVED_FROM - 1, MOVED_FROM):
        assert moving[n][OBJECT:].mean() > 0.9, "the backdrop"
        assert moving[n][:OBJECT].mean() < 0.15, "the object"


def test_nothing_moves_in_a_capture_that_stands_still():
    cameras = _cameras()
    moving, photos = moving_features(_scene(False, cameras, _near()), cameras)
    assert photos == [] and np.mean(np.concatenate(moving)) < 0.01


def test_matches_of_two_sides_that_look_alike_do_not_count():
    """A can's front and back: their matches contradict right poses, and nothing moves."""
    cameras = _cameras()
    turned = {
        n: camera.with_c2w(
            np.block(
                [
                    [Rotation.from_rotvec((0, 0, np.pi)).as_matrix(), np.zeros((3, 1))],
                    [np.zeros((1, 3)), np.ones((1, 1))],
                ]
            )
            @ camera.c2w
        )
        for n, camera in cameras.items()
        if n % 2
    }
    far = [(i, j) for i in range(0, PHOTOS, 2) for j in range(1, PHOTOS, 2)]
    found = _scene(False, cameras, far)
    assert moving_features(found, cameras | turned)[1] == []


def _without(scene: MatchedFeatures, moving: list[NDArray[np.bool_]]) -> MatchedFeatures:
    matches = {
        (i, j): rows[~(moving[i][rows[:, 0]] | moving[j][rows[:, 1]])]
        for (i, j), rows in scene.matches.items()
    }
    return MatchedFeatures(scene.keypoints, matches)


def test_the_error_of_what_stands_still_is_that_of_the_pixels():
    cameras = _cameras()
    scene = _scene(True, cameras, _near())
    moving, _ = moving_features(scene, cameras)
    still, everything = capped_error(_without(scene, moving), cameras), capped_error(scene, cameras)
    assert still < 0.3 / 400 < 2 * everything


@pytest.fixture
def database(tmp_path):
    """A COLMAP database of three photos; the first two features of each are on something that moves."""
    pycolmap = features.import_pycolmap()
    path = tmp_path / "database.db"
    camera = pycolmap.Camera(model="SIMPLE_PINHOLE", width=400, height=300, params=[400, 200, 150])
    features.create_database(path, [camera], [features.Photo(f"{n}.png", 0) for n in range(3)])
    rows = np.repeat(np.arange(MIN_STATIC_MATCHES + 2, dtype=np.uint32)[:, None], 2, axis=1)
    with features.open_database(path) as source:
        for n in range(3):
            keypoints = np.random.default_rng(n).uniform(0, 300, (len(rows), 2)).astype(np.float32)
            source.write_keypoints(n + 1, keypoints)
        for pair, own in (((1, 2), rows), ((2, 3), rows[2:]), ((1, 3), rows[:-1])):
            source.write_matches(*pair, own)
            geometry = pycolmap.TwoViewGeometry()
            geometry.inlier_matches = own
            source.write_two_view_geometry(*pair, geometry)
    return path


def test_matches_of_moving_features_leave_the_database(database):
    moving: list[NDArray[np.bool_]] = [np.arange(MIN_STATIC_MATCHES + 2) < 2 for _ in range(3)]
    assert len(read_features(database, 3).matches) == 3
    assert remove_features(database, moving) == [(0, 1)], "(1, 2) has lost none, (0, 2) has too few left"
    left = read_features(database, 3).matches
    assert list(left) == [(1, 2)] and len(left[1, 2]) == MIN_STATIC_MATCHES
    with features.open_database(database) as source:
        assert np.asarray(source.read_matches(1, 2)).min() == 2 and not source.exists_matches(1, 3)


class _Model:
    def __init__(self, photos: int) -> None:
        self.photos = photos

    def num_reg_images(self) -> int:
        return self.photos


@pytest.mark.parametrize(
    ("placed", "turned", "taken"), [(12, 0.0, True), (11, 0.0, False), (12, 0.02, False)]
)
def test_poses_without_moving_things_are_taken_where_no_photo_is_lost_and_the_rest_agrees_better(
    placed, turned, taken, tmp_path, monkeypatch
):
    """Of the object alone: as many photos and right poses are taken, fewer or worse ones are not."""
    right = _cameras()
    rng = np.random.default_rng(3)

    def noisy(size: float) -> dict[int, Camera]:
        made = {}
        for n, camera in right.items():
            c2w = camera.c2w.copy()
            c2w[:3, :3] = Rotation.from_rotvec(rng.normal(0, size, 3)).as_matrix() @ c2w[:3, :3]
            made[n] = camera.with_c2w(c2w)
        return made

    models = {"plain": _Model(12), "static": _Model(placed)}
    cameras = {id(models["plain"]): noisy(0.001), id(models["static"]): noisy(turned)}
    scene = _scene(True, right, _near())
    (tmp_path / "database.db").write_bytes(b"")
    patches = {
        "build_unambiguous_models": lambda work, *_: ([models["plain"]], work / "database.db"),
        "_cameras": lambda model: cameras[id(model)],
        "match": lambda *_, **options: None,
        "_map": lambda *_, **options: [models["static"]],
    }
    for name, value in patches.items():
        monkeypatch.setattr(structure_from_motion, name, value)
    moving, _ = moving_features(scene, right)
    read = iter([scene, _without(scene, moving)])
    monkeypatch.setattr(structure_from_motion.moving_features, "read_features", lambda *_: next(read))
    monkeypatch.setattr(structure_from_motion.moving_features, "remove_features", lambda *_: [])
    names = [f"{n}.png" for n in range(PHOTOS)]
    counts = np.zeros((PHOTOS, PHOTOS))
    found = structure_from_motion.reconstruct(tmp_path, names, Matches(counts, counts), 0, lambda *_: None)
    assert (found.models == [models["static"]]) == taken and bool(found.moving) == taken
