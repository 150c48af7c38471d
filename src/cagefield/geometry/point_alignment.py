"""Similarities between point sets: by pairs of points, and refined by the iterative closest point algorithm.

Notation: x' = s Q x + t takes a source point x to its target x'.

Source: Umeyama, "Least-squares estimation of transformation parameters between two point patterns" (1991);
Chen and Medioni, "Object modelling by registration of multiple range images" (1992), for distances to planes;
Chetverikov et al., "The trimmed iterative closest point algorithm" (2002).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from cagefield.errors import CagefieldError
from cagefield.typing import Array

MIN_WIDTH_SHARE = 1e-4
"""Minimum second extent of points that fix a rotation, as a share of their first."""

MAX_SOURCE_POINTS = 20_000
"""Maximum number of source points that are matched."""

MAX_TARGET_POINTS = 200_000
"""Maximum number of target points that they are matched to."""

PLANE_NEIGHBORS = 12
"""Number of target points whose principal axes give a normal."""

MAX_ICP_ROUNDS = 60
"""Maximum number of rounds of matching."""

TRIMMED_QUANTILE = 0.7
"""Share of the source points, the nearest to their matches, that a round fits."""

MAX_SCALE_CHANGE = 1.25
"""Maximum factor by which a refinement enlarges or shrinks the source: one that shrinks to a point on the
target's surface would be near it, too."""

CONVERGED_SHARE = 1e-5
"""Motion of the points in a round, as a share of their extent, below which the rounds end."""


@dataclass(frozen=True, eq=False)
class Similarity:
    """Map x -> scale rotation x + translation; rotation [3,3], translation [3]."""

    scale: float
    rotation: Array
    translation: Array

    def transform_points(self, points: ArrayLike) -> Array:
        """Points [...,3] mapped by the similarity."""
        return np.asarray(self.scale * (np.asarray(points) @ self.rotation.T) + self.translation)

    def transform_pose(self, c2w: Array) -> Array:
        """Camera-to-world pose [4,4] mapped by the similarity, without scale in its rotation."""
        pose = np.eye(4)
        pose[:3, :3] = self.rotation @ c2w[:3, :3]
        pose[:3, 3] = self.transform_points(c2w[:3, 3])
        return pose


def fit_similarity(source: ArrayLike, target: ArrayLike) -> Similarity:
    """The similarity with the least squares between source [N,3], mapped, and target [N,3]; N >= 3.

    Raises:
        CagefieldError: fewer than three pairs, values that are not finite, or points on a line.
    """
    a, b = np.asarray(source, np.float64), np.asarray(target, np.float64)
    if a.ndim != 2 or a.shape[1] != 3 or a.shape != b.shape or len(a) < 3:
        raise CagefieldError("an alignment takes at least three pairs of points")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise CagefieldError("the points of an alignment must be finite numbers")
    middle, goal = a.mean(axis=0), b.mean(axis=0)
    for points, name in ((a - middle, "source"), (b - goal, "target")):
        extents = np.linalg.svd(points, compute_uv=False)
        if not extents[1] > MIN_WIDTH_SHARE * extents[0]:
            raise CagefieldError(f"the {name}'s points lie on a line; choose points that do not")
    left, values, right = np.linalg.svd((b - goal).T @ (a - middle))
    signs = np.array([1.0, 1.0, np.linalg.det(left @ right)])
    rotation = left @ np.diag(signs) @ right
    scale = float((values * signs).sum() / ((a - middle) ** 2).sum())
    return Similarity(scale, rotation, goal - scale * rotation @ middle)


@dataclass(frozen=True, eq=False)
class RefinedSimilarity:
    """A refined similarity; distances are medians of the matched source points, before and after."""

    similarity: Similarity
    distance_before: float
    distance: float


def refine_similarity(
    source: NDArray[np.floating],
    target: NDArray[np.floating],
    start: Similarity,
    *,
    keep_scale: bool = False,
    reach: float | None = None,
    seed: int = 0,
) -> RefinedSimilarity:
    """Similarity that brings source points [N,3] nearer to the surface of target points [M,3] than `start`.

    Trimmed iterative closest points: each round matches source points to their nearest target points, and
    fits the distances of the nearest TRIMMED_QUANTILE to the planes of their matches. Source points that
    `start` leaves beyond a distance `reach` from the target have no counterpart and do not count, if given.
    `start` itself where nothing comes nearer.

    Raises:
        CagefieldError: fewer than PLANE_NEIGHBORS points that count in either set.
    """
    goal = _sample(target, MAX_TARGET_POINTS, seed)
    if min(len(source), len(goal)) < PLANE_NEIGHBORS:
        raise CagefieldError(f"a refinement takes at least {PLANE_NEIGHBORS} points on both sides")
    tree, points = cKDTree(goal), np.asarray(source, np.float64)
    if reach is not None:
        points = points[tree.query(start.transform_points(points), workers=-1)[0] <= reach]
        if len(points) < PLANE_NEIGHBORS:
            raise CagefieldError(
                "the pairs bring none of the surfaces side by side; choose better ones, or align by the "
                "pairs alone"
            )
    points = _sample(points, MAX_SOURCE_POINTS, seed)
    count = max(PLANE_NEIGHBORS, int(TRIMMED_QUANTILE * len(points)))

    def match(similarity: Similarity) -> tuple[Array, Array, Array]:
        moved = similarity.transform_points(points)
        distance, nearest = tree.query(moved, workers=-1)
        rows = np.argpartition(distance, count - 1)[:count]
        return distance[rows], moved[rows], goal[nearest[rows]]

    found, (distance, moved, matched) = start, match(start)
    best, before, least = start, float(np.median(distance)), float(np.median(distance))
    for _ in range(MAX_ICP_ROUNDS):
        step = _step_to_planes(moved, matched, _normals(goal, tree, matched), keep_scale)
        size = float(np.linalg.norm(np.ptp(moved, axis=0)))
        motion = float(np.linalg.norm(step.transform_points(moved) - moved, axis=1).max())
        found = Similarity(
            step.scale * found.scale,
            step.rotation @ found.rotation,
            step.transform_points(found.translation),
        )
        if not 1.0 / MAX_SCALE_CHANGE < found.scale / start.scale < MAX_SCALE_CHANGE:
            break
        distance, moved, matched = match(found)
        if (median := float(np.median(distance))) < least:
            best, least = found, median
        if motion < CONVERGED_SHARE * size:
            break
    return RefinedSimilarity(best, before, least)


def _sample(points: NDArray[np.floating], count: int, seed: int) -> Array:
    """At most `count` points [N,3], float64."""
    if len(points) > count:
        points = points[np.random.default_rng(seed).choice(len(points), count, replace=False)]
    return np.asarray(points, np.float64)


def _normals(points: Array, tree: cKDTree, at: Array) -> Array:
    """Unit normals [N,3], of either sign, of the surface of points [M,3] at some of them [N,3]."""
    _, rows = tree.query(at, k=PLANE_NEIGHBORS, workers=-1)
    near = points[rows] - points[rows].mean(axis=1, keepdims=True)
    return np.asarray(np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))[1][:, :, 0])


def _step_to_planes(points: Array, target: Array, normals: Array, keep_scale: bool) -> Similarity:
    """The similarity near the identity that brings points [N,3] to the planes of target [N,3], normals [N,3].

    Least squares of n . (x + g (x - c) + w x (x - c) + v - y) over the growth g, the rotation vector w and
    the shift v, c the points' mean.
    """
    middle = points.mean(axis=0)
    arm = points - middle
    size = max(float(np.abs(arm).max()), 1e-300)
    table = np.column_stack([np.cross(arm, normals), size * normals, (arm * normals).sum(axis=1)])
    if keep_scale:
        table = table[:, :6]
    residual = ((target - points) * normals).sum(axis=1)
    values = np.linalg.lstsq(table / size, residual / size, rcond=1e-9)[0]
    rotation = Rotation.from_rotvec(values[:3]).as_matrix()
    scale = 1.0 if keep_scale else float(np.exp(values[6]))
    shift = size * values[3:6]
    return Similarity(scale, rotation, middle + shift - scale * rotation @ middle)
