"""Layers: parts of a voxel field's grid that have a second content, beside the field's own.

A layer is a VoxelField on the same grid (bounds, resolution, contracted) that stores vertices of a block,
the block's first and last one among them, also where these are empty. It is read in that block only. On a
device the layers of a field lie behind it: the index of the field's slots, x slowest, is continued by the
blocks' slices, and the *place* of a layer is what has to be added to a vertex's x to find it there.
Places are multiples of `ALIGNED`, so that bricks of vertices stay whole, and never 0.
"""

from __future__ import annotations

from collections.abc import Sequence

from cagefield.fields.voxel_field import VoxelField

ALIGNED = 8
"""Vertices along a brick of the page's GPU; see `pages.page_field`."""


def slices_of(layer: VoxelField) -> tuple[int, int]:
    """(first, last + 1) of the grid's slices along x that hold a layer's vertices, from a whole brick on.

    An empty slice lies on either side of the vertices.
    """
    if not len(layer.vertices):
        return 0, ALIGNED
    per_slice = layer.resolution[1] * layer.resolution[2]
    first, last = int(layer.vertices[0]) // per_slice, int(layer.vertices[-1]) // per_slice
    low = (first - 1) // ALIGNED * ALIGNED
    return low, low + -(-(last + 2 - low) // ALIGNED) * ALIGNED


def places_of(layers: Sequence[VoxelField]) -> tuple[int, ...]:
    """The place of each layer; one that is there several times has one place."""
    places: dict[int, int] = {}
    free = 0
    for layer in layers:
        if id(layer) in places:
            continue
        free = free or -(-layer.resolution[0] // ALIGNED) * ALIGNED
        low, high = slices_of(layer)
        places[id(layer)] = free - low
        free += high - low
    return tuple(places[id(layer)] for layer in layers)
