"""A dominant light, such as the sun: what it reaches, and how it is found in a field's pictures.

With s the direction to the light, k its share of all light on a surface that faces it, and V the share of the
light that nothing is in the way of, a surface point p with normal n is as bright as

    1 - k + k max(0, n . s) V(p).

V comes from a walk from p along s by the distance to the nearest solid, D: V = min over t of D(p + t s) /
(SOFT t), at most 1. k and s are fitted to neighbours on surfaces, as openness is
(`completion.lighting.ambient_occlusion`): of
DIRECTIONS over half a sphere, the one that explains most of what openness leaves of their differences.

Source: Aaltonen, "GPU-based clay simulation and ray-tracing tech in Claybook" (2018), and Quilez, "Soft
shadows in raymarched SDFs" (2010), for V.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cagefield.completion.surfaces.surfels import DistanceFunction, Surfels
from cagefield.typing import AnyArray, Array

LIGHT_TANGENT = 0.12
"""Width of the light: the tangent of the half angle that it takes of the sky."""

MAX_RAY_STEPS = 40
"""Steps of a walk, at most."""

DIRECTION_COUNT = 96
"""Directions that are tried."""

CANDIDATE_SHARES = np.arange(0.0, 0.96, 0.05)
"""Shares k that are tried."""

MAX_SHADOW_PAIRS = 6000
"""Pairs of neighbours that are looked at, at most."""

MAX_LOG_CHANGE = 1.0
"""Changes of log colour that are larger count as this: texture makes the largest."""

MIN_LIGHT_SHARE = 0.15
"""Minimum share k of a light that is accepted."""

MIN_EXPLAINED_ERROR_SHARE = 0.05
"""Minimum share of the mean squared difference that an accepted light explains."""


@dataclass(frozen=True)
class DirectionalLight:
    """direction [3], unit, to the light; its share k; near, far: where walks begin and end, world units."""

    direction: tuple[float, float, float]
    share: float
    near: float
    far: float

    def log_light(self, distance: DistanceFunction, points: Array, normals: AnyArray) -> Array:
        """The log of how bright surface points [N,3] with unit normals [N,3] are."""
        s = np.array(self.direction)
        facing = np.maximum(np.asarray(normals, np.float64) @ s, 0.0)
        lit = np.flatnonzero(facing > 0.0)
        seen = np.zeros(len(points))
        seen[lit] = light_visibility(distance, points[lit], np.asarray(normals)[lit], s, self.near, self.far)
        return np.asarray(np.log(np.maximum(1.0 - self.share + self.share * facing * seen, 0.02)))


def light_visibility(
    distance: DistanceFunction, points: Array, normals: AnyArray, direction: Array, near: float, far: float
) -> Array:
    """V [N] of points [N,3] with normals [N,3] along a direction [3]; `near`, `far` as of a `Sun`."""
    start = points + near * normals
    t, open_ = np.full(len(points), near), np.ones(len(points))
    going = np.arange(len(points))
    for _ in range(MAX_RAY_STEPS):
        if not len(going):
            break
        d = distance(start[going] + t[going, None] * direction)
        open_[going] = np.minimum(open_[going], d / (LIGHT_TANGENT * t[going]))
        t[going] += np.maximum(d, 0.5 * near)
        going = going[(t[going] < far) & (open_[going] > 0.01)]
    return np.asarray(np.clip(open_, 0.0, 1.0))


def fit_directional_light(
    distance: DistanceFunction,
    first: Surfels,
    second: Surfels,
    change: Array,
    reaches: Sequence[float],
    direction: Sequence[float] | None = None,
) -> DirectionalLight | None:
    """The light that explains changes [N] of log colour between surface elements [N]; None where none does.

    `direction` [3]: where that is known, its share is found.
    """
    near, far = reaches[0], 6.0 * reaches[-1]
    every = np.arange(len(change))
    some = np.random.default_rng(0).choice(every, min(MAX_SHADOW_PAIRS, len(every)), replace=False)
    pairs = first.take(some), second.take(some)
    wanted = change[some]
    wanted = wanted - np.median(wanted)
    wanted = np.clip(wanted, -MAX_LOG_CHANGE, MAX_LOG_CHANGE)
    tried = hemisphere_directions() if direction is None else np.array(direction, np.float64)[None]
    best, least = None, np.inf
    for s in tried / np.linalg.norm(tried, axis=1, keepdims=True):
        light = [
            np.maximum(at.normals @ s, 0.0) * light_visibility(distance, at.points, at.normals, s, near, far)
            for at in pairs
        ]
        for share in CANDIDATE_SHARES:
            a, b = (np.log(1.0 - share + share * each) for each in light)
            error = float(((np.clip(b - a, -MAX_LOG_CHANGE, MAX_LOG_CHANGE) - wanted) ** 2).mean())
            if error < least:
                best, least = (s, float(share)), error
    usual = float((wanted**2).mean())
    if best is None or best[1] < MIN_LIGHT_SHARE or least > (1.0 - MIN_EXPLAINED_ERROR_SHARE) * usual:
        return None
    x, y, z = (float(value) for value in best[0])
    return DirectionalLight((x, y, z), best[1], near, far)


def hemisphere_directions() -> Array:
    """DIRECTIONS unit vectors [D,3], evenly over the upper half of a sphere."""
    number = np.arange(DIRECTION_COUNT)
    height = 0.1 + 0.9 * (number + 0.5) / DIRECTION_COUNT
    angle = np.pi * (3.0 - np.sqrt(5.0)) * number
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)
