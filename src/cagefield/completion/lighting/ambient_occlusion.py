"""Ambient occlusion as it shows in a field's colours, and what moved content makes of it.

The openness of a surface point p with normal n is

    o(p) = 1 - sum_r w_r max(0, 1 - D(p + r n) / r),

D the distance to the nearest solid, for a few reaches r: how much nearer other surfaces are than open space.
The weights w are fitted to the field, as it is seen: between neighbours on a surface, log colour differs by
texture, of either sign, and by log o. Where that says little, weights stay near usual ones. A field without
contact shadows gets weights near 0, and then nothing is changed. Weights that add up to less than 1 leave
the light that reaches the deepest corner.

Source: Evans, "Fast approximations for global illumination on dynamic scenes" (2006), for the openness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from cagefield.completion.lighting.diffuse_irradiance import Facing, TurnedPairs, facing_of, turned_pairs
from cagefield.completion.lighting.directional_light import Sun, sun_of
from cagefield.completion.surfaces.charbonnier import noise_of, softened
from cagefield.completion.surfaces.grid_block import SOLID
from cagefield.completion.surfaces.surfels import Surfels, gridded
from cagefield.completion.surfaces.visibility import SeenPairs, Sight
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array

REACHES = (0.01, 0.02, 0.04, 0.08, 0.12)
"""The reaches r, shares of the diagonal of what the field holds."""

USUAL, SPREAD, CORNER = (0.05, 0.2, 0.25, 0.2, 0.15), 0.2, 0.15
"""Weights that are usual where light comes from all around: little of it is left in the deepest corner. And
the standard deviations of each and of their sum."""

ALIKE = 1000.0
"""Pairs that count as one: neighbours, and other views, see the same texture."""

DARKEST = 0.08
"""Least openness that counts: colours that are darker still are noise."""

SHOWING = 0.1
"""Sum of the weights from which on contact shadows are there."""

ENOUGH = 150
"""Pairs from which weights are fitted, at least."""

FINE = 0.4
"""Cells of surfaces that light is found out about with, as a share of the smallest reach."""


@dataclass(frozen=True)
class Ambience:
    """How a field's colours follow its openness: reaches [R] in world units, and their weights [R].

    And where what faces is brighter, and its dominant light, where that is to go along: that tells of both.
    """

    reaches: tuple[float, ...]
    weights: tuple[float, ...]
    facing: Facing | None = None
    sun: Sun | None = None

    @property
    def shows(self) -> bool:
        """False where colours follow neither openness nor where they face nor a light."""
        return self.sun is not None or self.facing is not None or sum(self.weights) > SHOWING

    @property
    def reach(self) -> float:
        """The largest distance, in world units, at which it makes a difference; 0 where it shows nowhere."""
        return max((r for r, w in zip(self.reaches, self.weights, strict=True) if w > 0.01), default=0.0)

    @property
    def falls(self) -> Array:
        """Directions [K,3] in which shadows fall that go along."""
        return np.zeros((0, 3)) if self.sun is None else -np.array([self.sun.direction])

    def log_light(self, around: Sequence[Surfels], at: Surfels) -> Array:
        """The log of how bright surface elements [N] are among all the surfaces around, [N]."""
        log = np.zeros(len(at.points))
        if sum(self.weights) > SHOWING:
            log += self.log_openness(nearness(around, at, self.reaches))
        log += self.log_facing(at)
        if self.sun is not None:
            log += self.sun.log_light(gridded(around, FINE * self.sun.near), at.points, at.normals)
        return log

    def log_facing(self, at: Surfels) -> Array:
        """The share of that which is due to where they face."""
        return np.zeros(len(at.points)) if self.facing is None else self.facing.log_light(at.normals)

    def log_openness(self, nearness: Array) -> Array:
        """log o [N], o at least DARKEST, of nearnesses [N,R]."""
        return np.asarray(np.log(np.maximum(1.0 - nearness @ np.array(self.weights), DARKEST)))


def nearness(around: Sequence[Surfels], at: Surfels, reaches: Sequence[float]) -> Array:
    """max(0, 1 - D(p + r n) / r) [N,R] at surface elements (p, n) [N], for each reach r."""
    return np.asarray(np.max([each.nearness(at, reaches) for each in around], axis=0))


def _solid_vertices(field: VoxelField) -> NDArray[np.int64]:
    return np.asarray(field.vertices[field.density * field.sample_spacing > SOLID])


def reaches_of(field: VoxelField) -> tuple[float, ...]:
    """The reaches r at which a field's colours are compared with its openness, world units.

    Shares of the diagonal of what is solid; none for a field of less than ENOUGH solid vertices.
    """
    solid = _solid_vertices(field)
    if len(solid) < ENOUGH:
        return ()
    at = np.stack(np.unravel_index(solid[:: max(1, len(solid) // 100_000)], field.resolution), axis=1)
    span = np.subtract(*np.percentile(at, [99, 1], axis=0)) * field.voxel_size
    return tuple(share * float(np.linalg.norm(span)) for share in REACHES)


def ambience_of(field: VoxelField, sight: Sight) -> Ambience:
    """The weights that explain the colours of a field's surfaces, as they are seen."""
    pairs = sight.pairs
    if len(pairs.log_change) < ENOUGH or _solid_vertices(field).size < ENOUGH:
        return Ambience((), ())
    reaches = reaches_of(field)
    around = [sight.surface.thinned(FINE * reaches[0])]
    first, second = (nearness(around, at, reaches) for at in (pairs.first, pairs.second))
    change = pairs.log_change

    usual = np.array(USUAL)
    noise = noise_of(change)

    def residuals(weights: Array) -> Array:
        ambience = Ambience(reaches, tuple(weights))
        told = (ambience.log_openness(second) - ambience.log_openness(first) - change) / noise
        corner = (weights.sum() - usual.sum()) / CORNER
        return np.concatenate([softened(told) / np.sqrt(ALIKE), (weights - usual) / SPREAD, [corner]])

    fit = optimize.least_squares(residuals, usual, bounds=(0.0, 1.0))
    share = min(1.0, (1.0 - DARKEST) / max(float(fit.x.sum()), 1e-9))
    return Ambience(reaches, tuple(float(w) * share for w in fit.x))


def with_facing(ambience: Ambience, field: VoxelField, sight: Sight) -> Ambience:
    """The ambience, and what where surfaces face makes of the rest, if it makes much."""
    reaches = reaches_of(field)
    if not reaches:
        return ambience
    pairs = turned_pairs(sight, reaches[1:4])
    change = pairs.log_change - _told(ambience, sight, reaches, pairs)
    return replace(ambience, facing=facing_of(pairs.first, pairs.second, change))


def _told(
    ambience: Ambience, sight: Sight, reaches: Sequence[float], pairs: SeenPairs | TurnedPairs
) -> Array:
    """The changes of log colour [N] of pairs that openness explains."""
    if sum(ambience.weights) <= SHOWING:
        return np.zeros(len(pairs.log_change))
    around = [sight.surface.thinned(FINE * reaches[0])]
    first, second = (nearness(around, at, reaches) for at in (pairs.first, pairs.second))
    return ambience.log_openness(second) - ambience.log_openness(first)


def with_sun(
    ambience: Ambience, field: VoxelField, sight: Sight, direction: Sequence[float] | None
) -> Ambience:
    """The ambience and the dominant light that explains what openness does not, if one does.

    `direction` [3] is that to the light, None where it is to be found.
    """
    reaches, pairs = reaches_of(field), sight.pairs
    if len(pairs.log_change) < ENOUGH or not reaches:
        return ambience
    change = pairs.log_change - _told(ambience, sight, reaches, pairs)
    distance = gridded([sight.surface], reaches[0])
    sun = sun_of(distance, pairs.first, pairs.second, change, reaches, direction)
    return ambience if sun is None else replace(ambience, facing=None, sun=sun)
