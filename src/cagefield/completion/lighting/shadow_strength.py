"""How strong a part's shade is on what it stands on: measured there, around it.

`Ambience` is fitted to the whole field, to surfaces of all kinds, which light reaches in other ways. Around
one part its shade is multiplied by the strength s that explains best how the photographed brightness g of its
support goes down towards it,

    g(p) = a + b . p + log o'(p) - s (log o'(p) - log o(p)),

o the openness with the part, o' without it; a and b are the texture's, and so is what is left over.
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
from cagefield.geometry.cage import Cage

PRIOR_STRENGTH_DEVIATION = 0.3
"""Standard deviation of strengths, about 1."""

MIN_STRENGTH = 0.5
"""Minimum strength."""

MAX_STRENGTH = 2.0
"""Maximum strength."""

MAX_STRENGTH_SURFELS = 6000
"""Surface elements that are looked at, at most."""

MIN_SUPPORT_COSINE = 0.9
"""Least cosine between their normals and the support's."""

MAX_LOG_SHADE = 0.8
"""Shade (log) up to which photographs tell how bright it is."""

TEXTURE_CELL_VOXELS = 8.0
"""Edge of cells in which texture is the same, voxels."""

FIT_ROUNDS = 6
"""Rounds of iteratively reweighted least squares."""

FIT_HUBER_DEVIATIONS = 1.5
"""Threshold of the Huber weights, standard deviations of the residuals."""


def fit_shadow_strength(
    part: Surfels,
    others: Surfels,
    block: GridBlock,
    inner: Cage,
    sight: CameraVisibility | None,
    ambience: LightModel,
    support: Support,
    *,
    seed: int = 0,
) -> float:
    """The strength of the shade of a part on its support: 1 where photographs say nothing."""
    if sight is None or not len(part.points):
        return 1.0
    near = np.flatnonzero(part.distance(sight.surface.points, ambience.reach) < ambience.reach)
    seen, bright = sight.surface.take(near), sight.bright[near]
    at = block.coordinates(seen.points)
    along, height = support.local(at)
    on = np.flatnonzero(
        (np.abs(height) < PLANE_DISTANCE_VOXELS) & (seen.normals @ support.normal > MIN_SUPPORT_COSINE)
    )
    if len(on) > MAX_STRENGTH_SURFELS:
        on = np.random.default_rng(seed).choice(on, MAX_STRENGTH_SURFELS, replace=False)
    seen, bright, along = seen.take(on), bright[on], along[on]
    # The support faces one way, whatever its rough normals say.
    ambience = replace(ambience, facing=None)
    alone = ambience.log_light([others], seen)
    shade = alone - ambience.log_light([others, part], seen)
    kept = (shade < MAX_LOG_SHADE) & ~inner.contains(seen.points)
    if kept.sum() < 3:
        return 1.0
    shade, along, bright = shade[kept], along[kept], (bright - alone)[kept]
    # What is on one texture's patch, and what several cameras see, counts once.
    share = len(np.unique(np.floor(along / TEXTURE_CELL_VOXELS), axis=0)) / len(shade)
    table = np.column_stack([-shade, np.ones(len(shade)), (along - along.mean(axis=0)) / np.ptp(along)])
    weight, found = np.ones(len(shade)), np.array([1.0, float(np.median(bright + shade)), 0.0, 0.0])
    for _ in range(FIT_ROUNDS):
        left = bright - table @ found
        noise = estimate_noise(left)
        weight = share / np.maximum(1.0, np.abs(left) / (FIT_HUBER_DEVIATIONS * noise)) / noise**2
        normal = table.T @ (weight[:, None] * table) + np.diag([PRIOR_STRENGTH_DEVIATION**-2, 1e-9, 1.0, 1.0])
        target = table.T @ (weight * bright) + np.array([PRIOR_STRENGTH_DEVIATION**-2, 0.0, 0.0, 0.0])
        found = np.linalg.solve(normal, target)
    return float(np.clip(found[0], MIN_STRENGTH, MAX_STRENGTH))
