"""Poses of the photos that are refined while splats are trained on them.

A camera that moves by (t, w), its origin o by t and its axes by the small turn w about o (world axes), shows
what it would of splats moved the other way: of a splat at o + d, by -t + d x w. So its gradient and its
Gauss-Newton curvature are sums over those of the splats (`kernels.splat_chain`). The splats' curvatures
majorise the sum of overlapping ones, hence this sum is above the curvature of all moving at once, and a step
of it falls short rather than overshoots.

All cameras moved alike, with the scene, show the same: the mean motion is taken out, so that photos that are
held out still fit.

Source: derived here; poses refined with the field as in Lin et al., "BARF" (2021).
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.training.splats.splat_state import SplatState
from cagefield.typing import Array

FROM = 0.1
"""Progress from which poses are refined: before, the splats are too coarse to tell."""

CAP = 2e-3
"""Largest step of a turn, in radians, and of an origin, in units of the scene's depth."""

EAGERNESS = 4.0
"""Steps in multiples of what the majorised curvature allows."""

DAMPING = 0.1
"""Of a step, in shares of its mean curvature."""


class PoseRefinement:
    """How far each photo's camera has been moved: `motions` [V,6] (t in world units, w in radians).

    `depth` is the scene's usual depth, in world units.
    """

    def __init__(self, photos: int, depth: float) -> None:
        self.motions: Array = np.zeros((photos, 6))
        self._depth = depth

    def camera(self, index: int, camera: Camera) -> Camera:
        """The camera of a photo, at any size, where it is now."""
        return moved(camera, self.motions[index])

    def step(
        self, index: int, origin: Array, state: SplatState, seen: NDArray[np.int64], rate: float
    ) -> None:
        """Moves a photo's camera, at `origin` now, by the gradients of the splats `seen` in it."""
        gradient, curvature = pose_sums(origin, state, seen)
        units = np.repeat([self._depth, 1.0], 3)
        gradient, curvature = gradient * units, curvature * units * units[:, None]
        damped = curvature + (DAMPING * np.trace(curvature) / 6.0 + 1e-12) * np.eye(6)
        step = -EAGERNESS * rate * np.linalg.solve(damped, gradient)
        self.motions[index] += units * np.clip(step, -CAP, CAP)

    def centre(self) -> None:
        """Takes the mean motion out."""
        self.motions -= self.motions.mean(axis=0)


def pose_sums(origin: Array, state: SplatState, seen: NDArray[np.int64]) -> tuple[Array, Array]:
    """(gradient [6], curvature [6,6]) of a camera's motion (t, w), from those of the splats that it sees."""
    d = state.means[seen].astype(np.float64) - origin
    g = state.gradients[seen].astype(np.float64)
    turns = rotation_matrices(state.quaternions[seen].astype(np.float64)) @ g[:, 6:9, None]
    gradient = -np.concatenate([g[:, :3].sum(axis=0), (np.cross(d, g[:, :3]) + turns[..., 0]).sum(axis=0)])
    h = state.curvatures[seen][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].astype(np.float64).reshape(-1, 3, 3)
    zero = np.zeros(len(d))
    crossed = np.stack(
        [zero, -d[:, 2], d[:, 1], d[:, 2], zero, -d[:, 0], -d[:, 1], d[:, 0], zero], axis=1
    ).reshape(-1, 3, 3)
    motion = np.concatenate([np.broadcast_to(-np.eye(3), crossed.shape), crossed], axis=2)
    return gradient, np.einsum("nia,nij,njb->ab", motion, h, motion, optimize=True)


def moved(camera: Camera, motion: Array) -> Camera:
    """The camera moved by (t, w) [6]."""
    from scipy.spatial.transform import Rotation

    c2w = camera.c2w.copy()
    c2w[:3, :3] = Rotation.from_rotvec(motion[3:]).as_matrix() @ c2w[:3, :3]
    c2w[:3, 3] += motion[:3]
    return dataclasses.replace(camera, c2w=c2w)
