"""Free space around cameras: what stands in it goes, walls and the scene stay."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.training.splats.free_space import BALL_SHARE, SURFACE_SHARE, FreeSpace
from cagefield.training.splats.splat_state import SplatState


def splats(positions, sigma=0.01) -> SplatState:
    positions = np.asarray(positions, np.float64).reshape(-1, 3)
    count = len(positions)
    return SplatState.new(positions, np.full(count, sigma), np.full((count, 3), 0.5, np.float32), 0.5, 0)


def camera(origin) -> Camera:
    return Camera.look_at(origin, (0, 0, 0), width=64, height=48, fov_x=1.0)


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e4])
def test_the_ball_around_a_camera_is_free_in_every_direction(unit):
    free = FreeSpace([camera((0, -4 * unit, 0))], [2.0 * unit], np.zeros((0, 3)))
    inside = 0.99 * BALL_SHARE * 2.0
    offsets = np.concatenate([np.eye(3), -np.eye(3)])
    near = splats(unit * (inside * offsets + (0, -4, 0)), 1e-3 * unit)
    far = splats(unit * (1.01 / 0.99 * inside * offsets + (0, -4, 0)), 1e-3 * unit)
    assert free.occupied_mask(near).all() and not free.occupied_mask(far).any()


def test_a_wall_close_behind_the_camera_stays():
    rng = np.random.default_rng(0)
    wall = np.stack([rng.uniform(-2, 2, 400), np.full(400, -4.5), rng.uniform(-2, 2, 400)], axis=1)
    free = FreeSpace([camera((0, -4, 0))], [2.0], wall)
    assert not free.occupied_mask(splats(wall)).any()
    # Between the camera and the wall it is free nevertheless, and so is the space before the camera.
    assert free.occupied_mask(splats([(0, -4 - 0.9 * SURFACE_SHARE * 0.5, 0), (0, -3.2, 0)])).all()


def test_an_ellipsoid_with_a_camera_in_it_goes():
    free = FreeSpace([camera((0, -4, 0))], [0.1], np.zeros((0, 3)))
    state = splats([(0, -1, 0), (0, -1, 0)], 0.3)
    state.log_scales[0, 1] = np.log(1.1)  # 3 sigmas are 3.3, the camera is 3 away along y
    assert free.occupied_mask(state).tolist() == [True, False]


def test_space_between_neighboring_cameras_is_free():
    cameras = [camera((-1.0, -4, 0)), camera((1.0, -4, 0))]
    free = FreeSpace(cameras, [2.5, 2.2], np.zeros((0, 3)))
    assert len(free.centers) > 2 and free.occupied_mask(splats([(0, -4, 0)])).all()


def test_cameras_of_unknown_depth_have_no_free_space():
    free = FreeSpace([camera((0, -4, 0))], [None], np.zeros((0, 3)))
    assert not free.occupied_mask(splats([(0, -4, 0)])).any()
