"""Cells of a cage that hold splats, for fitting the cage to its content."""

from __future__ import annotations

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.server.editor.cage_placement import PROBES_PER_AXIS
from cagefield.typing import Mask

DENSE_CELL_OPACITY = 0.3
"""Opacity, of all splats that reach there together, from which on a probe's cell counts as dense."""

SAMPLED_SIGMAS = 1.5
"""Standard deviations from its mean up to which a splat is sampled: a third of its opacity is there."""

ACROSS = 7
"""Points across a splat, along each of its two larger axes."""


def dense_cells(cage: Cage, splats: DeformedSplats) -> Mask:
    """Mask [PROBES_PER_AXIS^3] of the cells around a cage's `probes` that splats make dense.

    Each splat is sampled on a grid of points in the plane of its two larger axes, up to `SAMPLED_SIGMAS`
    standard
    deviations. The transmittance of a cell is the product of its splats' transmittances, each at its densest
    point there.
    """
    low, high = cage.aabb
    full = splats.covariances[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    reach = SAMPLED_SIGMAS * np.sqrt(np.diagonal(full, axis1=1, axis2=2))
    near = ((splats.means + reach >= low) & (splats.means - reach <= high)).all(axis=1)
    rows = np.flatnonzero(near & (splats.opacities > 0.02))
    values, axes = np.linalg.eigh(full[rows].astype(np.float64))
    axes = axes[:, :, 1:] * np.sqrt(np.maximum(values[:, None, 1:], 0.0))
    steps = np.linspace(-SAMPLED_SIGMAS, SAMPLED_SIGMAS, ACROSS)
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[(grid**2).sum(axis=1) <= SAMPLED_SIGMAS**2 * (1.0 + 1e-9)]
    points = splats.means[rows].astype(np.float64)[:, None] + np.einsum("nij,kj->nki", axes, grid)
    alpha = splats.opacities[rows, None] * np.exp(-0.5 * (grid**2).sum(axis=1))
    u, inside = cage.coordinates(points.reshape(-1, 3))
    cells = np.minimum((u[inside] * PROBES_PER_AXIS).astype(np.int64), PROBES_PER_AXIS - 1)
    cell = (cells[:, 2] * PROBES_PER_AXIS + cells[:, 1]) * PROBES_PER_AXIS + cells[:, 0]
    # Of each splat, the highest alpha in a cell: the last one of those with the same key.
    alphas, splat = alpha.reshape(-1)[inside], np.repeat(np.arange(len(rows)), len(grid))[inside]
    order = np.lexsort((alphas, splat * PROBES_PER_AXIS**3 + cell))
    key = (splat * PROBES_PER_AXIS**3 + cell)[order]
    last = order[np.append(key[1:] != key[:-1], True)] if len(order) else order
    passed = np.bincount(cell[last], np.log1p(-np.minimum(alphas[last], 0.999)), PROBES_PER_AXIS**3)
    return np.asarray(-np.expm1(passed) >= DENSE_CELL_OPACITY)
