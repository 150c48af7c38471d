"""Morphology of masks [X,Y,Z], and filters of a grid's values.

Dilations and distances are computed on the part of a grid around a mask: most of a block is far from a part.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.compute.parallel_parts import map_parts
from cagefield.typing import Array, Float32, Mask

SLAB_VALUES = 1 << 18
"""Values of a slab, between which a filter can be cancelled."""


def slices_around(mask: Mask, margin: int) -> tuple[slice, ...]:
    """Slices of the vertices of a mask [X,Y,Z] with a margin of vertices; empty ones without a vertex."""
    slices = []
    for axis, size in enumerate(mask.shape):
        others = tuple(other for other in range(mask.ndim) if other != axis)
        found = np.flatnonzero(mask.any(axis=others))
        first, last = (int(found[0]), int(found[-1])) if len(found) else (margin, -margin - 1)
        slices.append(slice(max(first - margin, 0), min(last + margin + 1, size)))
    return tuple(slices)


def dilate(mask: Mask, iterations: int) -> Mask:
    """`ndimage.binary_dilation` of a mask [X,Y,Z]."""
    around = slices_around(mask, iterations)
    dilated = np.zeros(mask.shape, bool)
    if mask[around].size:
        dilated[around] = ndimage.binary_dilation(mask[around], iterations=iterations)
    return dilated


def distances_near(mask: Mask, coordinates: Array, reach: float) -> NDArray[np.float64]:
    """Distances [N] of block coordinates [N,3] from a mask [X,Y,Z], in vertices; inf from `reach` on.

    Interpolated between vertices, as those beyond the mask's block are at its rim.
    """
    distances = np.full(len(coordinates), np.inf)
    around = slices_around(mask, int(np.ceil(reach)) + 2)
    if not mask[around].size:
        return distances
    first = np.array([each.start for each in around])
    last = np.array([each.stop for each in around]) - 1
    clipped = np.clip(coordinates, 0.0, np.array(mask.shape) - 1.0)
    rows = np.flatnonzero(((clipped >= first) & (clipped <= last)).all(axis=1))
    field = ndimage.distance_transform_edt(~mask[around])
    found = ndimage.map_coordinates(field, (clipped[rows] - first).T, order=1, mode="nearest")
    distances[rows] = np.where(found < reach, found, np.inf)
    return distances


def close_gaps(mask: Mask) -> Mask:
    """`ndimage.binary_closing` of a mask [X,Y,Z] by 18 neighbors of a vertex, in a grid without an end."""
    padded = np.pad(mask, 2)
    return np.asarray(~_spread(~_spread(padded))[2:-2, 2:-2, 2:-2])


def _spread(mask: Mask) -> Mask:
    """Dilation of a mask [X,Y,Z] by 18 neighbors: the squares of 3 x 3 vertices in the three planes."""
    x, y = _spread_along(mask, 0), _spread_along(mask, 1)
    return np.asarray(_spread_along(x, 1) | _spread_along(x | y, 2))


def _spread_along(mask: Mask, axis: int) -> Mask:
    """Dilation of a mask [X,Y,Z] by one vertex to both sides along an axis."""
    spread, along = mask.copy(), np.moveaxis(mask, axis, 0)
    moved = np.moveaxis(spread, axis, 0)
    moved[1:] |= along[:-1]
    moved[:-1] |= along[1:]
    return spread


def fill_cavities(mask: Mask) -> Mask:
    """`ndimage.binary_fill_holes` of a mask [X,Y,Z]: without the empty vertices that reach its rim."""
    labels, _ = ndimage.label(np.pad(~mask, 1, constant_values=True))
    return np.asarray((labels != labels[0, 0, 0])[1:-1, 1:-1, 1:-1])


def map_slabs(function: Callable[[Float32], Float32], values: Float32, axis: int) -> Float32:
    """Function of values [X,Y,Z], which keeps their shape, on slabs across an axis, by all threads."""
    result = np.empty_like(values)
    source, target = np.moveaxis(values, axis, 0), np.moveaxis(result, axis, 0)

    def apply(part: slice) -> None:
        target[part] = np.moveaxis(function(np.moveaxis(source[part], 0, axis)), axis, 0)

    map_parts(apply, len(source), max(1, SLAB_VALUES * len(source) // max(values.size, 1)))
    return result
