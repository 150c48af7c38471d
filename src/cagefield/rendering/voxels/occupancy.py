"""Which cells can be non-empty, as a grid of bricks that a ray can leap over.

A brick is 4 x 4 x 4 cells. Its code is an int32:

    1 ... 255          occupied; bit 4x + 2y + z says that the 2 x 2 x 2 sub-block (x, y, z) is occupied
    256 * D            empty, and so is every brick within Chebyshev distance D - 1, D in 1 ... 16

A ray in an empty brick leaves the cube of empty bricks around it in one leap; in an occupied brick it
leaves an empty sub-block in one leap. A cell counts as occupied when one of its 8 corners is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import UInt8

BRICK = 4
MAX_LEAP = 16
FEW = 4
"""Leaps up to which distances are found by growing."""

FULL = 255
"""Mask of a brick whose sub-blocks are all occupied."""


@dataclass(frozen=True, eq=False)
class Occupancy:
    """Codes of a grid of bricks.

    Attributes:
        origin: [3] int, grid coordinates of the first brick's first cell, multiples of 4 (negative where
            the brick grid reaches beyond the vertex grid).
        codes: [bx, by, bz] int32.
    """

    origin: NDArray[np.int64]
    codes: NDArray[np.int32]

    @classmethod
    def from_masks(cls, origin: NDArray[np.int64], masks: UInt8, leap: int = MAX_LEAP) -> Occupancy:
        """The occupancy of bricks with these masks; rays leap over at most `leap` bricks at a time."""
        return cls(origin, encode(masks, leap))

    @property
    def masks(self) -> UInt8:
        """[bx, by, bz], the bits of the occupied sub-blocks of each brick."""
        return self.codes.astype(np.uint8)

    @cached_property
    def blocks(self) -> NDArray[np.bool_]:
        """[2bx, 2by, 2bz], the occupied sub-blocks."""
        bits = np.unpackbits(self.masks[..., None], axis=-1, bitorder="little").astype(bool)
        x, y, z = self.codes.shape
        return bits.reshape(x, y, z, 2, 2, 2).transpose(0, 3, 1, 4, 2, 5).reshape(2 * x, 2 * y, 2 * z)


def masks_of(blocks: NDArray[np.bool_]) -> UInt8:
    """Masks [bx,by,bz] of occupied sub-blocks [2bx,2by,2bz]."""
    # Pairs along z, y, x become 2, 4, 8 bits of a byte.
    pairs = np.ascontiguousarray(blocks).view("<u2")
    rows = ((pairs & 1) | (pairs >> 7)).astype(np.uint8)
    faces = rows[:, 0::2] + np.uint8(4) * rows[:, 1::2]
    return np.asarray(faces[0::2] + np.uint8(16) * faces[1::2])


def encode(masks: UInt8, leap: int = MAX_LEAP) -> NDArray[np.int32]:
    """Codes [bx,by,bz] of bricks with these masks, D at most `leap`."""
    empty = masks == 0
    if empty.all():
        return np.full(masks.shape, 256 * leap, np.int32)
    distance = _few_distances(empty, leap) if leap <= FEW else _distances(empty, leap)
    return np.where(empty, np.int32(256) * distance, masks)


def _distances(empty: NDArray[np.bool_], most: int) -> NDArray[np.int32]:
    """Chebyshev distances to the nearest occupied cell, cells, at most `most`."""
    return np.minimum(ndimage.distance_transform_cdt(empty, metric="chessboard"), most).astype(np.int32)


def _few_distances(empty: NDArray[np.bool_], most: int) -> NDArray[np.uint8]:
    """Chebyshev distances as `_distances`, by dilation of the occupied cells; faster for a small `most`."""
    distance = empty.astype(np.uint8)
    near = ~empty
    for _ in range(1, most):
        for axis in range(3):
            grown = near.copy()
            to, off = [slice(None)] * 3, [slice(None)] * 3
            to[axis], off[axis] = slice(1, None), slice(None, -1)
            grown[tuple(to)] |= near[tuple(off)]
            grown[tuple(off)] |= near[tuple(to)]
            near = grown
        distance += ~near
    return distance


def of_field(field: VoxelField, threshold: float = 0.0) -> Occupancy:
    """The occupancy of a field: vertices whose density exceeds `threshold` occupy the 8 cells around them."""
    full = np.zeros(field.resolution, bool)
    full.reshape(-1)[field.vertices[field.density > threshold]] = True
    return of_vertices(full)


def of_vertices(full: NDArray[np.bool_]) -> Occupancy:
    """The occupancy of a grid [nx,ny,nz] of occupied vertices."""
    bricks = [-(-(n - 1) // BRICK) for n in full.shape]
    padded = np.zeros([n * BRICK + 1 for n in bricks], bool)
    padded[: full.shape[0], : full.shape[1], : full.shape[2]] = full
    # A sub-block of 2 cells touches the 3 vertices 2b, 2b+1, 2b+2 along each axis.
    for axis in range(3):
        even = np.take(padded, range(0, padded.shape[axis] - 1, 2), axis)
        odd = np.take(padded, range(1, padded.shape[axis], 2), axis)
        last = np.take(padded, range(2, padded.shape[axis], 2), axis)
        padded = even | odd | last
    return Occupancy.from_masks(np.zeros(3, np.int64), masks_of(padded))


def cubes(points: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The cubes of a lattice [count] of whose eight points [count + 1] one is set."""
    near = points[:-1] | points[1:]
    near = near[:, :-1] | near[:, 1:]
    return np.asarray(near[:, :, :-1] | near[:, :, 1:])
