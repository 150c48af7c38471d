"""Extent of splats beyond their means: images change within this distance of edited points."""

from __future__ import annotations

import numpy as np

from cagefield.fields.splat_field import SplatField

SPLAT_EXTENT_QUANTILE = 0.95
"""Share of a field's opacity in splats that reach no farther than `spread`."""


def splat_extent(field: SplatField) -> float:
    """How far from its mean a splat shows, world units: all but the largest ones, weighted by opacity.

    Up to three standard deviations, where a hundredth of its opacity is left.
    """
    inside = ((field.means >= field.bounds[0]) & (field.means <= field.bounds[1])).all(axis=1)
    weights = np.where(inside, field.opacities, 0.0).astype(np.float64)
    if not weights.sum() > 0.0:
        return 0.0
    largest = field.log_scales.max(axis=1)
    order = np.argsort(largest)
    at = np.searchsorted(np.cumsum(weights[order]), SPLAT_EXTENT_QUANTILE * weights.sum())
    return 3.0 * float(np.exp(np.float64(largest[order[min(at, len(order) - 1)]])))
