"""Features on things that move between photos, such as a backdrop held by hand, removed from matches.

A moved backdrop has matches of its own rigid motion, often more than the object in front of it, and
structure from motion then places photos by the backdrop. Its features tell themselves: in some pair of
photos from similar directions their verified matches contradict the poses, while other matches agree.
Features near many such ones, in the photo, are taken for the same thing. Matches of photos from other
directions do not count: those of two sides that look alike contradict right poses.

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
"""Epipolar error of a match that contradicts the poses, over the photo's longer side; half of it agrees."""

MAX_TURN_DEG = 30.0
"""Angle between the viewing directions of a pair whose matches count, at most."""

NEIGHBORS = 9
NEIGHBOR_SHARE = 0.08
"""Features of a photo that are nearest to one, within this share of its longer side, that decide with it."""

MAX_MOVING_NEIGHBORS = 0.4
"""Share of a feature's neighbors that move, from which on it moves with them."""

MIN_MOVING_SHARE = 0.2
"""Share of a photo's matched features that move, from which on the photo shows something that moves."""

MIN_PHOTOS = 4
"""Photos that show something that moves, from which on its matches are removed."""

MIN_MATCHES = 8
"""Matches of a pair that are enough where only those on things that stand still are left."""


@dataclass(frozen=True, eq=False)
class MatchedFeatures:
    """Keypoints [K,2] of V photos in pixels, and verified matches [M,2] by pair (i, j)."""

    keypoints: Sequence[FloatArray]
    matches: Mapping[Pair, npt.NDArray[np.intp]]


def read_features(database: Path, count: int) -> MatchedFeatures:
    """Keypoints and verified matches of `count` photos in a COLMAP database."""
    pycolmap = features.engine()
    matches = {}
    with features.opened(database) as source:
        keypoints = [np.asarray(source.read_keypoints(n + 1), np.float64)[:, :2] for n in range(count)]
        for number, geometry in zip(*source.read_two_view_geometries(), strict=True):
            i, j = (n - 1 for n in pycolmap.pair_id_to_image_pair(number))
            matches[i, j] = np.asarray(geometry.inlier_matches, np.intp).reshape(-1, 2)
    return MatchedFeatures(keypoints, matches)


def pair_errors(
    matched: MatchedFeatures, cameras: Mapping[int, Camera]
) -> dict[Pair, tuple[npt.NDArray[np.intp], FloatArray]]:
    """(matches [M,2], epipolar errors [M] over the longer side) of pairs from similar directions.

    `cameras` are those of the placed photos.
    """
    found = {}
    least_cosine = np.cos(np.radians(MAX_TURN_DEG))
    for (i, j), rows in matched.matches.items():
        if i not in cameras or j not in cameras or cameras[i].forward @ cameras[j].forward < least_cosine:
            continue
        if len(rows):
            pixels = matched.keypoints[i][rows[:, 0]], matched.keypoints[j][rows[:, 1]]
            errors = epipolar_errors(cameras[i], cameras[j], *pixels)
            found[i, j] = rows, errors / max(cameras[j].width, cameras[j].height)
    return found


def moving_features(matched: MatchedFeatures, cameras: Mapping[int, Camera]) -> tuple[list[Mask], list[int]]:
    """(features [K] by photo that move, numbers of the photos that show something that moves)."""
    against = [np.zeros(len(points), np.intp) for points in matched.keypoints]
    agreeing = [np.zeros(len(points), np.intp) for points in matched.keypoints]
    for (i, j), (rows, errors) in pair_errors(matched, cameras).items():
        for photo, column in ((i, 0), (j, 1)):
            np.add.at(against[photo], rows[errors > CONTRADICTING_SHARE, column], 1)
            np.add.at(agreeing[photo], rows[errors < 0.5 * CONTRADICTING_SHARE, column], 1)
    moving, photos = [], []
    for photo, points in enumerate(matched.keypoints):
        alone = against[photo] > 0
        seen = np.flatnonzero(alone | (agreeing[photo] > 0))
        moves = alone.copy()
        if photo in cameras and len(seen) > NEIGHBORS:
            reach = NEIGHBOR_SHARE * max(cameras[photo].width, cameras[photo].height)
            distance, rows = cKDTree(points[seen]).query(points, NEIGHBORS, distance_upper_bound=reach)
            near = np.isfinite(distance)
            votes = np.append(alone[seen], False)[rows] & near
            moves |= votes.sum(axis=1) > MAX_MOVING_NEIGHBORS * np.maximum(near.sum(axis=1), 1)
            if moves[seen].mean() > MIN_MOVING_SHARE:
                photos.append(photo)
        moving.append(moves)
    return moving, photos


def capped_error(matched: MatchedFeatures, cameras: Mapping[int, Camera]) -> float:
    """Mean over pairs from similar directions of their median error, capped, over the longer side."""
    errors = [
        min(float(np.median(errors)), 2.0 * CONTRADICTING_SHARE)
        for rows, errors in pair_errors(matched, cameras).values()
        if len(rows) >= MIN_MATCHES
    ]
    return float(np.mean(errors)) if errors else float("inf")


def remove_features(database: Path, moving: Sequence[Mask]) -> list[Pair]:
    """Takes the matches of moving features out of a database; the pairs that have lost some and have enough.

    These are no longer verified.
    """
    pycolmap = features.engine()
    left = []
    with features.opened(database) as source:
        for number, rows in zip(*source.read_all_matches(), strict=True):
            first, second = pycolmap.pair_id_to_image_pair(number)
            rows = np.asarray(rows, np.uint32).reshape(-1, 2)
            gone = moving[first - 1][rows[:, 0]] | moving[second - 1][rows[:, 1]]
            if not gone.any():
                continue
            source.delete_matches(first, second)
            if source.exists_two_view_geometry(first, second):
                source.delete_two_view_geometry(first, second)
            if (~gone).sum() >= MIN_MATCHES:
                source.write_matches(first, second, rows[~gone])
                left.append((first - 1, second - 1))
    return left
