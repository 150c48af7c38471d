"""How bright surfaces are by where they face: what becomes of a part's light when it is turned.

Light from far away makes a matt surface of unit normal n about as bright as

    1 + a . n,

the first two bands of its irradiance. a is fitted to neighbours of one hue that face different ways: the log
of their brightness differs by openness, which is known, by texture, of either sign, and by where they face.

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
from cagefield.typing import AnyArray, Array

MAX_SURFELS_PER_DISTANCE = 40_000
"""Maximum number of surfels sampled per distance."""

MAX_NORMAL_PAIRS = 20_000
"""Maximum number of pairs for the fit."""

MAX_PAIR_COSINE = 0.97
"""Greatest cosine between the normals of a pair."""

NORMAL_NEIGHBORS = 48
"""Number of surfels over which a normal is averaged: rendered depths are rough, and a fit to rough normals
underestimates a."""

MIN_NEIGHBOR_COSINE = 0.5
"""Minimum cosine between a normal and a neighbor that enters its average."""

NORMAL_SMOOTHING_ROUNDS = 2
"""Number of rounds of that average."""

MAX_HUE_DIFFERENCE = 0.2
"""Greatest difference of a pair's colours over their means: more is another material."""

PRIOR_COMPONENT_DEVIATION = 0.3
"""Standard deviation of each component of a, about 0: at 1 the side that faces away would be black."""

REPEATS_PER_NORMAL_PAIR = 30.0
"""Pairs that count as one: neighbours, and other views, see the same texture."""

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
    """Surfaces are brighter the more they face along `towards` [3], a."""

    towards: tuple[float, float, float]

    def log_light(self, normals: AnyArray) -> Array:
        """The log of how bright surfaces of unit normals [N,3] are, [N]."""
        return np.asarray(np.log(np.maximum(1.0 + normals @ np.array(self.towards), MIN_RELATIVE_BRIGHTNESS)))


@dataclass(frozen=True)
class NormalPairs:
    """Neighbours of one hue that face different ways; log_change [N]: of the second's brightness."""

    first: Surfels
    second: Surfels
    log_change: Array


def sample_normal_pairs(sight: CameraVisibility, apart: Sequence[float], *, seed: int = 0) -> NormalPairs:
    """Pairs of what is seen of a field, about so far `apart`, world units."""
    chance = np.random.default_rng(seed)
    surface, count = sight.surface, len(sight.bright)
    first, second = np.zeros(0, np.int64), np.zeros(0, np.int64)
    for distance in apart:
        rows = chance.choice(count, min(count, MAX_SURFELS_PER_DISTANCE), replace=False)
        way = chance.normal(size=(len(rows), 3))
        way *= chance.uniform(0.3, 1.0, (len(rows), 1)) / np.linalg.norm(way, axis=1, keepdims=True)
        found, there = surface.nearest(surface.points[rows] + distance * way, 1, 0.5 * distance)
        near = np.isfinite(found[:, 0])
        first, second = np.append(first, rows[near]), np.append(second, there[near, 0])
    cosine = (surface.normals[first] * surface.normals[second]).sum(axis=1)
    alike = np.abs(sight.hue[first] - sight.hue[second]).max(axis=1) < MAX_HUE_DIFFERENCE
    kept = np.flatnonzero((cosine < MAX_PAIR_COSINE) & alike)
    kept = chance.choice(kept, min(len(kept), MAX_NORMAL_PAIRS), replace=False)
    first, second = first[kept], second[kept]
    change = sight.bright[second] - sight.bright[first]
    reach = min(apart)
    return NormalPairs(
        _smooth_normals(surface, first, reach), _smooth_normals(surface, second, reach), change
    )


def _smooth_normals(surface: Surfels, rows: NDArray[np.int64], reach: float) -> Surfels:
    """Some elements of a surface, their normals means of those around."""
    points, normals = surface.points[rows], surface.normals[rows]
    found, others = surface.nearest(points, NORMAL_NEIGHBORS, reach)
    near = np.isfinite(found)
    beside = surface.normals[np.where(near, others, 0)]
    for _ in range(NORMAL_SMOOTHING_ROUNDS):
        normals = average_normals(normals, beside, near, MIN_NEIGHBOR_COSINE)
    return Surfels(points, normals)


def fit_diffuse_light(first: Surfels, second: Surfels, change: Array) -> DiffuseLight | None:
    """What explains changes [N] of log brightness between pairs [N] that face different ways, if it does.

    What one half of them says, in space, must hold in the other: else it is where things are that matters.
    """
    if len(change) < MIN_NORMAL_PAIRS:
        return None
    noise = estimate_noise(change)
    gains: list[float] = []
    for along in first.points.T:
        half = along > np.median(along)
        for one in (half, ~half) if MIN_HALF_SHARE < half.mean() < 1.0 - MIN_HALF_SHARE else ():
            towards = _fit_gradient(first.take(one), second.take(one), change[one], noise)
            left, usual = (
                charbonnier_loss(_residuals(each, first.take(~one), second.take(~one), change[~one], noise))
                for each in (towards, np.zeros(3))
            )
            gains.append(1.0 - left / usual if usual > 0.0 else 0.0)
    if not gains or np.mean(gains) < MIN_EXPLAINED_LOSS_SHARE:
        return None
    x, y, z = (float(value) for value in _fit_gradient(first, second, change, noise))
    return DiffuseLight((x, y, z))


def _fit_gradient(first: Surfels, second: Surfels, change: Array, noise: float) -> Array:
    """a [3] of pairs."""

    def residuals(towards: Array) -> Array:
        left = charbonnier_residuals(_residuals(towards, first, second, change, noise))
        return np.concatenate([left / np.sqrt(REPEATS_PER_NORMAL_PAIR), towards / PRIOR_COMPONENT_DEVIATION])

    return np.asarray(optimize.least_squares(residuals, np.zeros(3)).x)


def _residuals(towards: Array, first: Surfels, second: Surfels, change: Array, noise: float) -> Array:
    """What a [3] leaves over of changes [N], standard deviations."""
    facing = DiffuseLight((towards[0], towards[1], towards[2]))
    told = facing.log_light(second.normals) - facing.log_light(first.normals)
    return np.asarray((told - change) / noise)
