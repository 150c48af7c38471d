"""Directional light, such as the sun: its shadows, and its fit to a field's images.

With s the direction to the light, k its share of all light on a surface that faces it, and V its
visibility, a surface point p with normal n is as bright as

    1 - k + k max(0, n . s) V(p).

V comes from a ray march from p along s with the distance to the nearest solid, D: V = min over t of D(p + t
s) / (LIGHT_TANGENT t), at most 1. k and s are fitted to neighbors on surfaces, as openness is
(`completion.lighting.ambient_occlusion`): of DIRECTION_COUNT directions over half a sphere, the best one
explains most of the differences that openness leaves.

Source: Aaltonen, "GPU-based clay simulation and ray-tracing tech in Claybook" (2018), and Quilez, "Soft
shadows in raymarched SDFs" (2010), for V.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cagefield.completion.surfaces.surfels import DistanceFunction, Surfels
from cagefield.compute.cancellation import check_cancelled
from cagefield.typing import AnyArray, Array

LIGHT_TANGENT = 0.12
"""Tangent of half the light's angular diameter."""

MAX_RAY_STEPS = 40
"""Maximum number of steps of a ray."""

DIRECTION_COUNT = 96
"""Number of candidate directions."""

CANDIDATE_SHARES = np.arange(0.0, 0.96, 0.05)
"""Candidate shares k."""

MAX_SHADOW_PAIRS = 6000
"""Maximum number of pairs for the fit."""

MAX_LOG_CHANGE = 1.0
"""Bound of changes of log color: the largest ones are texture."""

MIN_LIGHT_SHARE = 0.15
"""Minimum share k of a light that is accepted."""

MIN_EXPLAINED_ERROR_SHARE = 0.05
"""Minimum share of the mean squared difference that an accepted light explains."""


@dataclass(frozen=True)
class DirectionalLight:
    """Light from one direction.

    direction [3]: unit vector to the light; share: k; near, far: start and end of a shadow ray, world
    units.
    """

    direction: tuple[float, float, float]
    share: float
    near: float
    far: float

    def log_light(self, distance: DistanceFunction, points: Array, normals: AnyArray) -> Array:
        """Log brightness [N] of surface points [N,3] with unit normals [N,3]."""
        s = np.array(self.direction)
        cosine = np.maximum(np.asarray(normals, np.float64) @ s, 0.0)
        facing_rows = np.flatnonzero(cosine > 0.0)
        visibility = np.zeros(len(points))
        visibility[facing_rows] = light_visibility(
            distance, points[facing_rows], np.asarray(normals)[facing_rows], s, self.near, self.far
        )
        return np.asarray(np.log(np.maximum(1.0 - self.share + self.share * cosine * visibility, 0.02)))


def light_visibility(
    distance: DistanceFunction, points: Array, normals: AnyArray, direction: Array, near: float, far: float
) -> Array:
    """Visibility V [N] of a light from points [N,3] with normals [N,3]; rays as in `DirectionalLight`."""
    check_cancelled()
    start = points + near * normals
    t, visibility = np.full(len(points), near), np.ones(len(points))
    active = np.arange(len(points))
    for _ in range(MAX_RAY_STEPS):
        if not len(active):
            break
        clearance = distance(start[active] + t[active, None] * direction)
        visibility[active] = np.minimum(visibility[active], clearance / (LIGHT_TANGENT * t[active]))
        t[active] += np.maximum(clearance, 0.5 * near)
        active = active[(t[active] < far) & (visibility[active] > 0.01)]
    return np.asarray(np.clip(visibility, 0.0, 1.0))


def fit_directional_light(
    distance: DistanceFunction,
    first: Surfels,
    second: Surfels,
    change: Array,
    radii: Sequence[float],
    direction: Sequence[float] | None = None,
) -> DirectionalLight | None:
    """Light that explains changes [N] of log color between surfels [N]; None if none does.

    `direction` [3]: the direction to the light, if it is known; only the share is fitted then.
    """
    near, far = radii[0], 6.0 * radii[-1]
    rows = np.arange(len(change))
    sample = np.random.default_rng(0).choice(rows, min(MAX_SHADOW_PAIRS, len(rows)), replace=False)
    pairs = first.take(sample), second.take(sample)
    observed = change[sample]
    observed = observed - np.median(observed)
    observed = np.clip(observed, -MAX_LOG_CHANGE, MAX_LOG_CHANGE)
    candidates = hemisphere_directions() if direction is None else np.array(direction, np.float64)[None]
    best, lowest_error = None, np.inf
    for s in candidates / np.linalg.norm(candidates, axis=1, keepdims=True):
        irradiance = [
            np.maximum(surfels.normals @ s, 0.0)
            * light_visibility(distance, surfels.points, surfels.normals, s, near, far)
            for surfels in pairs
        ]
        for share in CANDIDATE_SHARES:
            first_log, second_log = (np.log(1.0 - share + share * each) for each in irradiance)
            error = float(
                ((np.clip(second_log - first_log, -MAX_LOG_CHANGE, MAX_LOG_CHANGE) - observed) ** 2).mean()
            )
            if error < lowest_error:
                best, lowest_error = (s, float(share)), error
    zero_error = float((observed**2).mean())
    if (
        best is None
        or best[1] < MIN_LIGHT_SHARE
        or lowest_error > (1.0 - MIN_EXPLAINED_ERROR_SHARE) * zero_error
    ):
        return None
    x, y, z = (float(value) for value in best[0])
    return DirectionalLight((x, y, z), best[1], near, far)


def hemisphere_directions() -> Array:
    """DIRECTION_COUNT unit vectors [D,3], evenly over the upper half of a sphere."""
    number = np.arange(DIRECTION_COUNT)
    height = 0.1 + 0.9 * (number + 0.5) / DIRECTION_COUNT
    angle = np.pi * (3.0 - np.sqrt(5.0)) * number
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)
