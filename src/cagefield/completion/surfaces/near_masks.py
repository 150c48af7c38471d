"""Morphology of masks on the part of a grid around them: most of a block is far from a part."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.typing import Array, Mask


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
