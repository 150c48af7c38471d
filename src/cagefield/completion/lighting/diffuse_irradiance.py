"""Diffuse irradiance from far away: the change of a part's light when the part is turned.

A matt surface of unit normal n is about as bright as

    1 + a . n,

the first two bands of its irradiance. a is fitted to neighbors of one hue with different normals: their log
brightness differs by openness, which is known, by texture, of either sign, and by their normals.

Source: Ramamoorthi and Hanrahan, "An efficient representation for irradiance environment maps" (2001).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from cagefield.completion.surfaces.charbonnier import charbonnier_loss, charbonnier_residuals, estimate_noise
from cagefield.completion.surfaces.surfels import Surfels, average_normals
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.compute.cancellation import check_cancelled
from cagefield.typing import AnyArray, Array

MAX_SURFELS_PER_DISTANCE = 16_000
"""Maximum number of surfels sampled per distance."""

MAX_NORMAL_PAIRS = 8_000
"""Maximum number of pairs for the fit."""

MAX_PAIR_COSINE = 0.97
"""Maximum cosine between the normals of a pair."""

NORMAL_NEIGHBORS = 48
"""Number of surfels over which a normal is averaged: rendered depths are rough, and a fit to rough normals
underestimates a."""

MIN_NEIGHBOR_COSINE = 0.5
"""Minimum cosine between a normal and a neighbor that enters its average."""

NORMAL_SMOOTHING_ROUNDS = 2
"""Number of rounds of that average."""

MAX_HUE_DIFFERENCE = 0.2
"""Maximum difference of the hues of a pair (colors over their means): more is another material."""

PRIOR_COMPONENT_DEVIATION = 0.3
"""Prior standard deviation of each component of a, about 0: at 1 a surface that faces away is black."""

REPEATS_PER_NORMAL_PAIR = 12.0
"""Number of pairs that count as one observation: neighbors, and other views, show the same texture."""

MIN_RELATIVE_BRIGHTNESS = 0.2
"""Minimum of 1 + a . n."""

MIN_EXPLAINED_LOSS_SHARE = 0.01
"""Minimum share of the loss on held-out pairs that a must explain."""

MIN_NORMAL_PAIRS = 500
"""Minimum number of pairs for a fit."""

MIN_HALF_SHARE = 0.1
"""Minimum share of the pairs on each side of a median that splits them into halves."""


@dataclass(frozen=True)
class DiffuseLight:
    """First-order irradiance: brightness 1 + a . n, a the `gradient` [3]."""

    gradient: tuple[float, float, float]

    def log_light(self, normals: AnyArray) -> Array:
        """Log brightness [N] of surfaces with unit normals [N,3]."""
        return np.asarray(
            np.log(np.maximum(1.0 + normals @ np.array(self.gradient), MIN_RELATIVE_BRIGHTNESS))
        )


@dataclass(frozen=True)
class NormalPairs:
    """Neighbors of one hue with different normals.

    log_change [N]: log of the second brightness over the first.
    """

    first: Surfels
    second: Surfels
    log_change: Array


def sample_normal_pairs(
    visibility: CameraVisibility, distances: Sequence[float], *, seed: int = 0
) -> NormalPairs:
    """Pairs of visible surfels, at about each of the `distances` from each other, world units."""
    check_cancelled()
    rng = np.random.default_rng(seed)
    surface, count = visibility.surface, len(visibility.log_brightness)
    first, second = np.zeros(0, np.int64), np.zeros(0, np.int64)
    for distance in distances:
        rows = rng.choice(count, min(count, MAX_SURFELS_PER_DISTANCE), replace=False)
        offset = rng.normal(size=(len(rows), 3))
        offset *= rng.uniform(0.3, 1.0, (len(rows), 1)) / np.linalg.norm(offset, axis=1, keepdims=True)
        gap, neighbor = surface.nearest(surface.points[rows] + distance * offset, 1, 0.5 * distance)
        has_neighbor = np.isfinite(gap[:, 0])
        first, second = np.append(first, rows[has_neighbor]), np.append(second, neighbor[has_neighbor, 0])
    cosine = (surface.normals[first] * surface.normals[second]).sum(axis=1)
    same_hue = np.abs(visibility.hue[first] - visibility.hue[second]).max(axis=1) < MAX_HUE_DIFFERENCE
    valid_rows = np.flatnonzero((cosine < MAX_PAIR_COSINE) & same_hue)
    valid_rows = rng.choice(valid_rows, min(len(valid_rows), MAX_NORMAL_PAIRS), replace=False)
    first, second = first[valid_rows], second[valid_rows]
    change = visibility.log_brightness[second] - visibility.log_brightness[first]
    radius = min(distances)
    return NormalPairs(
        _smooth_normals(surface, first, radius), _smooth_normals(surface, second, radius), change
    )


def _smooth_normals(surface: Surfels, rows: NDArray[np.int64], radius: float) -> Surfels:
    """Surfels of the given rows, with normals averaged within `radius`, world units."""
    points, normals = surface.points[rows], surface.normals[rows]
    distance, neighbor_rows = surface.nearest(points, NORMAL_NEIGHBORS, radius)
    has_neighbor = np.isfinite(distance)
    neighbor_normals = surface.normals[np.where(has_neighbor, neighbor_rows, 0)]
    for _ in range(NORMAL_SMOOTHING_ROUNDS):
        check_cancelled()
        normals = average_normals(normals, neighbor_normals, has_neighbor, MIN_NEIGHBOR_COSINE)
    return Surfels(points, normals)


def fit_diffuse_light(first: Surfels, second: Surfels, change: Array) -> DiffuseLight | None:
    """Diffuse light that explains changes [N] of log brightness between surfels [N]; None if none does.

    Cross-validation over halves of space: an a fitted to one half must explain the other, else the changes
    depend on position, not on normals.
    """
    if len(change) < MIN_NORMAL_PAIRS:
        return None
    noise = estimate_noise(change)
    gains: list[float] = []
    for coordinate in first.points.T:
        half = coordinate > np.median(coordinate)
        for fitted in (half, ~half) if MIN_HALF_SHARE < half.mean() < 1.0 - MIN_HALF_SHARE else ():
            gradient = _fit_gradient(first.take(fitted), second.take(fitted), change[fitted], noise)
            model_loss, zero_loss = (
                charbonnier_loss(
                    _residuals(each, first.take(~fitted), second.take(~fitted), change[~fitted], noise)
                )
                for each in (gradient, np.zeros(3))
            )
            gains.append(1.0 - model_loss / zero_loss if zero_loss > 0.0 else 0.0)
    if not gains or np.mean(gains) < MIN_EXPLAINED_LOSS_SHARE:
        return None
    x, y, z = (float(value) for value in _fit_gradient(first, second, change, noise))
    return DiffuseLight((x, y, z))


def _fit_gradient(first: Surfels, second: Surfels, change: Array, noise: float) -> Array:
    """Gradient a [3] fitted to pairs."""
    check_cancelled()

    def residuals(gradient: Array) -> Array:
        weighted = charbonnier_residuals(_residuals(gradient, first, second, change, noise))
        return np.concatenate(
            [weighted / np.sqrt(REPEATS_PER_NORMAL_PAIR), gradient / PRIOR_COMPONENT_DEVIATION]
        )

    return np.asarray(optimize.least_squares(residuals, np.zeros(3)).x)


def _residuals(gradient: Array, first: Surfels, second: Surfels, change: Array, noise: float) -> Array:
    """Residuals [N] of changes [N] for a gradient a [3], standard deviations."""
    light = DiffuseLight((gradient[0], gradient[1], gradient[2]))
    predicted = light.log_light(second.normals) - light.log_light(first.normals)
    return np.asarray((predicted - change) / noise)
