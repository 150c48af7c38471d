"""The occupancy of an edited field, in deformed space.

Only the blocks (2 x 2 x 2 cells) that meet an edit's box are looked at again. Where no edit is discrete,
`smooth_occupancy` does it; else two passes. A probe at a lattice point p maps it to canonical space and looks
for an occupied cell within

    r = |J|_inf * spacing / 2

of the image (L-infinity norm), which covers the images of all points nearer to p than to another lattice
point, to first order. The first pass probes block corners (spacing 2 cells, half a cell added) against
occupied blocks; the second probes the 27 cell corners of each block that passed (spacing 1) against the
densities themselves. Maps of discrete edits jump: there, the first pass takes the neighbours' corners too.
Where one edit of a stack is replaced, only the blocks are looked at that its old and its new map can change.

The coarse occupancy, for pictures while a cage is being dragged, is the first pass alone, by
bricks; where no edit jumps, by eight of them at a time.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass
from typing import Any

import numpy as np
import quadrants as qd
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.devices import ints
from cagefield.fields.voxel import VoxelField
from cagefield.loops import Deal, deal_of, dealt, turns
from cagefield.rendering import smooth_occupancy as smooth
from cagefield.rendering.grid import (
    F32,
    I32,
    U8,
    DeviceGrid,
    contract_point,
    contract_velocity,
    ivec3,
    transform_of,
    uncontract_point,
    vec3,
)
from cagefield.rendering.links import Link
from cagefield.rendering.occupancy import BRICK, FEW, FULL, MAX_LEAP, Occupancy, masks_of
from cagefield.rendering.smooth_occupancy import MOST_CELLS, Proceed, is_blocked, is_dense
from cagefield.warps.device import DeviceStack, Nodes, Params, map_sample


def nothing() -> None:
    """Lets it go on."""


@dataclass(frozen=True)
class Known:
    """What is known of another stack's occupancy: it holds outside the boxes [B,2,3], world units."""

    occupancy: Occupancy
    changed: NDArray[np.float64]


def deform(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    jumps: bool,
    known: Known | None = None,
    coarse: bool = False,
    proceed: Proceed | None = None,
    link: Link | None = None,
) -> Occupancy:
    """The occupancy of a field seen through the edits. `jumps` says that an edit is discrete.

    Only what `known` does not know is looked at. `coarse` takes the first pass alone, by whole
    bricks: it holds what the fine one holds and more, for a small part of the time; with a `link`, the stack
    has the edit of the link in place of another one, and nothing else is looked at. `proceed` is called
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
        # Whole bricks of what is looked at, and as many more on each side as their corners' reach depends on.
        margin = 1 if coarse and not jumps else 2
        low = np.maximum(where[0] * side // BRICK - margin, 0)
        high = np.minimum(-(-where[1] * side // BRICK) + margin, (last - first) // BRICK)
        region = tuple(slice(a, b) for a, b in zip(low * BRICK // side, high * BRICK // side, strict=True))
        proceed()
        begin, bricks = first + BRICK * low, high - low
        if coarse:
            found: NDArray[Any] = FULL * _near_bricks(canonical, grid, stack, begin, bricks, jumps, link)
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
    link: Link | None,
) -> NDArray[np.uint8]:
    """1 for the bricks [count] from the grid coordinates `lower` on where a coarse look finds something."""
    if jumps:
        near = _near(canonical, grid.field, stack, lower, count, BRICK)
    elif link is not None:
        near = link.near_bricks(grid, lower, count)
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
    proceed: Proceed,
) -> NDArray[np.bool_]:
    """The occupied blocks of the bricks from the grid coordinates `lower` on, some of the new ones."""
    if not jumps:
        near = smooth.near_bricks(canonical, grid, stack, lower, bricks)
        return smooth.occupied_blocks(canonical, grid, stack, lower, near, new, proceed)
    near = _near(canonical, grid.field, stack, lower, bricks * BRICK // 2, 2)
    near &= new
    proceed()
    candidates = np.argwhere(near).astype(np.int32)
    if len(candidates):
        near[tuple(candidates.T)] = _refined(candidates, grid, stack, lower)
    return near


def _where(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """(first [3], last + 1 [3]) of the box around what a mask holds; None where that is nothing."""
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

    `where`, of the array's shape, says what of it to copy.
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


def _near(
    canonical: Occupancy,
    field: VoxelField,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
    spacing: int,
) -> NDArray[np.bool_]:
    """Cubes of `spacing` cells [count] with an occupied corner, or a corner beside one."""
    near = _corners(canonical, field, stack, lower, count + 1, spacing)
    return smooth.cubes(ndimage.maximum_filter(near, size=3, mode="nearest"))


def _corners(
    canonical: Occupancy,
    field: VoxelField,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
    spacing: int,
) -> NDArray[np.bool_]:
    """Occupied lattice points [count], `spacing` cells apart, the first at grid coordinates `lower`."""
    out = np.zeros(int(np.prod(count)), np.uint8)
    _occupied_corners(
        out,
        deal_of(len(out)),
        canonical.codes.reshape(-1),
        ints(canonical.codes.shape),
        ints(canonical.origin),
        ints(lower),
        ints(count),
        spacing,
        *transform_of(field),
        stack.params,
        stack.lattice,
        stack.n_edits,
        int(field.contracted),
        stack.has_flows,
    )
    return out.reshape(tuple(count)).astype(bool)


def _refined(
    candidates: NDArray[np.int32], grid: DeviceGrid, stack: DeviceStack, lower: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which of the candidate blocks [C,3], counted from grid coordinates `lower`, are occupied."""
    out = np.zeros(len(candidates), np.uint8)
    _occupied_blocks(
        out,
        deal_of(len(out)),
        np.ascontiguousarray(candidates).reshape(-1),
        ints(lower),
        grid.index,
        grid.density,
        ints(grid.field.resolution),
        *transform_of(grid.field),
        stack.params,
        stack.lattice,
        stack.n_edits,
        int(grid.field.contracted),
        stack.has_flows,
    )
    return out.astype(bool)


@qd.func
def probe(
    g: vec3,
    origin: vec3,
    scale: vec3,
    half: vec3,
    params: qd.template(),
    lattice: qd.template(),
    n_edits: qd.i32,
    contracted: qd.i32,
    flows: qd.template(),
):
    """(image, reach, empty) of grid coordinates g: image in grid coordinates, reach = row sums of |J|."""
    p = vec3(0.0, 0.0, 0.0)
    c = g / half - 2.0
    if contracted == 1:
        p = uncontract_point(c) / scale + origin
    else:
        p = g / scale + origin
    reach = vec3(0.0, 0.0, 0.0)
    image = g
    empty = 0
    for a in range(3):
        # One cell along grid axis a, as a world-space displacement.
        e = vec3(0.0, 0.0, 0.0)
        if a == 0:
            e.x = 1.0
        elif a == 1:
            e.y = 1.0
        else:
            e.z = 1.0
        d = e / scale
        if contracted == 1:
            d = (uncontract_point(c + 0.01 * e / half) - uncontract_point(c - 0.01 * e / half)) * 50.0 / scale
        length = qd.max(d.norm(), 1e-20)
        q, v, emptied = map_sample(p, d / length, params, lattice, n_edits, flows)
        empty = emptied
        along = v * length * scale
        image = (q - origin) * scale
        if contracted == 1:
            along = contract_velocity(image, along) * half
            image = (contract_point(image) + 2.0) * half
        reach += qd.abs(along)
    return image, reach, empty


@qd.kernel(fastcache=True)
def _occupied_corners(
    out: U8,
    deal: Deal,
    codes: I32,
    bricks: ivec3,
    bricks_origin: ivec3,
    lower: ivec3,
    count: ivec3,
    spacing: qd.i32,
    origin: vec3,
    scale: vec3,
    half: vec3,
    params: Params,
    lattice: Nodes,
    n_edits: qd.i32,
    contracted: qd.i32,
    flows: qd.template(),
):
    for turn in range(turns(deal)):
        n = dealt(turn, deal)
        if n < count.x * count.y * count.z:
            i = n // (count.y * count.z)
            j = (n // count.z) % count.y
            k = n % count.z
            g = qd.cast(lower + spacing * ivec3(i, j, k), qd.f32)
            image, reach, empty = probe(g, origin, scale, half, params, lattice, n_edits, contracted, flows)
            found = 0
            if empty == 0:
                r = qd.min(reach * (0.5 * qd.cast(spacing, qd.f32)) + 0.5, MOST_CELLS)
                found = is_blocked(image, r, codes, bricks, bricks_origin)
            out[n] = qd.cast(found, qd.u8)


@qd.kernel(fastcache=True)
def _occupied_blocks(
    out: U8,
    deal: Deal,
    candidates: I32,
    lower: ivec3,
    index: I32,
    density: F32,
    resolution: ivec3,
    origin: vec3,
    scale: vec3,
    half: vec3,
    params: Params,
    lattice: Nodes,
    n_edits: qd.i32,
    contracted: qd.i32,
    flows: qd.template(),
):
    for turn in range(turns(deal)):
        n = dealt(turn, deal)
        if n < out.shape[0]:
            block = ivec3(candidates[3 * n], candidates[3 * n + 1], candidates[3 * n + 2])
            found = 0
            k = 0
            while k < 27 and found == 0:
                g = qd.cast(lower + 2 * block + ivec3(k % 3, (k // 3) % 3, k // 9), qd.f32)
                image, reach, empty = probe(
                    g, origin, scale, half, params, lattice, n_edits, contracted, flows
                )
                if empty == 0:
                    r = qd.min(0.5 * reach, MOST_CELLS) + 1e-3
                    found = is_dense(image, r, index, density, resolution)
                k += 1
            out[n] = qd.cast(found, qd.u8)
