"""Conventions of other libraries: OpenCV cameras, SciPy rotations, splats of gsplat."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cagefield
from cagefield import Cage, Camera, SplatField
from cagefield.edits.operations import Rotate
from cagefield.errors import CagefieldError, CameraError, FieldError


def random_viewmat(rng: np.random.Generator) -> np.ndarray:
    viewmat = np.eye(4)
    viewmat[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    viewmat[:3, 3] = rng.normal(size=3)
    return viewmat


def test_opencv_matrices_come_back_and_project_as_their_formula() -> None:
    """x = K (R p + t) / z, the pinhole model of OpenCV, COLMAP and gsplat."""
    rng = np.random.default_rng(0)
    K = np.array([[410.0, 0.0, 300.5], [0.0, 405.0, 201.25], [0.0, 0.0, 1.0]])
    for _ in range(20):
        viewmat = random_viewmat(rng)
        camera = Camera.from_opencv(viewmat, K, 640, 400)
        # Rounding of one product of rotations.
        np.testing.assert_allclose(camera.viewmat, viewmat, atol=1e-14)
        np.testing.assert_array_equal(camera.K, K)
        in_camera = rng.uniform((-1, -1, 2), (1, 1, 5), (50, 3))
        world = (in_camera - viewmat[:3, 3]) @ viewmat[:3, :3]
        pixels, depths = camera.project(world)
        image = in_camera @ K.T
        np.testing.assert_allclose(pixels, image[:, :2] / image[:, 2:], atol=1e-9)
        np.testing.assert_allclose(depths, in_camera[:, 2], atol=1e-12)


def test_lens_coefficients_go_along() -> None:
    camera = Camera.from_opencv(
        np.eye(4), np.diag((400.0, 400.0, 1.0)), 64, 48, model="opencv_fisheye", distortion=(0.1, 0, 0, 0)
    )
    assert (camera.model, camera.distortion) == ("opencv_fisheye", (0.1, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("viewmat", "K", "message"),
    [
        (np.eye(3), np.eye(3), r"viewmat must have the shape \[4,4\], got \[3, 3\]"),
        (np.eye(4), np.eye(4), r"K must have the shape \[3,3\], got \[4, 4\]"),
        (np.eye(4), np.array([[1.0, 0.2, 0], [0, 1, 0], [0, 0, 1]]), "skew is not supported"),
        (np.diag((2.0, 1, 1, 1)), np.eye(3), "rigid|rotation|orthonormal"),
        (np.full((4, 4), np.nan), np.eye(3), "finite"),
    ],
)
def test_wrong_matrices_are_refused(viewmat: np.ndarray, K: np.ndarray, message: str) -> None:
    with pytest.raises(CameraError, match=message):
        Camera.from_opencv(viewmat, K, 64, 48)


def test_rotations_of_scipy_turn_as_their_angles() -> None:
    cage = Cage.box((0.2, 0.1, 0.3), (1.0, 0.5, 0.7), (0.1, 0.2, 0.3))
    rng = np.random.default_rng(1)
    for axes in ("world", "cage"):
        angles = rng.uniform(-1.0, 1.0, 3)
        rotation = Rotation.from_euler("XYZ", angles)
        by_angles, by_rotation = cage.rotate(angles, axes=axes), cage.rotate(rotation, axes=axes)
        np.testing.assert_allclose(by_rotation.corners, by_angles.corners, atol=1e-14)
        operation = Rotate.from_rotation(rotation, axes)
        np.testing.assert_allclose(operation.apply(cage).corners, by_angles.corners, atol=1e-14)
    assert Rotate.from_rotation(Rotation.from_euler("x", 30, degrees=True)).degrees == pytest.approx(
        (30, 0, 0)
    )
    assert Rotate.from_rotation((math.radians(30.0), 0.0, 0.0)).degrees == (30.0, 0.0, 0.0)


def test_a_stack_of_rotations_is_refused() -> None:
    with pytest.raises(CagefieldError, match="rotate"):
        Cage.box((0, 0, 0), 1.0).rotate(Rotation.random(2, random_state=0))


def test_splats_of_gsplat_have_its_widths() -> None:
    rng = np.random.default_rng(2)
    scales = rng.uniform(0.01, 0.1, (5, 3)).astype(np.float32)
    field = SplatField.from_gsplat(
        rng.normal(size=(5, 3)),
        rng.normal(size=(5, 4)),
        scales,
        rng.uniform(0, 1, 5),
        rng.normal(size=(5, 4, 3)),
    )
    np.testing.assert_allclose(field.scales, scales, rtol=1e-6)  # exp of a float32 logarithm
    assert field.sh_degree == 1
    with pytest.raises(FieldError, match="apply exp to gsplat's trained parameters"):
        SplatField.from_gsplat(
            np.zeros((1, 3)), np.ones((1, 4)), -np.ones((1, 3)), np.ones(1), np.ones((1, 1, 3))
        )


def test_names_that_users_of_other_programs_look_for() -> None:
    names = [
        "SplatRenderer",
        "CameraPath",
        "read_splats",
        "write_splats",
        "train_splat",
        "train_voxel",
    ]
    assert set(names) <= set(dir(cagefield))
