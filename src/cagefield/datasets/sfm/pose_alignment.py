"""Robust similarity between two sets of camera poses of the same photos.

Notation: camera n has the pose (R_n, o_n) in the one world and (R'_n, o'_n) in the other; the similarity is
x' = s Q x + t. Q comes from the orientations alone (also where positions lie on a line), s and t from the
positions, all with weights 1 / residual: the L1 estimates, which a minority of wrong poses does not move.

Source: Hartley et al., "L1 rotation averaging using the Weiszfeld algorithm" (2011); Umeyama (1991).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cagefield.geometry.point_alignment import Similarity

FloatArray = npt.NDArray[np.float64]

MAX_MEDIAN_TURN_DEG = 15.0
"""Maximum median angle between aligned orientations of poses that agree."""

MAX_MEDIAN_OFFSET = 0.3
"""Maximum median offset between aligned positions of poses that agree, over the positions' spread."""

MAX_ITERATIONS = 50


def align_poses(poses: FloatArray, target: FloatArray) -> Similarity | None:
    """Similarity that takes camera-to-world `poses` [N,4,4] to `target` [N,4,4]; None where they disagree.

    Poses disagree where the median residual turn or offset is above MAX_MEDIAN_TURN_DEG or MAX_MEDIAN_OFFSET.
    """
    relative = target[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1)
    rotation = _median_rotation(relative)
    rotated = poses[:, :3, 3] @ rotation.T
    origins = target[:, :3, 3]
    scale, translation = _scale_and_shift(rotated, origins)
    if not scale > 0.0:
        return None
    median_turn_deg = np.degrees(np.median(_angles(relative, rotation)))
    spread = float(np.median(np.linalg.norm(origins - np.median(origins, axis=0), axis=1)))
    offset = float(np.median(np.linalg.norm(scale * rotated + translation - origins, axis=1)))
    if median_turn_deg > MAX_MEDIAN_TURN_DEG or offset > MAX_MEDIAN_OFFSET * max(spread, 1e-300):
        return None
    return Similarity(scale, rotation, translation)


def _angles(rotations: FloatArray, one: FloatArray) -> FloatArray:
    """Angles [N], radians, of rotations [N,3,3] to `one` [3,3]."""
    chord = np.linalg.norm(rotations - one, axis=(1, 2)) / np.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.clip(chord, 0.0, 1.0)))


def _median_rotation(rotations: FloatArray) -> FloatArray:
    """Rotation [3,3] with the least sum of chordal distances to `rotations` [N,3,3]."""
    weights = np.ones(len(rotations))
    rotation = np.eye(3)
    for _ in range(MAX_ITERATIONS):
        left, _, right = np.linalg.svd(np.einsum("n,nij->ij", weights, rotations))
        sign = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
        rotation = left @ sign @ right
        weights = 1.0 / np.maximum(np.linalg.norm(rotations - rotation, axis=(1, 2)), 1e-9)
    return rotation


def _scale_and_shift(points: FloatArray, target: FloatArray) -> tuple[float, FloatArray]:
    """Scale and translation [3] of target = scale points + translation, by reweighted least squares.

    Positions that all coincide have scale 1.
    """
    weights = np.full(len(points), 1.0 / len(points))
    size = float(np.linalg.norm(target - target.mean(axis=0), axis=1).mean())
    scale, shift = 1.0, np.zeros(3)
    for _ in range(MAX_ITERATIONS):
        share = weights / weights.sum()
        middle, goal = share @ points, share @ target
        a, b = points - middle, target - goal
        spread = float(share @ (a * a).sum(axis=1))
        scale = float(share @ (a * b).sum(axis=1)) / spread if spread > 1e-24 else 1.0
        shift = goal - scale * middle
        residual = np.linalg.norm(scale * points + shift - target, axis=1)
        weights = 1.0 / np.maximum(residual, 1e-9 * max(size, 1e-300))
    return scale, np.asarray(shift)
