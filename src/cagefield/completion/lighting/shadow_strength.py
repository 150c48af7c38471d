"""Strength of a part's contact shadow on its support, fitted to the support around the part.

A `LightModel` is fitted to the surfaces of a whole field, which light reaches in many ways. Around one part
its shade is multiplied by the strength s that best explains the photographed log brightness g of its
support,

    g(p) = a + b . p + log o'(p) - s (log o'(p) - log o(p)),

o the openness with the part, o' without it. a and b are the texture's, and so are the residuals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.surfaces.charbonnier import estimate_noise
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.support_plane import PLANE_DISTANCE_VOXELS, Support
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.compute.cancellation import check_cancelled
from cagefield.geometry.cage import Cage

PRIOR_STRENGTH_DEVIATION = 0.3
"""Prior standard deviation of strengths, about 1."""

MIN_STRENGTH = 0.5
"""Minimum strength."""

MAX_STRENGTH = 2.0
"""Maximum strength."""

MAX_STRENGTH_SURFELS = 6000
"""Maximum number of surfels for the fit."""

MIN_SUPPORT_COSINE = 0.9
"""Minimum cosine between a surfel's normal and the support's."""

MAX_LOG_SHADE = 0.8
"""Shade (log) up to which photos measure brightness."""

TEXTURE_CELL_VOXELS = 8.0
"""Edge of cells of one texture, voxels."""

FIT_ROUNDS = 6
"""Rounds of iteratively reweighted least squares."""

FIT_HUBER_DEVIATIONS = 1.5
"""Threshold of the Huber weights, standard deviations of the residuals."""


def fit_shadow_strength(
    part: Surfels,
    others: Surfels,
    block: GridBlock,
    inner: Cage,
    visibility: CameraVisibility | None,
    model: LightModel,
    support: Support,
    *,
    seed: int = 0,
) -> float:
    """Strength of a part's contact shadow on its support; 1 where the images say nothing.

    part, others: surfels of the part, and of all else, in a block; inner: V^c; visibility: the field's
    visible surfaces.
    """
    check_cancelled()
    if visibility is None or not len(part.points):
        return 1.0
    near_rows = np.flatnonzero(part.distance(visibility.surface.points, model.max_radius) < model.max_radius)
    surfels, log_brightness = visibility.surface.take(near_rows), visibility.log_brightness[near_rows]
    coordinates = block.block_coordinates(surfels.points)
    uv, height = support.to_local(coordinates)
    support_rows = np.flatnonzero(
        (np.abs(height) < PLANE_DISTANCE_VOXELS) & (surfels.normals @ support.normal > MIN_SUPPORT_COSINE)
    )
    if len(support_rows) > MAX_STRENGTH_SURFELS:
        support_rows = np.random.default_rng(seed).choice(support_rows, MAX_STRENGTH_SURFELS, replace=False)
    surfels, log_brightness, uv = surfels.take(support_rows), log_brightness[support_rows], uv[support_rows]
    # Without the diffuse term: the support is flat, and its normals are rough.
    model = replace(model, diffuse=None)
    log_without_part = model.log_light([others], surfels)
    log_shade = log_without_part - model.log_light([others, part], surfels)
    is_used = (log_shade < MAX_LOG_SHADE) & ~inner.contains(surfels.points)
    if is_used.sum() < 3:
        return 1.0
    log_shade, uv, log_brightness = (
        log_shade[is_used],
        uv[is_used],
        (log_brightness - log_without_part)[is_used],
    )
    # Surfels in one cell of texture, and those from several cameras, count as one observation.
    share = len(np.unique(np.floor(uv / TEXTURE_CELL_VOXELS), axis=0)) / len(log_shade)
    table = np.column_stack([-log_shade, np.ones(len(log_shade)), (uv - uv.mean(axis=0)) / np.ptp(uv)])
    weight, solution = (
        np.ones(len(log_shade)),
        np.array([1.0, float(np.median(log_brightness + log_shade)), 0.0, 0.0]),
    )
    for _ in range(FIT_ROUNDS):
        residuals = log_brightness - table @ solution
        noise = estimate_noise(residuals)
        weight = share / np.maximum(1.0, np.abs(residuals) / (FIT_HUBER_DEVIATIONS * noise)) / noise**2
        normal = table.T @ (weight[:, None] * table) + np.diag([PRIOR_STRENGTH_DEVIATION**-2, 1e-9, 1.0, 1.0])
        target = table.T @ (weight * log_brightness) + np.array([PRIOR_STRENGTH_DEVIATION**-2, 0.0, 0.0, 0.0])
        solution = np.linalg.solve(normal, target)
    return float(np.clip(solution[0], MIN_STRENGTH, MAX_STRENGTH))
