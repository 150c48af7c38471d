"""Optimization of the photos' camera poses during the training of splats.

A camera that moves by (t, w), its origin o by t and its axes by the small rotation w about o (world axes),
sees the
image of splats moved the other way: a splat at o + d moves by -t + d x w. The camera's gradient and
Gauss-Newton curvature are therefore sums over those of the splats (`kernels.splat_backward`). The splats'
curvatures majorize the sum of overlapping ones, so the camera's sum is above the curvature of a joint motion,
and a step falls short rather than overshoots.

A common motion of all cameras and the scene changes no image: the mean motion is removed, so that held-out
photos still fit.

Source: derived here; poses optimized with the field as in Lin et al., "BARF" (2021).
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.training.splats.splat_state import SplatState
from cagefield.typing import Array

POSE_START_PROGRESS = 0.1
"""Progress from which poses are optimized; earlier the splats are too coarse."""

MAX_POSE_STEP = 2e-3
"""Maximum step of a rotation in radians, and of an origin in units of the scene's depth."""

OVERRELAXATION = 4.0
"""Step length, in multiples of the step of the majorized curvature."""

RELATIVE_DAMPING = 0.1
"""Levenberg-Marquardt damping, relative to the mean curvature."""


class PoseRefinement:
    """Motion of each photo's camera: `motions` [V,6] (t in world units, w in radians).

    `depth` is the scene's median depth, in world units.
    """

    def __init__(self, photos: int, depth: float) -> None:
        self.motions: Array = np.zeros((photos, 6))
        self._depth = depth

    def camera(self, index: int, camera: Camera) -> Camera:
        """Moved camera of a photo, at any image size."""
        return move_camera(camera, self.motions[index])

    def step(self, index: int, gradient: Array, curvature: Array, rate: float) -> None:
        """Move a photo's camera by the (gradient [6], curvature [6,6]) of its motion; see `pose_sums`."""
        units = np.repeat([self._depth, 1.0], 3)
        gradient, curvature = gradient * units, curvature * units * units[:, None]
        damped = curvature + (RELATIVE_DAMPING * np.trace(curvature) / 6.0 + 1e-12) * np.eye(6)
        step = -OVERRELAXATION * rate * np.linalg.solve(damped, gradient)
        self.motions[index] += units * np.clip(step, -MAX_POSE_STEP, MAX_POSE_STEP)

    def remove_mean_motion(self) -> None:
        """Subtract the mean motion."""
        self.motions -= self.motions.mean(axis=0)


def pose_sums(origin: Array, state: SplatState, visible: NDArray[np.int64]) -> tuple[Array, Array]:
    """(gradient [6], curvature [6,6]) of a camera's motion (t, w), summed over its visible splats."""
    d = state.means[visible].astype(np.float64) - origin
    g = state.gradients[visible].astype(np.float64)
    rotations = rotation_matrices(state.quaternions[visible].astype(np.float64)) @ g[:, 6:9, None]
    gradient = -np.concatenate(
        [g[:, :3].sum(axis=0), (np.cross(d, g[:, :3]) + rotations[..., 0]).sum(axis=0)]
    )
    h = state.curvatures[visible][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].astype(np.float64).reshape(-1, 3, 3)
    zero = np.zeros(len(d))
    crossed = np.stack(
        [zero, -d[:, 2], d[:, 1], d[:, 2], zero, -d[:, 0], -d[:, 1], d[:, 0], zero], axis=1
    ).reshape(-1, 3, 3)
    motion = np.concatenate([np.broadcast_to(-np.eye(3), crossed.shape), crossed], axis=2)
    return gradient, np.einsum("nia,nij,njb->ab", motion, h, motion, optimize=True)


def move_camera(camera: Camera, motion: Array) -> Camera:
    """Camera moved by (t, w) [6]."""
    from scipy.spatial.transform import Rotation

    c2w = camera.c2w.copy()
    c2w[:3, :3] = Rotation.from_rotvec(motion[3:]).as_matrix() @ c2w[:3, :3]
    c2w[:3, 3] += motion[:3]
    return dataclasses.replace(camera, c2w=c2w)
