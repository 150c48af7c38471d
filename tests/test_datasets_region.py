"""Cube of interest and levelling: captures whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.datasets.scene_bounds import cube_of_interest, focus_point, leveling_rotation
from posed_photos import ring


def _cameras(poses) -> list[Camera]:
    return [Camera.from_fov(pose, 40, 30, 1.0) for pose in poses]


def _moved(poses, offset) -> list[np.ndarray]:
    return [pose + np.pad(np.array(offset)[:, None], ((0, 1), (3, 0))) for pose in poses]


def _facing(n: int, baseline: float, toe_in: float = 0.0) -> list[np.ndarray]:
    """Cameras side by side that look along +y, each turned inwards by up to `toe_in` radians."""
    rng = np.random.default_rng(2)
    poses = []
    for s in np.linspace(-1, 1, n):
        pose = np.eye(4)
        turn = Rotation.from_euler("z", toe_in * s).as_matrix()
        pose[:3, :3] = turn @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
        pose[:3, 3] = (baseline * s, 0, baseline * rng.uniform(-1, 1))
        poses.append(pose)
    return poses


def test_focus_of_a_ring_and_its_cube():
    cameras = _cameras(_moved(ring(12), (3.0, -1.0, 0.5)))
    cube = cube_of_interest(cameras)
    half = 0.7 * 4 * np.sqrt(1.25)
    np.testing.assert_allclose(cube.mean(axis=0), (3, -1, 0.5), atol=1e-9)
    np.testing.assert_allclose(cube[1] - cube[0], 2 * half, rtol=1e-9)


def test_focus_ignores_stray_cameras():
    poses = ring(12)
    for pose in poses[:2]:  # two cameras look away
        pose[:3, :3] = Rotation.from_euler("z", 1.2).as_matrix() @ pose[:3, :3]
    cameras = _cameras(poses)
    origins, directions = np.array([c.origin for c in cameras]), np.array([c.forward for c in cameras])
    point, _ = focus_point(origins, directions)
    normal = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    plain = np.linalg.solve(normal.sum(axis=0), np.einsum("nij,nj->i", normal, origins))
    assert np.linalg.norm(plain) > 0.3  # least squares alone is pulled away
    assert np.linalg.norm(point) < 0.01


def test_conditioning_is_the_mean_square_sine():
    angles = np.array([-0.3, 0.3])
    directions = np.stack([np.sin(angles), np.cos(angles), [0, 0]], axis=1)
    _, conditioning = focus_point(np.array([[1.0, 0, 0], [-1.0, 0, 0]]), directions)
    assert conditioning == pytest.approx(np.sin(0.3) ** 2)


def test_sparse_points_tighten_the_cube():
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (2000, 3))
    cube = cube_of_interest(_cameras(ring(12)), points=points)
    np.testing.assert_allclose(cube, [[-0.5] * 3, [0.5] * 3], atol=0.02)
    far = np.random.default_rng(0).uniform(-50, 50, (2000, 3))  # a background far away does not widen it
    half = 0.7 * 4 * np.sqrt(1.25)
    np.testing.assert_allclose(cube_of_interest(_cameras(ring(12)), points=far)[1], half, atol=1e-6)


def test_forward_facing_capture_uses_depths():
    cameras = _cameras(_facing(9, 0.3, toe_in=0.05))
    cube = cube_of_interest(cameras, np.tile([2.0, 4.0], (9, 1)))
    # center at depth 3; the picture is 3 tan(0.5) = 1.64 to each side there, wider than the depth range's 1
    np.testing.assert_allclose(cube.mean(axis=0), (0, 3, cube.mean(axis=0)[2]), atol=0.05)
    np.testing.assert_allclose(cube[1] - cube[0], 2 * 3 * np.tan(0.5), rtol=1e-6)
    deep = cube_of_interest(
        cameras, np.tile([2.0, 400.0], (9, 1))
    )  # no farther than three times the near depth
    np.testing.assert_allclose(
        (deep[0, 1], deep[1, 1]), (4 - 4 * np.tan(0.5), 4 + 4 * np.tan(0.5)), atol=0.01
    )


def test_forward_facing_capture_takes_depths_from_points():
    cameras = _cameras(_facing(9, 0.1))
    rng = np.random.default_rng(1)
    depth = rng.uniform(5.0, 10.0, 3000)
    points = np.stack(
        [rng.uniform(-0.3, 0.3, 3000) * depth, depth, rng.uniform(-0.2, 0.2, 3000) * depth], axis=1
    )
    cube = cube_of_interest(cameras, points=points)
    assert cube.mean(axis=0)[1] == pytest.approx(7.5, abs=0.2)


def test_parallel_cameras_without_depths_look_at_something():
    cube = cube_of_interest(_cameras(_facing(9, 1.0)))
    assert np.isfinite(cube).all()
    assert cube.mean(axis=0)[1] > 0 and cube[1, 1] - cube[0, 1] > 1
    assert np.isfinite(cube_of_interest(_cameras(_facing(1, 0.0)))).all()


def test_cameras_that_look_outwards_are_surrounded():
    poses = ring(12, radius=0.5)
    for pose in poses:
        pose[:3, :3] = Rotation.from_euler("z", np.pi).as_matrix() @ pose[:3, :3]
    cube = cube_of_interest(_cameras(poses))
    origins = np.array([pose[:3, 3] for pose in poses])
    assert np.all((origins > cube[0]) & (origins < cube[1]))
    np.testing.assert_allclose(cube.mean(axis=0), origins.mean(axis=0), atol=1e-9)


@pytest.mark.parametrize("sweep", [2 * np.pi, np.pi / 2])
def test_levelling_finds_up_from_level_cameras(sweep):
    tilt = Rotation.from_euler("XYZ", (0.7, -0.4, 1.1)).as_matrix()
    poses = np.array(ring(16, sweep=sweep))
    poses[:, :3] = tilt @ poses[:, :3]
    rotation = leveling_rotation(poses)
    # cameras without roll determine it exactly, even over a quarter of a circle from above
    np.testing.assert_allclose(rotation @ tilt @ (0, 0, 1), (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)


def test_levelling_of_hand_held_forward_facing_cameras_takes_the_mean_up():
    rng = np.random.default_rng(10)
    poses = np.array(_facing(40, 0.3))
    poses[:, :3, :3] = poses[:, :3, :3] @ Rotation.from_rotvec(rng.normal(0, 0.05, (40, 3))).as_matrix()
    # right axes leave what is across them open (53 degrees off here); 40 ups average to 0.05 / sqrt(40)
    np.testing.assert_allclose(leveling_rotation(poses) @ (0, 0, 1), (0, 0, 1), atol=0.03)


def test_levelling_of_a_forward_facing_capture():
    tilt = Rotation.from_euler("XYZ", (0.7, -0.4, 1.1)).as_matrix()
    poses = np.array(_facing(9, 0.3, toe_in=0.05))
    poses[:, :3] = tilt @ poses[:, :3]
    levelled = leveling_rotation(poses) @ poses[:, :3, :3]
    np.testing.assert_allclose(levelled[:, :, 1].mean(axis=0), (0, 0, 1), atol=1e-6)
    ahead = -levelled[:, :, 2].mean(axis=0)
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), (0, 1, 0), atol=1e-6)
