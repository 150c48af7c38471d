"""A layer of a voxel field (`fields.voxel_layers`) as the page's GPU draws it: where it is other than the
field.

Of a layer NAME there are, in a box of bricks that holds all vertices where it is other than the field,

    NAME.box     [2, 3] int32: the first of these bricks in the field's grid, and how many along each axis
    NAME.cells   [bricks of the box] uint8, of the bricks of *cells*: 0 as the field's, 1 other, 2 empty
    NAME.bricks, NAME.masks, NAME.density, NAME.sh   as in `page_field`, of these vertices in the box

Density and colors have the field's own units and steps, so that one texture holds both; colors beyond 127
of these steps are cut off.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import layer_slices
from cagefield.pages.page_field import BRICK, encode_vertices, quantized_colors, quantized_density
from cagefield.typing import Float32

AS_FIELD, OTHER, EMPTY = 0, 1, 2


@memoized_weakly
def layer_key(layer: VoxelField) -> str:
    """Digest of a layer's content."""
    return digest(layer.vertices, layer.density, layer.sh)


def bricks_of(layer: VoxelField, place: int) -> dict[str, int]:
    """Slices of bricks along x: the `place` of a layer, the `first` that it is read in, and their `end`."""
    low, high = layer_slices(layer)
    return {"place": place // BRICK, "first": low // BRICK, "end": high // BRICK}


def encode_layer(layer: VoxelField, field: VoxelField, name: str) -> dict[str, NDArray[Any]]:
    """The arrays of a layer of `field`, by their names in a file."""
    resolution = np.array(layer.resolution)
    vertices, density, sh = _other(layer, field)
    at = _positions(vertices, layer)
    low, dims = _box(at, resolution)
    size = (int(dims[0]) * BRICK, int(dims[1]) * BRICK, int(dims[2]) * BRICK)
    parts = encode_vertices(np.ravel_multi_index(tuple((at - low * BRICK).T), size), size, density, sh)
    changed = _cells(at, low, dims, resolution)
    dense = _cells(_positions(layer.vertices[layer.density > 0.0], layer), low, dims, resolution)
    cells = np.where(changed, np.where(dense, OTHER, EMPTY), AS_FIELD).astype(np.uint8)
    arrays: dict[str, NDArray[Any]] = {"box": np.stack([low, dims]).astype(np.int32), "cells": cells, **parts}
    return {f"{name}.{part}": array for part, array in arrays.items()}


def digest(*arrays: NDArray[Any]) -> str:
    """A name for the content of arrays."""
    content = hashlib.blake2b(digest_size=8)
    for array in arrays:
        content.update(np.ascontiguousarray(array).tobytes())
    return content.hexdigest()


def _other(
    layer: VoxelField, field: VoxelField
) -> tuple[NDArray[np.int64], NDArray[np.float16], NDArray[np.uint8]]:
    """(vertices [M], density [M], sh [M,K,3]), quantized, where a layer's block is other than the field.

    A vertex that the layer does not have is empty: density 0, gray.
    """
    # Two sorted runs, which a stable sort merges.
    vertices = np.sort(np.concatenate([layer.vertices, _in_block(layer, field)]), kind="stable")
    vertices = vertices[np.diff(vertices, prepend=-1) > 0]
    one, other = (_values(source, vertices) for source in (layer, field))
    apart = (one[0] != other[0]) | (one[1] != other[1]).any(axis=(1, 2))
    vertices = vertices[apart]
    density, old_density = (quantized_density(source[0][apart], field) for source in (one, other))
    sh, old_sh = (quantized_colors(source[1][apart], field) for source in (one, other))
    seen = (density != old_density) | (sh != old_sh).any(axis=(1, 2))
    return vertices[seen], density[seen], sh[seen]


def _in_block(layer: VoxelField, field: VoxelField) -> NDArray[np.int64]:
    """The field's vertices [N] in the block of a layer."""
    if not len(layer.vertices):
        return layer.vertices
    first, last = layer.vertices[[0, -1]]
    low, high = _positions(layer.vertices[[0, -1]], layer)
    vertices = field.vertices[slice(*np.searchsorted(field.vertices, [first, last + 1]))]
    at = _positions(vertices, field)
    return vertices[((at >= low) & (at <= high)).all(axis=1)]


def _values(source: VoxelField, vertices: NDArray[np.int64]) -> tuple[Float32, Float32]:
    """Density [N] and sh [N,K,3] at vertices; 0 where they are not stored."""
    slot = np.searchsorted(source.vertices, vertices)
    has = np.zeros(len(vertices), bool)
    has[slot < len(source.vertices)] = True
    has[has] = source.vertices[slot[has]] == vertices[has]
    density = np.zeros(len(vertices), np.float32)
    sh = np.zeros((len(vertices), *source.sh.shape[1:]), np.float32)
    density[has], sh[has] = source.density[slot[has]], source.sh[slot[has]]
    return density, sh


def _positions(vertices: NDArray[np.int64], field: VoxelField) -> NDArray[np.int64]:
    """Grid coordinates [N,3] of linear indices."""
    return np.stack(np.unravel_index(vertices, field.resolution), axis=1)


def _box(at: NDArray[np.int64], resolution: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(first brick [3], count [3]) of the bricks of vertices and of cells around vertices [N,3]."""
    if not len(at):
        return np.zeros(3, np.int64), np.ones(3, np.int64)
    low = np.maximum(at.min(axis=0) - 1, 0) // BRICK
    return low, at.max(axis=0) // BRICK - low + 1


def _cells(
    at: NDArray[np.int64], low: NDArray[np.int64], dims: NDArray[np.int64], resolution: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """[dims], which bricks of cells of a box have one of the vertices [N,3] at a cell."""
    found = np.zeros(dims, bool)
    at = at[((at >= low * BRICK) & (at <= (low + dims) * BRICK)).all(axis=1)]
    for corner in np.ndindex(2, 2, 2):
        # The cells on the lower sides of a vertex lie in another brick where it is the first one of its own.
        cell = at[(at[:, np.flatnonzero(corner)] % BRICK == 0).all(axis=1)] - np.array(corner)
        brick = cell // BRICK - low
        inside = (cell >= 0) & (cell < resolution - 1) & (brick >= 0) & (brick < dims)
        found[tuple(brick[inside.all(axis=1)].T)] = True
    return found
