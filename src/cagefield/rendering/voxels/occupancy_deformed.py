"""The occupancy of an edited field, in deformed space.

Only the blocks (2 x 2 x 2 cells) that meet an edit's box are worked out anew: by `occupancy_continuous`
where no edit is discrete, else by `occupancy_discontinuous`. Where one edit of a stack is replaced, only the
blocks are worked out that its old and its new map can change.

The coarse occupancy, for pictures while a cage is being dragged, is the first pass of these alone, by
bricks; where no edit jumps and there are many, by eight of them at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cagefield.edits.device_stack import DeviceStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.voxels import occupancy_continuous as smooth
from cagefield.rendering.voxels import occupancy_discontinuous as jumping
from cagefield.rendering.voxels.device_grid import DeviceGrid
from cagefield.rendering.voxels.occupancy import BRICK, FEW, FULL, MAX_LEAP, Occupancy, masks_of


def nothing() -> None:
    """Lets it go on."""


@dataclass(frozen=True)
class Known:
    """Occupancy of another stack that is valid outside the boxes [B,2,3], world units."""

    occupancy: Occupancy
    changed: NDArray[np.float64]


class Shortcut(Protocol):
    """A quicker way to a coarse pass, as `drag_occupancy.DraggedEdit` has for one edit of many."""

    def near_bricks(
        self, grid: DeviceGrid, lower: NDArray[np.int64], count: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """As `occupancy_continuous.near_bricks`, coarsely."""


def deform(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    jumps: bool,
    known: Known | None = None,
    coarse: bool = False,
    proceed: Callable[[], None] | None = None,
    dragged: Shortcut | None = None,
) -> Occupancy:
    """The occupancy of a field seen through the edits. `jumps` says that an edit is discrete.

    Only the boxes outside of `known` are computed. `coarse` takes the first pass alone, by whole
    bricks: a superset of the fine one, for a small part of the time; with a `dragged` edit, the stack
    has this edit in place of another one, and nothing else is worked out. `proceed` is called
    between the passes, and may raise.
    """
    field, proceed = grid.field, proceed or nothing
    if stack.n_edits == 0:
        return canonical
    boxes = [_grid_box(field, box) for box in stack.boxes.astype(np.float64)]
    lower, upper = _region(boxes, canonical, field.contracted)
    first = np.minimum(lower, canonical.origin)
    last = np.maximum(upper, canonical.origin + BRICK * np.array(canonical.codes.shape))
    # Masks of bricks, or blocks.
    side = BRICK if coarse else 2
    count = (last - first) // side
    held = np.zeros(count, np.uint8 if coarse else bool)
    _paste(held, first, canonical)
    new = _touched(boxes, first, count, side)
    if known is not None:
        changed = _touched([_grid_box(field, box) for box in known.changed], first, count, side)
        _paste(held, first, known.occupancy, new & ~changed)
        new &= changed
    where = _where(new)
    if where is not None:
        # Whole bricks of those blocks, and as many more on each side as their corners' reach depends on.
        margin = 1 if coarse and not jumps else 2
        low = np.maximum(where[0] * side // BRICK - margin, 0)
        high = np.minimum(-(-where[1] * side // BRICK) + margin, (last - first) // BRICK)
        region = tuple(slice(a, b) for a, b in zip(low * BRICK // side, high * BRICK // side, strict=True))
        proceed()
        begin, bricks = first + BRICK * low, high - low
        if coarse:
            found: NDArray[Any] = FULL * _near_bricks(canonical, grid, stack, begin, bricks, jumps, dragged)
        else:
            found = _near_blocks(canonical, grid, stack, begin, bricks, new[region], jumps, proceed)
        np.copyto(held[region], found, where=new[region])
    return Occupancy.from_masks(first, held if coarse else masks_of(held), FEW if coarse else MAX_LEAP)


def _near_bricks(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
    jumps: bool,
    dragged: Shortcut | None,
) -> NDArray[np.uint8]:
    """1 for the bricks [count] from the grid coordinates `lower` on where a coarse pass finds something."""
    if jumps:
        near = jumping.near_bricks(canonical, grid, stack, lower, count)
    elif dragged is not None:
        near = dragged.near_bricks(grid, lower, count)
    else:
        near = smooth.near_bricks(canonical, grid, stack, lower, count, coarse=True)
    return near.view(np.uint8)


def _near_blocks(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    bricks: NDArray[np.int64],
    new: NDArray[np.bool_],
    jumps: bool,
    proceed: Callable[[], None],
) -> NDArray[np.bool_]:
    """The occupied blocks of the bricks from the grid coordinates `lower` on, some of the new ones."""
    if jumps:
        return jumping.occupied_blocks(canonical, grid, stack, lower, new, proceed)
    near = smooth.near_bricks(canonical, grid, stack, lower, bricks)
    return smooth.occupied_blocks(canonical, grid, stack, lower, near, new, proceed)


def _where(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """(first [3], last + 1 [3]) of the bounding box of a mask; None for an empty mask."""
    bounds = []
    for axis in range(3):
        some = np.flatnonzero(mask.any(axis=tuple(other for other in range(3) if other != axis)))
        if len(some) == 0:
            return None
        bounds.append((some[0], some[-1] + 1))
    return np.array([low for low, _ in bounds]), np.array([high for _, high in bounds])


def _region(
    boxes: list[NDArray[np.float64]], canonical: Occupancy, contracted: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(first cell [3], last cell + 1 [3]) of the bricks that boxes in grid coordinates meet."""
    lower = np.floor(np.min([box[0] for box in boxes], axis=0) / BRICK).astype(np.int64) * BRICK
    upper = (np.floor(np.max([box[1] for box in boxes], axis=0) / BRICK).astype(np.int64) + 1) * BRICK
    if contracted:
        lower = np.maximum(lower, 0)
        upper = np.minimum(upper, BRICK * np.array(canonical.codes.shape))
    return lower, upper


def _touched(
    boxes: list[NDArray[np.float64]], first: NDArray[np.int64], count: NDArray[np.int64], side: int
) -> NDArray[np.bool_]:
    """The cubes [count] of `side` cells, the first at the cell `first`, that boxes in grid cells meet."""
    touched = np.zeros(count, bool)
    for box in boxes:
        lo = np.maximum(np.floor(box[0] / side).astype(int) - first // side, 0)
        hi = np.clip(np.floor(box[1] / side).astype(int) + 1 - first // side, 0, count)
        touched[lo[0] : hi[0], lo[1] : hi[1], lo[2] : hi[2]] = True
    return touched


def _paste(
    held: NDArray[Any], first: NDArray[np.int64], source: Occupancy, where: NDArray[np.bool_] | None = None
) -> None:
    """Copy an occupancy's blocks, or masks into uint8, to an array that begins at the cell `first`.

    `where`, of the array's shape, selects the copied part.
    """
    values = source.masks if held.dtype == np.uint8 else source.blocks
    per_brick = values.shape[0] // source.codes.shape[0]
    at = (source.origin - first) * per_brick // BRICK
    low, high = np.maximum(at, 0), np.minimum(at + np.array(values.shape), held.shape)
    here = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    there = tuple(slice(a, b) for a, b in zip(low - at, high - at, strict=True))
    np.copyto(held[here], values[there], where=True if where is None else where[here])


def _grid_box(field: VoxelField, box: NDArray[np.float64]) -> NDArray[np.float64]:
    """A world-space box [2,3] in grid coordinates, a little larger; if contracted, the box around it."""
    if not field.contracted:
        return field.grid_coordinates(box) + np.array([[-0.01], [0.01]])
    t = np.linspace(0.0, 1.0, 9)
    grid = np.stack(np.meshgrid(t, t, t, indexing="ij"), axis=-1).reshape(-1, 3)
    g = field.grid_coordinates(box[0] + grid * (box[1] - box[0]))
    return np.stack([g.min(axis=0) - BRICK, g.max(axis=0) + BRICK])
