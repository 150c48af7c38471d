"""Ambient occlusion in a field's colors, and its change under an edit.

The openness of a surface point p with normal n is

    o(p) = 1 - sum_r w_r max(0, 1 - D(p + r n) / r),

D the distance to the nearest solid, for a few radii r: a sum of occlusion terms. The weights w are fitted
to images of the field: the log colors of neighbors on a surface differ by texture, of either sign, and by
log o. Where the images say little, the weights stay near their prior. A field without contact shadows gets
weights near 0 and is left alone. 1 - sum w is the light that reaches the deepest corner.

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
from cagefield.compute.cancellation import check_cancelled
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array

RADII_DIAGONALS = (0.01, 0.02, 0.04, 0.08, 0.12)
"""Radii r, in diagonals of the field's content."""

PRIOR_WEIGHTS = (0.05, 0.2, 0.25, 0.2, 0.15)
"""Prior mean of the weights w: light from all around, of which little reaches the deepest corner."""

PRIOR_WEIGHT_DEVIATION = 0.2
"""Prior standard deviation of each weight."""

PRIOR_SUM_DEVIATION = 0.15
"""Prior standard deviation of the sum of the weights."""

REPEATS_PER_PAIR = 300.0
"""Number of pairs that count as one observation: neighbors, and other views, show the same texture."""

MIN_OPENNESS = 0.08
"""Minimum openness: darker colors are noise."""

MIN_WEIGHT_SUM = 0.1
"""Minimum sum of the weights of a field with contact shadows."""

MIN_FIT_SAMPLES = 150
"""Minimum number of pairs, and of solid vertices, for a fit."""

SURFEL_CELL_SHARE = 0.4
"""Edge of the cells to which surfels are downsampled, as a share of the smallest radius."""


@dataclass(frozen=True)
class LightModel:
    """Dependence of a field's colors on its geometry.

    Attributes:
        radii: the occlusion radii [R], world units.
        weights: their weights [R].
        diffuse: the diffuse term, None without one.
        directional: the dominant light, None without one; replaces `diffuse`.
    """

    radii: tuple[float, ...]
    weights: tuple[float, ...]
    diffuse: DiffuseLight | None = None
    directional: DirectionalLight | None = None

    @property
    def has_effect(self) -> bool:
        """Whether colors depend on openness, normals or a dominant light at all."""
        return self.directional is not None or self.diffuse is not None or sum(self.weights) > MIN_WEIGHT_SUM

    @property
    def max_radius(self) -> float:
        """Largest occlusion radius with an effect, world units; 0 without one."""
        return max((r for r, w in zip(self.radii, self.weights, strict=True) if w > 0.01), default=0.0)

    @property
    def shadow_directions(self) -> Array:
        """Directions [K,3] of cast shadows."""
        return np.zeros((0, 3)) if self.directional is None else -np.array([self.directional.direction])

    def log_light(self, around: Sequence[Surfels], surfels: Surfels) -> Array:
        """Log of the brightness [N] of surfels [N] among all the surfaces around."""
        check_cancelled()
        log = np.zeros(len(surfels.points))
        if sum(self.weights) > MIN_WEIGHT_SUM:
            log += self.log_openness(occlusion_terms(around, surfels, self.radii))
        log += self.log_diffuse(surfels)
        if self.directional is not None:
            log += self.directional.log_light(
                build_distance_grid(around, SURFEL_CELL_SHARE * self.directional.near),
                surfels.points,
                surfels.normals,
            )
        return log

    def log_light_change(self, around: Surfels, added: Surfels, surfels: Surfels) -> Array:
        """Log ratio of the light [N] on surfels [N] among `around` and `added` to that among `around` alone.

        Openness is evaluated only where `added` occludes.
        """
        check_cancelled()
        log = np.zeros(len(surfels.points))
        if sum(self.weights) > MIN_WEIGHT_SUM:
            terms = added.occlusion_terms(surfels, self.radii)
            rows = np.flatnonzero(terms.any(axis=1))
            before = around.occlusion_terms(surfels.take(rows), self.radii)
            log[rows] = self.log_openness(np.maximum(before, terms[rows])) - self.log_openness(before)
        if self.directional is not None:
            edge = SURFEL_CELL_SHARE * self.directional.near
            for sign, surfaces in ((1.0, [around, added]), (-1.0, [around])):
                log += sign * self.directional.log_light(
                    build_distance_grid(surfaces, edge), surfels.points, surfels.normals
                )
        return log

    def log_diffuse(self, surfels: Surfels) -> Array:
        """Diffuse term [N] of `log_light`, a function of the normals of surfels [N]."""
        return (
            np.zeros(len(surfels.points)) if self.diffuse is None else self.diffuse.log_light(surfels.normals)
        )

    def log_openness(self, terms: Array) -> Array:
        """log o [N], o at least MIN_OPENNESS, of occlusion terms [N,R]."""
        return np.asarray(np.log(np.maximum(1.0 - terms @ np.array(self.weights), MIN_OPENNESS)))


def occlusion_terms(around: Sequence[Surfels], surfels: Surfels, radii: Sequence[float]) -> Array:
    """Occlusion terms max(0, 1 - D(p + r n) / r) [N,R] at surfels (p, n) [N], for radii r."""
    check_cancelled()
    return np.asarray(np.max([each.occlusion_terms(surfels, radii) for each in around], axis=0))


def _solid_vertices(field: VoxelField) -> NDArray[np.int64]:
    """Linear indices [N] of the solid vertices of a field."""
    return np.asarray(field.vertices[field.density * field.sample_spacing > SOLID_OPTICAL_DEPTH])


def occlusion_radii(field: VoxelField) -> tuple[float, ...]:
    """Occlusion radii of a field, world units: shares of the diagonal of its solid vertices.

    Empty for a field with fewer than MIN_FIT_SAMPLES solid vertices.
    """
    solid = _solid_vertices(field)
    if len(solid) < MIN_FIT_SAMPLES:
        return ()
    vertices = np.stack(np.unravel_index(solid[:: max(1, len(solid) // 100_000)], field.resolution), axis=1)
    span = np.subtract(*np.percentile(vertices, [99, 1], axis=0)) * field.voxel_size
    return tuple(share * float(np.linalg.norm(span)) for share in RADII_DIAGONALS)


def fit_light_model(field: VoxelField, visibility: CameraVisibility) -> LightModel:
    """Light model whose weights explain the visible colors of a field.

    Without diffuse and directional terms; without radii for a field with too few pairs or solid vertices.
    """
    pairs = visibility.pairs
    if len(pairs.log_change) < MIN_FIT_SAMPLES or _solid_vertices(field).size < MIN_FIT_SAMPLES:
        return LightModel((), ())
    radii = occlusion_radii(field)
    around = [visibility.surface.downsample(SURFEL_CELL_SHARE * radii[0])]
    first, second = (occlusion_terms(around, surfels, radii) for surfels in (pairs.first, pairs.second))
    change = pairs.log_change

    prior = np.array(PRIOR_WEIGHTS)
    noise = estimate_noise(change)

    def residuals(weights: Array) -> Array:
        model = LightModel(radii, tuple(weights))
        residual = (model.log_openness(second) - model.log_openness(first) - change) / noise
        sum_residual = (weights.sum() - prior.sum()) / PRIOR_SUM_DEVIATION
        return np.concatenate(
            [
                charbonnier_residuals(residual) / np.sqrt(REPEATS_PER_PAIR),
                (weights - prior) / PRIOR_WEIGHT_DEVIATION,
                [sum_residual],
            ]
        )

    fit = optimize.least_squares(residuals, prior, bounds=(0.0, 1.0))
    share = min(1.0, (1.0 - MIN_OPENNESS) / max(float(fit.x.sum()), 1e-9))
    return LightModel(radii, tuple(float(w) * share for w in fit.x))


def with_diffuse_light(model: LightModel, field: VoxelField, visibility: CameraVisibility) -> LightModel:
    """Light model with a diffuse term, if one explains enough of the changes that openness leaves."""
    radii = occlusion_radii(field)
    if not radii:
        return model
    pairs = sample_normal_pairs(visibility, radii[1:4])
    change = pairs.log_change - _occlusion_change(model, visibility, radii, pairs)
    return replace(model, diffuse=fit_diffuse_light(pairs.first, pairs.second, change))


def _occlusion_change(
    model: LightModel, visibility: CameraVisibility, radii: Sequence[float], pairs: SurfacePairs | NormalPairs
) -> Array:
    """Changes of log color [N] of pairs that openness explains."""
    check_cancelled()
    if sum(model.weights) <= MIN_WEIGHT_SUM:
        return np.zeros(len(pairs.log_change))
    around = [visibility.surface.downsample(SURFEL_CELL_SHARE * radii[0])]
    first, second = (occlusion_terms(around, surfels, radii) for surfels in (pairs.first, pairs.second))
    return model.log_openness(second) - model.log_openness(first)


def with_directional_light(
    model: LightModel, field: VoxelField, visibility: CameraVisibility, direction: Sequence[float] | None
) -> LightModel:
    """Light model with the dominant light that explains the changes that openness leaves, if one does.

    `direction` [3] points to the light; None to search it.
    """
    radii, pairs = occlusion_radii(field), visibility.pairs
    if len(pairs.log_change) < MIN_FIT_SAMPLES or not radii:
        return model
    change = pairs.log_change - _occlusion_change(model, visibility, radii, pairs)
    distance = build_distance_grid([visibility.surface], radii[0])
    light = fit_directional_light(distance, pairs.first, pairs.second, change, radii, direction)
    return model if light is None else replace(model, diffuse=None, directional=light)
