"""Poses that are refined while splats are trained: their gradient, and photos whose poses are rough."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from cagefield.scene.scene import Scene
from cagefield.training.splats.pose_optimization import PoseRefinement, move_camera, pose_sums
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.train_splats import train_splat
from splat_captures import around, as_dataset, painted_ball, photos_of, points_near, write_views
from splat_gradients import analytic, pictures, rounded, settled
from splat_views import camera, parameters


@pytest.mark.parametrize("antialiased", [False, True])
def test_a_pose_s_gradient_is_that_of_finite_differences(antialiased):
    view = camera()
    values = settled(rounded(parameters(12, 0)), view, antialiased)
    background = np.array([0.2, 0.5, 0.7])
    target = np.random.default_rng(4).uniform(0, 1, (view.height, view.width, 3))
    gradients, curvatures, order = analytic(values, view, target, background, antialiased)
    state = SplatState.new(values["means"], np.ones(12), np.full((12, 3), 0.5, np.float32), 0.5, 0)
    state.quaternions[:] = values["quaternions"]
    state.gradients[:], state.curvatures[:] = gradients, curvatures
    got, curvature = pose_sums(view.origin, state, order)

    def loss(motion):
        picture = pictures(move_camera(view, motion), background, antialiased)(values)
        return 0.5 * ((picture - target) ** 2).sum()

    step = 1e-6
    want = [(loss(step * unit) - loss(-step * unit)) / (2 * step) for unit in np.eye(6)]
    np.testing.assert_allclose(got, want, atol=0.02 * np.abs(want).max())
    assert (np.linalg.eigvalsh(curvature) > -1e-3 * np.trace(curvature)).all()


def test_a_camera_is_moved_in_the_world_s_axes():
    view = camera()
    turned = move_camera(view, np.array([0.1, -0.2, 0.3, 0, 0, np.pi / 2]))
    np.testing.assert_allclose(turned.origin, view.origin + np.array([0.1, -0.2, 0.3]), atol=1e-12)
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned.c2w[:3, :3], quarter @ view.c2w[:3, :3], atol=1e-12)


def test_the_mean_motion_is_taken_out():
    poses = PoseRefinement(3, 1.0)
    poses.motions[:] = np.arange(18).reshape(3, 6)
    poses.remove_mean_motion()
    np.testing.assert_array_equal(poses.motions.mean(axis=0), 0)
    np.testing.assert_array_equal(poses.motions[2] - poses.motions[0], np.full(6, 12))


@pytest.fixture(scope="module")
def rough(tmp_path_factory):
    """Photos of the ball with poses off by 0.6 degrees or so, and the true cameras."""
    ball, folder = painted_ball(), tmp_path_factory.mktemp("rough")
    cameras, held_out = [*around(16, 0.3), *around(8, -0.4)], around(4, 0.6)
    chance = np.random.default_rng(2)
    photos = write_views(folder / "train", cameras, photos_of(ball, cameras))
    off = [
        replace(
            view, camera=move_camera(view.camera, 0.01 * chance.normal(size=6) * [1, 1, 1, 0.5, 0.5, 0.5])
        )
        for view in photos
    ]
    test = write_views(folder / "test", held_out, photos_of(ball, held_out))
    return as_dataset(folder, tuple(off), test, points_near(ball)), cameras


def test_rough_poses_are_refined(rough):
    dataset, cameras = rough
    config = SplatConfig(steps=400, splats=600, sh_degree=1)
    as_given = train_splat(dataset, config)
    refined = train_splat(dataset, replace(config, refine_poses=True))
    assert refined.train_psnr > as_given.train_psnr + 2
    assert refined.test_psnr > as_given.test_psnr + 1

    def off(those):
        """How far pixels in the middle of the photos are off, without what all photos share."""
        center = np.zeros((1, 3))
        apart = [
            one.project(center)[0][0] - true.project(center)[0][0]
            for one, true in zip(those, cameras, strict=True)
        ]
        return float(np.sqrt((np.array(apart) ** 2).sum(axis=1).mean()))

    assert off(refined.cameras) < 0.6 * off(as_given.cameras)
    assert [one.c2w.tolist() for one in as_given.cameras] == [v.camera.c2w.tolist() for v in dataset.train]
    scene = Scene.trained(refined, dataset)
    assert [one.c2w.tolist() for one in scene.cameras["train"]] == [
        one.c2w.tolist() for one in refined.cameras
    ]


@pytest.mark.nightly
def test_refined_poses_go_on_where_a_run_was_interrupted(rough, tmp_path):
    dataset, _ = rough
    config = SplatConfig(steps=120, splats=400, sh_degree=1, refine_poses=True)
    whole = train_splat(dataset, config, evaluate=False)
    assert np.abs(whole.cameras[0].c2w - dataset.train[0].camera.c2w).max() > 1e-4
    checkpoint = tmp_path / "run"

    def press_ctrl_c(progress):
        if progress.step == 70:
            os.kill(os.getpid(), signal.SIGINT)

    first = train_splat(dataset, config, checkpoint=checkpoint, on_progress=press_ctrl_c, evaluate=False)
    assert not first.finished
    second = train_splat(dataset, config, checkpoint=checkpoint, resume=True, evaluate=False)
    for one, other in zip(second.cameras, whole.cameras, strict=True):
        np.testing.assert_array_equal(one.c2w, other.c2w)
