"""Disambiguation of photos that look alike and show different things, such as the front and the back of a
can.

Structure from motion folds such a scene: both sides are placed at the same position, with small reprojection
errors. Photos in the order of capture resolve the ambiguity: neighbors in order rarely mismatch, so a model
of pairs of near neighbors alone (the chain) is not folded. The chain drifts a little; a pair of photos
further apart is false where its own relative rotation is far from the chain's.

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

MAX_DRIFT_DEG = 45.0
"""Maximum rotation error of a chain. Scenes repeat themselves after 90, 120 or 180 degrees."""

MIN_PAIR_MATCHES = 30

_MAX_NEIGHBORS = 8


def neighborhood_size(count: int) -> int:
    """Maximum offset in order of photos that count as neighbors: an eighth of their number, from 3 to 8."""
    return max(3, min(_MAX_NEIGHBORS, count // 8))


def is_sequence(counts: Counts) -> bool:
    """Whether photos follow each other in the order of capture, by the numbers of matches `counts` [N,N] of
    pairs.

    In a sequence four fifths of the photos match the next one, and in the median by half more than the third
    next.
    """
    if len(counts) < 8:
        return False
    next_counts, third_next_counts = np.diagonal(counts, 1), np.diagonal(counts, 3)
    return bool(
        np.mean(next_counts >= MIN_PAIR_MATCHES) >= 0.8
        and np.median(next_counts) >= 1.5 * np.median(third_next_counts)
    )


def remove_pairs(database: Path, pairs: set[tuple[int, int]]) -> None:
    """Remove the verified matches of pairs (i, j) from a database."""
    with features.open_database(database) as source:
        for i, j in sorted(pairs):
            source.delete_two_view_geometry(i + 1, j + 1)


def distant_pairs(counts: Counts) -> set[tuple[int, int]]:
    """Pairs (i, j), i < j, with matches that are no neighbors in order."""
    first, second = np.nonzero(np.triu(counts, neighborhood_size(len(counts)) + 1))
    return set(zip(first.tolist(), second.tolist(), strict=True))


def relative_rotations(
    database: Path, chain: Any, pairs: set[tuple[int, int]]
) -> dict[tuple[int, int], FloatArray]:
    """Relative rotation R_j R_i^T [3,3] of the pairs whose photos are in the model `chain`, from their own
    matches alone.
    """
    pycolmap = features.import_pycolmap()
    rotations = {}
    with features.open_database(database) as source:
        registered = {number - 1 for number in chain.reg_image_ids()}
        used = {index for pair in pairs for index in pair} & registered
        keypoints = {i: np.asarray(source.read_keypoints(i + 1), dtype=np.float64)[:, :2] for i in used}
        cameras = {i: chain.camera(chain.image(i + 1).camera_id) for i in used}
        for i, j in sorted(pairs):
            if i not in used or j not in used:
                continue
            geometry = source.read_two_view_geometry(i + 1, j + 1)
            if len(geometry.inlier_matches) < MIN_PAIR_MATCHES:
                continue
            if pycolmap.estimate_two_view_geometry_pose(
                cameras[i], keypoints[i], cameras[j], keypoints[j], geometry
            ):
                rotations[i, j] = np.asarray(geometry.cam2_from_cam1.matrix())[:, :3]
    return rotations


def contradicting_pairs(
    chain: Mapping[int, FloatArray], relative: Mapping[tuple[int, int], FloatArray]
) -> set[tuple[int, int]]:
    """Pairs whose `relative` rotation differs from that of the rotations R_i of `chain` by more than
    MAX_DRIFT_DEG.
    """
    min_trace = 1.0 + 2.0 * np.cos(np.radians(MAX_DRIFT_DEG))  # the trace of a rotation by that angle
    return {
        (i, j)
        for (i, j), rotation in relative.items()
        if np.trace(rotation @ chain[i] @ chain[j].T) < min_trace
    }


def model_rotations(model: Any) -> dict[int, FloatArray]:
    """Rotation R_i [3,3] of each photo in a model."""
    rotations = {}
    for number in model.reg_image_ids():
        rigid = model.image(number).cam_from_world
        rotations[number - 1] = np.asarray((rigid() if callable(rigid) else rigid).matrix())[:, :3]
    return rotations
