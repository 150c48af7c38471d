"""Matches between photos that look alike and show different things: the front and the back of a can, say.

Structure from motion folds such a scene: both sides come to lie on each other, with small errors of
reprojection. Photos that were taken one after the other tell: neighbours in order rarely deceive, so a model
of pairs of near neighbours alone, a chain, is unfolded. It drifts a little; a pair of photos further apart is
false where its own relative rotation is far from the chain's.

Notation: R_i is the rotation from the world to camera i; a pair's relative rotation is R_j R_i^T.

Source: the problem in Cai et al., "Doppelgangers: Learning to Disambiguate Images of Similar Structures"
(2023).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.datasets.sfm import features

FloatArray = npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]

MOST_DRIFT = 45.0
"""Degrees by which a chain may be off. Scenes repeat themselves after 90, 120 or 180."""

LEAST_MATCHES = 30

_MOST_NEIGHBOURS = 8


def neighbourhood(count: int) -> int:
    """How many photos further on still are neighbours: an eighth of them, from 3 to 8."""
    return max(3, min(_MOST_NEIGHBOURS, count // 8))


def are_in_order(counts: Counts) -> bool:
    """Whether photos follow each other as they were taken, by the matches `counts` [N,N] of pairs.

    That is where four fifths of them match the next one, and better than the third next by half.
    """
    if len(counts) < 8:
        return False
    next_one, third = np.diagonal(counts, 1), np.diagonal(counts, 3)
    return bool(np.mean(next_one >= LEAST_MATCHES) >= 0.8 and np.median(next_one) >= 1.5 * np.median(third))


def remove_pairs(database: Path, pairs: set[tuple[int, int]]) -> None:
    """Takes the verified matches of pairs (i, j) out of a database."""
    with features.opened(database) as source:
        for i, j in sorted(pairs):
            source.delete_two_view_geometry(i + 1, j + 1)


def far_pairs(counts: Counts) -> set[tuple[int, int]]:
    """Pairs (i, j), i < j, with matches that are no neighbours in order."""
    first, second = np.nonzero(np.triu(counts, neighbourhood(len(counts)) + 1))
    return set(zip(first.tolist(), second.tolist(), strict=True))


def relative_rotations(
    database: Path, chain: Any, pairs: set[tuple[int, int]]
) -> dict[tuple[int, int], FloatArray]:
    """R_j R_i^T [3,3] of the pairs whose photos are in the model `chain`, from their own matches alone."""
    pycolmap = features.engine()
    found = {}
    with features.opened(database) as source:
        placed = {number - 1 for number in chain.reg_image_ids()}
        used = {index for pair in pairs for index in pair} & placed
        keypoints = {i: np.asarray(source.read_keypoints(i + 1), dtype=np.float64)[:, :2] for i in used}
        cameras = {i: chain.camera(chain.image(i + 1).camera_id) for i in used}
        for i, j in sorted(pairs):
            if i not in used or j not in used:
                continue
            geometry = source.read_two_view_geometry(i + 1, j + 1)
            if len(geometry.inlier_matches) < LEAST_MATCHES:
                continue
            if pycolmap.estimate_two_view_geometry_pose(
                cameras[i], keypoints[i], cameras[j], keypoints[j], geometry
            ):
                found[i, j] = np.asarray(geometry.cam2_from_cam1.matrix())[:, :3]
    return found


def contradicting(
    chain: Mapping[int, FloatArray], relative: Mapping[tuple[int, int], FloatArray]
) -> set[tuple[int, int]]:
    """Pairs whose `relative` rotation is more than MOST_DRIFT from that of the rotations R_i of `chain`."""
    least = 1.0 + 2.0 * np.cos(np.radians(MOST_DRIFT))  # the trace of a rotation by that angle
    return {
        (i, j) for (i, j), rotation in relative.items() if np.trace(rotation @ chain[i] @ chain[j].T) < least
    }


def rotations_of(model: Any) -> dict[int, FloatArray]:
    """R_i of the photos in a model."""
    found = {}
    for number in model.reg_image_ids():
        rigid = model.image(number).cam_from_world
        found[number - 1] = np.asarray((rigid() if callable(rigid) else rigid).matrix())[:, :3]
    return found
