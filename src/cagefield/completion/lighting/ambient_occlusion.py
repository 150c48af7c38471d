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

from cagefield.completion.lighting.diffuse_irradiance import (
    DiffuseLight,
    NormalPairs,
    fit_diffuse_light,
    sample_normal_pairs,
)
from cagefield.completion.lighting.directional_light import DirectionalLight, fit_directional_light
from cagefield.completion.surfaces.charbonnier import charbonnier_residuals, estimate_noise
from cagefield.completion.surfaces.grid_block import SOLID_OPTICAL_DEPTH
from cagefield.completion.surfaces.surfels import Surfels, build_distance_grid
from cagefield.completion.surfaces.visibility import CameraVisibility, SurfacePairs
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array

RADII_DIAGONALS = (0.01, 0.02, 0.04, 0.08, 0.12)
"""The reaches r, shares of the diagonal of what the field holds."""

PRIOR_WEIGHTS = (0.05, 0.2, 0.25, 0.2, 0.15)
"""Prior mean of the weights w: light from all around, of which little reaches the deepest corner."""

PRIOR_WEIGHT_DEVIATION = 0.2
"""Prior standard deviation of each weight."""

PRIOR_SUM_DEVIATION = 0.15
"""Prior standard deviation of the sum of the weights."""

REPEATS_PER_PAIR = 1000.0
"""Pairs that count as one: neighbours, and other views, see the same texture."""

MIN_OPENNESS = 0.08
"""Least openness that counts: colours that are darker still are noise."""

MIN_WEIGHT_SUM = 0.1
"""Sum of the weights from which on contact shadows are there."""

MIN_FIT_SAMPLES = 150
"""Pairs from which weights are fitted, at least."""

SURFEL_CELL_SHARE = 0.4
"""Cells of surfaces that light is found out about with, as a share of the smallest reach."""


@dataclass(frozen=True)
class LightModel:
    """How a field's colours follow its openness: reaches [R] in world units, and their weights [R].

    And where what faces is brighter, and its dominant light, where that is to go along: that tells of both.
    """

    reaches: tuple[float, ...]
    weights: tuple[float, ...]
    facing: DiffuseLight | None = None
    sun: DirectionalLight | None = None

    @property
    def shows(self) -> bool:
        """False where colours follow neither openness nor where they face nor a light."""
        return self.sun is not None or self.facing is not None or sum(self.weights) > MIN_WEIGHT_SUM

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
        if sum(self.weights) > MIN_WEIGHT_SUM:
            log += self.log_openness(occlusion_terms(around, at, self.reaches))
        log += self.log_facing(at)
        if self.sun is not None:
            log += self.sun.log_light(
                build_distance_grid(around, SURFEL_CELL_SHARE * self.sun.near), at.points, at.normals
            )
        return log

    def log_facing(self, at: Surfels) -> Array:
        """The share of that which is due to where they face."""
        return np.zeros(len(at.points)) if self.facing is None else self.facing.log_light(at.normals)

    def log_openness(self, occlusion_terms: Array) -> Array:
        """log o [N], o at least DARKEST, of nearnesses [N,R]."""
        return np.asarray(np.log(np.maximum(1.0 - occlusion_terms @ np.array(self.weights), MIN_OPENNESS)))


def occlusion_terms(around: Sequence[Surfels], at: Surfels, reaches: Sequence[float]) -> Array:
    """max(0, 1 - D(p + r n) / r) [N,R] at surface elements (p, n) [N], for each reach r."""
    return np.asarray(np.max([each.nearness(at, reaches) for each in around], axis=0))


def _solid_vertices(field: VoxelField) -> NDArray[np.int64]:
    return np.asarray(field.vertices[field.density * field.sample_spacing > SOLID_OPTICAL_DEPTH])


def occlusion_radii(field: VoxelField) -> tuple[float, ...]:
    """The reaches r at which a field's colours are compared with its openness, world units.

    Shares of the diagonal of what is solid; none for a field of less than ENOUGH solid vertices.
    """
    solid = _solid_vertices(field)
    if len(solid) < MIN_FIT_SAMPLES:
        return ()
    at = np.stack(np.unravel_index(solid[:: max(1, len(solid) // 100_000)], field.resolution), axis=1)
    span = np.subtract(*np.percentile(at, [99, 1], axis=0)) * field.voxel_size
    return tuple(share * float(np.linalg.norm(span)) for share in RADII_DIAGONALS)


def fit_light_model(field: VoxelField, sight: CameraVisibility) -> LightModel:
    """The weights that explain the colours of a field's surfaces, as they are seen."""
    pairs = sight.pairs
    if len(pairs.log_change) < MIN_FIT_SAMPLES or _solid_vertices(field).size < MIN_FIT_SAMPLES:
        return LightModel((), ())
    reaches = occlusion_radii(field)
    around = [sight.surface.thinned(SURFEL_CELL_SHARE * reaches[0])]
    first, second = (occlusion_terms(around, at, reaches) for at in (pairs.first, pairs.second))
    change = pairs.log_change

    usual = np.array(PRIOR_WEIGHTS)
    noise = estimate_noise(change)

    def residuals(weights: Array) -> Array:
        ambience = LightModel(reaches, tuple(weights))
        told = (ambience.log_openness(second) - ambience.log_openness(first) - change) / noise
        corner = (weights.sum() - usual.sum()) / PRIOR_SUM_DEVIATION
        return np.concatenate(
            [
                charbonnier_residuals(told) / np.sqrt(REPEATS_PER_PAIR),
                (weights - usual) / PRIOR_WEIGHT_DEVIATION,
                [corner],
            ]
        )

    fit = optimize.least_squares(residuals, usual, bounds=(0.0, 1.0))
    share = min(1.0, (1.0 - MIN_OPENNESS) / max(float(fit.x.sum()), 1e-9))
    return LightModel(reaches, tuple(float(w) * share for w in fit.x))


def with_diffuse_light(ambience: LightModel, field: VoxelField, sight: CameraVisibility) -> LightModel:
    """The ambience, and what where surfaces face makes of the rest, if it makes much."""
    reaches = occlusion_radii(field)
    if not reaches:
        return ambience
    pairs = sample_normal_pairs(sight, reaches[1:4])
    change = pairs.log_change - _occlusion_change(ambience, sight, reaches, pairs)
    return replace(ambience, facing=fit_diffuse_light(pairs.first, pairs.second, change))


def _occlusion_change(
    ambience: LightModel, sight: CameraVisibility, reaches: Sequence[float], pairs: SurfacePairs | NormalPairs
) -> Array:
    """The changes of log colour [N] of pairs that openness explains."""
    if sum(ambience.weights) <= MIN_WEIGHT_SUM:
        return np.zeros(len(pairs.log_change))
    around = [sight.surface.thinned(SURFEL_CELL_SHARE * reaches[0])]
    first, second = (occlusion_terms(around, at, reaches) for at in (pairs.first, pairs.second))
    return ambience.log_openness(second) - ambience.log_openness(first)


def with_directional_light(
    ambience: LightModel, field: VoxelField, sight: CameraVisibility, direction: Sequence[float] | None
) -> LightModel:
    """The ambience and the dominant light that explains what openness does not, if one does.

    `direction` [3] is that to the light, None where it is to be found.
    """
    reaches, pairs = occlusion_radii(field), sight.pairs
    if len(pairs.log_change) < MIN_FIT_SAMPLES or not reaches:
        return ambience
    change = pairs.log_change - _occlusion_change(ambience, sight, reaches, pairs)
    distance = build_distance_grid([sight.surface], reaches[0])
    sun = fit_directional_light(distance, pairs.first, pairs.second, change, reaches, direction)
    return ambience if sun is None else replace(ambience, facing=None, sun=sun)
