"""Layers: blocks of a voxel field's grid with a second content, beside the field's own.

A layer is a VoxelField on the field's grid (bounds, resolution, contracted) that stores the vertices of a
block, always including the block's first and last vertex. Renderers read it within that block only. On a
device the layers
follow the field: the index of the field's slots, x slowest, is continued by the blocks' slices, and the
*place* of a layer is the offset from a vertex's x to its x in that index. Places are multiples of
`BRICK_VERTICES`, so that bricks of vertices stay whole, and never 0.
"""

from __future__ import annotations

from collections.abc import Sequence

from cagefield.fields.voxel_field import VoxelField

BRICK_VERTICES = 8
"""Vertices along a brick of the page's GPU; see `pages.page_field`."""


def layer_slices(layer: VoxelField) -> tuple[int, int]:
    """(first, last + 1) slice along x of a layer's vertices, aligned to whole bricks.

    An empty slice precedes and follows the vertices.
    """
    if not len(layer.vertices):
        return 0, BRICK_VERTICES
    per_slice = layer.resolution[1] * layer.resolution[2]
    first, last = int(layer.vertices[0]) // per_slice, int(layer.vertices[-1]) // per_slice
    low = (first - 1) // BRICK_VERTICES * BRICK_VERTICES
    return low, low + -(-(last + 2 - low) // BRICK_VERTICES) * BRICK_VERTICES


def layer_x_offsets(layers: Sequence[VoxelField]) -> tuple[int, ...]:
    """Offset along x (place) of each layer; repeated layers share one."""
    places: dict[int, int] = {}
    next_slice = 0
    for layer in layers:
        if id(layer) in places:
            continue
        next_slice = next_slice or -(-layer.resolution[0] // BRICK_VERTICES) * BRICK_VERTICES
        low, high = layer_slices(layer)
        places[id(layer)] = next_slice - low
        next_slice += high - low
    return tuple(places[id(layer)] for layer in layers)
