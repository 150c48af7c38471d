"""Union of a grid block with the vertices of another range of the same grid.

Notation: vertices are numbered by the coordinates of one grid, in which block A has its `low`. Beyond the
grid of A's field, numbers go on: negative ones, and such from the resolution on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.compute.parallel_parts import run_both
from cagefield.typing import Mask

Extract: TypeAlias = Callable[[NDArray[np.int64], NDArray[np.int64]], GridBlock]
"""Block of `shape` [3] vertices from vertex `low` [3] on, both numbered in the grid of another block."""


@dataclass(frozen=True, eq=False)
class VertexRange:
    """Vertices from `first` to `last` [3] of a grid, both included."""

    first: NDArray[np.int64]
    last: NDArray[np.int64]

    @classmethod
    def from_block(cls, block: GridBlock) -> VertexRange:
        """All vertices of a block."""
        return cls(np.asarray(block.low), block.low + np.array(block.shape) - 1)

    @property
    def shape(self) -> NDArray[np.int64]:
        """Number of vertices [3]."""
        return np.asarray(self.last - self.first + 1)

    def holds(self, other: VertexRange) -> bool:
        """Whether all vertices of another range are in this one."""
        return bool((other.first >= self.first).all() and (other.last <= self.last).all())

    def union(self, other: VertexRange) -> VertexRange:
        """The smallest range with all vertices of two."""
        return VertexRange(np.minimum(self.first, other.first), np.maximum(self.last, other.last))

    def intersection(self, other: VertexRange) -> VertexRange:
        """The vertices of both ranges."""
        return VertexRange(np.maximum(self.first, other.first), np.minimum(self.last, other.last))

    def grown(self, margin: int) -> VertexRange:
        """The range with `margin` more vertices on each side."""
        return VertexRange(self.first - margin, self.last + margin)

    def beyond(self, other: VertexRange) -> VertexRange | None:
        """The smallest range with all vertices that are not in another one; None without any."""
        if other.holds(self):
            return None
        first, last = self.first.copy(), self.last.copy()
        spans = (other.first <= self.first) & (other.last >= self.last)
        for axis in range(3):
            # Only where the other range spans both other axes does it cut a slab off.
            if np.delete(spans, axis).all():
                if other.first[axis] <= first[axis] <= other.last[axis]:
                    first[axis] = other.last[axis] + 1
                if other.first[axis] <= last[axis] <= other.last[axis]:
                    last[axis] = other.first[axis] - 1
        return VertexRange(first, last)


def extend_blocks(
    first: GridBlock, second: GridBlock, vertices: VertexRange, extract: Extract
) -> tuple[GridBlock, GridBlock]:
    """Two blocks of one place with all vertices of a range as well; `extract` gives those that they have not.

    The blocks themselves where they have all.
    """
    own = VertexRange.from_block(first)
    union = own.union(vertices)
    beyond = union.beyond(own)
    if beyond is None:
        return first, second
    added = extract(beyond.first, beyond.shape)
    return run_both(lambda: _join(union, (added, first)), lambda: _join(union, (added, second)))


def _join(vertices: VertexRange, parts: Sequence[GridBlock]) -> GridBlock:
    """Block of a range with the vertices of parts of it, of later ones where they overlap; else empty."""
    shape = tuple(int(n) for n in vertices.shape)
    density, slot = np.zeros(shape, np.float32), np.full(shape, -1, np.int64)
    block = replace(parts[-1], low=vertices.first, density=density, slot=slot)
    rows = 0
    for part in parts:
        slices = part_slices(block, part)
        density[slices] = part.density
        slot[slices] = np.where(part.slot >= 0, part.slot + rows, -1)
        rows += len(part.sh)
    return replace(block, sh=np.concatenate([part.sh for part in parts]))


def embed_mask(block: GridBlock, part: GridBlock, mask: Mask) -> Mask:
    """Mask [X,Y,Z] of a block's vertices: those of a mask [x,y,z] of a part of it."""
    embedded = np.zeros(block.shape, bool)
    embedded[part_slices(block, part)] = mask
    return embedded


def part_slices(block: GridBlock, part: GridBlock) -> tuple[slice, slice, slice]:
    """Slices of a block's vertices that are those of a part of it."""
    x, y, z = (
        slice(int(first), int(first) + count)
        for first, count in zip(part.low - block.low, part.shape, strict=True)
    )
    return x, y, z
