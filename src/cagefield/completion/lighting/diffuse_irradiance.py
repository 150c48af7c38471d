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

from cagefield.completion.surfaces.charbonnier import loss, noise_of, softened
from cagefield.completion.surfaces.surfels import Surfels, evened
from cagefield.completion.surfaces.visibility import Sight
from cagefield.typing import AnyArray, Array

SOME, PAIRS = 40_000, 20_000
"""Surface elements that neighbours are looked for of, for each distance, and pairs, at most."""

TURNED = 0.97
"""Greatest cosine between the normals of a pair."""

AROUND, ALONG, TIMES = 48, 0.5, 2
"""Surface elements that a normal is the mean of, so many times over, and the least cosine between theirs and
it: pictures' depths are rough, and a fit to rough normals finds too little."""

HUE = 0.2
"""Greatest difference of a pair's colours over their means: more is another material."""

SPREAD = 0.3
"""Standard deviation of each component of a, about 0: at 1 the side that faces away would be black."""

ALIKE = 30.0
"""Pairs that count as one: neighbours, and other views, see the same texture."""

LEAST, LEAST_GAIN = 0.2, 0.01
"""Least brightness, so much of the mean; share of the loss of other pairs that facing must explain."""

ENOUGH, SIDE = 500, 0.1
"""Pairs from which it is fitted, at least; share of them on one side of a middle that makes it a half."""


@dataclass(frozen=True)
class Facing:
    """Surfaces are brighter the more they face along `towards` [3], a."""

    towards: tuple[float, float, float]

    def log_light(self, normals: AnyArray) -> Array:
        """The log of how bright surfaces of unit normals [N,3] are, [N]."""
        return np.asarray(np.log(np.maximum(1.0 + normals @ np.array(self.towards), LEAST)))


@dataclass(frozen=True)
class TurnedPairs:
    """Neighbours of one hue that face different ways; log_change [N]: of the second's brightness."""

    first: Surfels
    second: Surfels
    log_change: Array


def turned_pairs(sight: Sight, apart: Sequence[float], *, seed: int = 0) -> TurnedPairs:
    """Pairs of what is seen of a field, about so far `apart`, world units."""
    chance = np.random.default_rng(seed)
    surface, count = sight.surface, len(sight.bright)
    first, second = np.zeros(0, np.int64), np.zeros(0, np.int64)
    for distance in apart:
        rows = chance.choice(count, min(count, SOME), replace=False)
        way = chance.normal(size=(len(rows), 3))
        way *= chance.uniform(0.3, 1.0, (len(rows), 1)) / np.linalg.norm(way, axis=1, keepdims=True)
        found, there = surface.nearest(surface.points[rows] + distance * way, 1, 0.5 * distance)
        near = np.isfinite(found[:, 0])
        first, second = np.append(first, rows[near]), np.append(second, there[near, 0])
    cosine = (surface.normals[first] * surface.normals[second]).sum(axis=1)
    alike = np.abs(sight.hue[first] - sight.hue[second]).max(axis=1) < HUE
    kept = np.flatnonzero((cosine < TURNED) & alike)
    kept = chance.choice(kept, min(len(kept), PAIRS), replace=False)
    first, second = first[kept], second[kept]
    change = sight.bright[second] - sight.bright[first]
    reach = min(apart)
    return TurnedPairs(_smoothed(surface, first, reach), _smoothed(surface, second, reach), change)


def _smoothed(surface: Surfels, rows: NDArray[np.int64], reach: float) -> Surfels:
    """Some elements of a surface, their normals means of those around."""
    points, normals = surface.points[rows], surface.normals[rows]
    found, others = surface.nearest(points, AROUND, reach)
    near = np.isfinite(found)
    beside = surface.normals[np.where(near, others, 0)]
    for _ in range(TIMES):
        normals = evened(normals, beside, near, ALONG)
    return Surfels(points, normals)


def facing_of(first: Surfels, second: Surfels, change: Array) -> Facing | None:
    """What explains changes [N] of log brightness between pairs [N] that face different ways, if it does.

    What one half of them says, in space, must hold in the other: else it is where things are that matters.
    """
    if len(change) < ENOUGH:
        return None
    noise = noise_of(change)
    gains: list[float] = []
    for along in first.points.T:
        half = along > np.median(along)
        for one in (half, ~half) if SIDE < half.mean() < 1.0 - SIDE else ():
            towards = _fitted(first.take(one), second.take(one), change[one], noise)
            left, usual = (
                loss(_left(each, first.take(~one), second.take(~one), change[~one], noise))
                for each in (towards, np.zeros(3))
            )
            gains.append(1.0 - left / usual if usual > 0.0 else 0.0)
    if not gains or np.mean(gains) < LEAST_GAIN:
        return None
    x, y, z = (float(value) for value in _fitted(first, second, change, noise))
    return Facing((x, y, z))


def _fitted(first: Surfels, second: Surfels, change: Array, noise: float) -> Array:
    """a [3] of pairs."""

    def residuals(towards: Array) -> Array:
        left = softened(_left(towards, first, second, change, noise))
        return np.concatenate([left / np.sqrt(ALIKE), towards / SPREAD])

    return np.asarray(optimize.least_squares(residuals, np.zeros(3)).x)


def _left(towards: Array, first: Surfels, second: Surfels, change: Array, noise: float) -> Array:
    """What a [3] leaves over of changes [N], standard deviations."""
    facing = Facing((towards[0], towards[1], towards[2]))
    told = facing.log_light(second.normals) - facing.log_light(first.normals)
    return np.asarray((told - change) / noise)
