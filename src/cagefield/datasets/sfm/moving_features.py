"""Removal of features on things that move between photos, such as a backdrop held by hand.

A moved backdrop has matches of its own rigid motion, often more than the object in front of it, and structure
from motion then places photos by the backdrop. Its features are recognizable: in some pair of photos from
similar directions their verified matches contradict the poses, while other matches agree. A feature with many
such features nearby in the photo is taken for part of the moving thing. Matches of photos from other
directions do not count: matches between two sides that look alike contradict right poses.

Notation: V photos with keypoints [K,2] each; `matches` [M,2] of a pair (i, j) are rows of both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from cagefield.cameras.camera import Camera
from cagefield.datasets.sfm import features
from cagefield.datasets.sfm.epipolar_error import epipolar_errors

FloatArray = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Pair = tuple[int, int]

CONTRADICTING_SHARE = 0.006
"""Minimum epipolar error of a match that contradicts the poses, over the photo's longer side; half of it
agrees.
"""

MAX_TURN_DEG = 30.0
"""Maximum angle between the viewing directions of a pair whose matches count."""

FEATURE_NEIGHBORS = 9
NEIGHBOR_SHARE = 0.08
"""Maximum distance of the FEATURE_NEIGHBORS nearest features that decide with one, over the longer side."""

MAX_MOVING_NEIGHBORS = 0.4
"""Maximum share of moving neighbors of a feature that counts as static."""

MIN_MOVING_SHARE = 0.2
"""Minimum share of moving features among a photo's matched features, for the photo to show something that
moves.
"""

MIN_MOVING_PHOTOS = 4
"""Minimum number of photos that show something that moves, for matches to be removed."""

MIN_STATIC_MATCHES = 8
"""Minimum number of static matches of a pair."""


@dataclass(frozen=True, eq=False)
class MatchedFeatures:
    """Keypoints [K,2] of V photos in pixels, and verified matches [M,2] by pair (i, j)."""

    keypoints: Sequence[FloatArray]
    matches: Mapping[Pair, npt.NDArray[np.intp]]


def read_features(database: Path, count: int) -> MatchedFeatures:
    """Keypoints and verified matches of `count` photos in a COLMAP database."""
    pycolmap = features.import_pycolmap()
    matches = {}
    with features.open_database(database) as source:
        keypoints = [np.asarray(source.read_keypoints(n + 1), np.float64)[:, :2] for n in range(count)]
        for number, geometry in zip(*source.read_two_view_geometries(), strict=True):
            i, j = (n - 1 for n in pycolmap.pair_id_to_image_pair(number))
            matches[i, j] = np.asarray(geometry.inlier_matches, np.intp).reshape(-1, 2)
    return MatchedFeatures(keypoints, matches)


def pair_errors(
    matched: MatchedFeatures, cameras: Mapping[int, Camera]
) -> dict[Pair, tuple[npt.NDArray[np.intp], FloatArray]]:
    """(matches [M,2], epipolar errors [M] over the longer side) of each pair from similar directions.

    `cameras` belong to the registered photos.
    """
    errors_by_pair = {}
    min_cosine = np.cos(np.radians(MAX_TURN_DEG))
    for (i, j), rows in matched.matches.items():
        if i not in cameras or j not in cameras or cameras[i].forward @ cameras[j].forward < min_cosine:
            continue
        if len(rows):
            pixels = matched.keypoints[i][rows[:, 0]], matched.keypoints[j][rows[:, 1]]
            errors = epipolar_errors(cameras[i], cameras[j], *pixels)
            errors_by_pair[i, j] = rows, errors / max(cameras[j].width, cameras[j].height)
    return errors_by_pair


def moving_features(matched: MatchedFeatures, cameras: Mapping[int, Camera]) -> tuple[list[Mask], list[int]]:
    """(mask [K] of the moving features of each photo, numbers of the photos that show something that
    moves).
    """
    contradicting_counts = [np.zeros(len(points), np.intp) for points in matched.keypoints]
    agreeing_counts = [np.zeros(len(points), np.intp) for points in matched.keypoints]
    for (i, j), (rows, errors) in pair_errors(matched, cameras).items():
        for photo, column in ((i, 0), (j, 1)):
            np.add.at(contradicting_counts[photo], rows[errors > CONTRADICTING_SHARE, column], 1)
            np.add.at(agreeing_counts[photo], rows[errors < 0.5 * CONTRADICTING_SHARE, column], 1)
    moving, photos = [], []
    for photo, points in enumerate(matched.keypoints):
        contradicts = contradicting_counts[photo] > 0
        matched_rows = np.flatnonzero(contradicts | (agreeing_counts[photo] > 0))
        is_moving = contradicts.copy()
        if photo in cameras and len(matched_rows) > FEATURE_NEIGHBORS:
            radius_pixels = NEIGHBOR_SHARE * max(cameras[photo].width, cameras[photo].height)
            distance, rows = cKDTree(points[matched_rows]).query(
                points, FEATURE_NEIGHBORS, distance_upper_bound=radius_pixels
            )
            is_near = np.isfinite(distance)
            votes = np.append(contradicts[matched_rows], False)[rows] & is_near
            is_moving |= votes.sum(axis=1) > MAX_MOVING_NEIGHBORS * np.maximum(is_near.sum(axis=1), 1)
            if is_moving[matched_rows].mean() > MIN_MOVING_SHARE:
                photos.append(photo)
        moving.append(is_moving)
    return moving, photos


def capped_error(matched: MatchedFeatures, cameras: Mapping[int, Camera]) -> float:
    """Mean over pairs from similar directions of their median error, capped, over the longer side."""
    errors = [
        min(float(np.median(errors)), 2.0 * CONTRADICTING_SHARE)
        for rows, errors in pair_errors(matched, cameras).values()
        if len(rows) >= MIN_STATIC_MATCHES
    ]
    return float(np.mean(errors)) if errors else float("inf")


def remove_features(database: Path, moving: Sequence[Mask]) -> list[Pair]:
    """Remove the matches of moving features from a database, and return the changed pairs with enough matches
    left.

    The returned pairs have to be verified again.
    """
    pycolmap = features.import_pycolmap()
    changed_pairs = []
    with features.open_database(database) as source:
        for number, rows in zip(*source.read_all_matches(), strict=True):
            first, second = pycolmap.pair_id_to_image_pair(number)
            rows = np.asarray(rows, np.uint32).reshape(-1, 2)
            is_removed = moving[first - 1][rows[:, 0]] | moving[second - 1][rows[:, 1]]
            if not is_removed.any():
                continue
            source.delete_matches(first, second)
            if source.exists_two_view_geometry(first, second):
                source.delete_two_view_geometry(first, second)
            if (~is_removed).sum() >= MIN_STATIC_MATCHES:
                source.write_matches(first, second, rows[~is_removed])
                changed_pairs.append((first - 1, second - 1))
    return changed_pairs
