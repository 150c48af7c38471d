"""A support goes on where nothing was seen of it: the densities and colours of a footprint's columns.

The densities are those of the surfaces around, at the same height over the support, and the colours are the
membrane that spans the hole: each coefficient solves Laplace's equation between those at the hole's rim.
Where a texture has a grain its lines go on (`completion.inpainting.coherence_transport`), and so does its
pattern (`completion.inpainting.exemplar_inpainting`).

Source: Perez, Gangnet and Blake, "Poisson image editing" (2003), for the membrane (without guidance).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse.linalg import factorized

from cagefield.completion.inpainting.coherence_transport import estimate_orientation, transport_colors
from cagefield.completion.inpainting.exemplar_inpainting import inpaint_texture
from cagefield.completion.surfaces.footprint import MAX_SUPPORT_HEIGHT_VOXELS, Footprint
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.fields.sh import sh_basis
from cagefield.typing import AnyArray, Array, Float32, Mask

MIN_SUPPORT_HEIGHT_VOXELS = -4.0
"""Height over a support, voxels, from which on it is made anew, up to HIGH."""

MAX_COLOR_HEIGHT_VOXELS = 1.6
"""Height over a support, voxels, up to which its colours are."""

EDGE_WIDTH_COLUMNS = 3
"""Columns at the edge of a support whose colours do not go on, and that may face aside."""

MAX_SIDE_COSINE = 0.6
"""Maximum cosine between the normals of a support's side and of the support."""

SIDE_DISTANCE_VOXELS = 3.0
"""Minimum distance from the removed vertices of a side that stays, voxels."""

BLEND_WIDTH_COLUMNS = 6.0
"""Width of the ring around a hole in which stored colors blend into the membrane, columns."""

FULL_BLEND_LOG_CHANGE = 0.4
"""Change of light (log) from which on the membrane has its full weight at the rim."""

MAX_BOUNDARY_BLEND = 0.1
"""Weight of the membrane from which on a column is no boundary value of the membrane."""

MIN_FOG_HEIGHT_VOXELS = 1.0
"""Minimum height of fog over a support, voxels."""

MAX_FOG_OPTICAL_DEPTH = 0.5
"""Maximum optical depth of fog per voxel."""

VIEW_COUNT = 32
"""Directions from which colours are looked at."""

VIEW_INDEPENDENCE_WEIGHT = 0.01
"""How firmly colours are held to be the same from all of them."""


def inpaint_support(
    block: GridBlock, footprint: Footprint, removed: Mask, *, stays: bool = False
) -> GridBlock:
    """The block with the support going on in its hole; `removed` [X,Y,Z] are the vertices of V^c.

    Where that `stays`, under a continuous edit, nothing in V^c changes.
    """
    voxels = np.argwhere(np.ones(block.shape, bool))
    u, v, height = footprint.column(voxels.astype(np.float64))
    known = u >= 0
    voxels, u, v, height = voxels[known], u[known], v[known], height[known]
    hole = footprint.hole[u, v]
    around = footprint.around[u, v] & ~removed[tuple(voxels.T)]
    level = (height >= MIN_SUPPORT_HEIGHT_VOXELS) & (height <= MAX_SUPPORT_HEIGHT_VOXELS)
    # What stands or hangs above V^c is not of the part, and stays.
    gone = removed[tuple(voxels.T)]
    top = np.full(footprint.hole.shape, -np.inf)
    np.maximum.at(top, (u[gone], v[gone]), height[gone])
    nearest = ndimage.distance_transform_edt(np.isinf(top), return_distances=False, return_indices=True)
    hole &= height <= top[tuple(nearest)][u, v] + 0.5
    known_columns = (u[around], v[around], height[around])
    hole &= ~_side_vertices(block, footprint, removed)[tuple(voxels.T)]
    if stays:
        hole &= ~gone
    profile = _density_profile(block, voxels[around & level], height[around & level])
    # Crusts of what was taken away, between the support and V^c.
    nearby = ndimage.binary_dilation(removed, iterations=4)
    crust = hole & (height > MAX_SUPPORT_HEIGHT_VOXELS) & nearby[tuple(voxels.T)]
    new = hole & level
    where = np.zeros(block.shape, bool)
    where[tuple(voxels[crust].T)] = True
    block = block.with_density(where, np.zeros(int(where.sum()), np.float32))
    where[:] = False
    where[tuple(voxels[new].T)] = True
    values = np.zeros(block.shape, np.float32)
    heights = np.arange(MIN_SUPPORT_HEIGHT_VOXELS, MAX_SUPPORT_HEIGHT_VOXELS + 0.25, 0.5)
    values[tuple(voxels[new].T)] = np.interp(height[new], heights, profile)
    below = where & (block.density > values)
    deep = np.zeros(block.shape, bool)
    deep[tuple(voxels[new & (height < -1.5)].T)] = True
    values = np.where(below & deep, block.density, values)
    block = block.with_density(where, values[where], slots=True)
    if stays:
        over = (
            (around | hole) & (height > MIN_FOG_HEIGHT_VOXELS) & (height <= MAX_SUPPORT_HEIGHT_VOXELS + 2.0)
        )
        over &= _columns_beneath(footprint, np.argwhere(removed))[u, v]
        block = _remove_fog(block, voxels[over], np.interp(height[over], heights, profile))
    return _inpaint_colors(block, footprint, voxels[new], (u[new], v[new]), voxels[around], known_columns)


def _columns_beneath(footprint: Footprint, at: NDArray[np.int64]) -> Mask:
    """Columns [U,V] under block coordinates [N,3] of a part, and RING around them."""
    u, v, _ = footprint.column(at.astype(np.float64))
    columns = np.zeros(footprint.hole.shape, bool)
    columns[u[u >= 0], v[u >= 0]] = True
    return np.asarray(ndimage.distance_transform_edt(~columns) <= BLEND_WIDTH_COLUMNS)


def _remove_fog(block: GridBlock, at: NDArray[np.int64], most: Array) -> GridBlock:
    """The block with no fog at vertices [N,3], of which a support shows `most` [N] by its density.

    A continuous edit that lifts a part draws what is between it and the support out to a veil.
    """
    rows = tuple(at.T)
    fog = (block.depth[rows] < MAX_FOG_OPTICAL_DEPTH) & (block.density[rows] > np.maximum(most, 0.0))
    where = np.zeros(block.shape, bool)
    where[tuple(at[fog].T)] = True
    values = np.zeros(block.shape, np.float32)
    values[tuple(at[fog].T)] = np.maximum(most[fog], 0.0)
    return block.with_density(where, values[where])


def _side_vertices(block: GridBlock, footprint: Footprint, removed: Mask) -> Mask:
    """[X,Y,Z], where the support's edge was seen to face aside, not close to what was removed [X,Y,Z]."""
    columns = ndimage.binary_fill_holes(footprint.around | footprint.hole)
    edge = footprint.surfaced & columns & ~ndimage.binary_erosion(columns, iterations=EDGE_WIDTH_COLUMNS)
    at = np.argwhere(ndimage.distance_transform_edt(~removed) > SIDE_DISTANCE_VOXELS)
    u, v, height = footprint.column(at.astype(np.float64))
    normals = block.normals[tuple(at.T)]
    facing = normals @ footprint.support.normal
    side = (
        (u >= 0)
        & edge[u, v]
        & (height < MAX_COLOR_HEIGHT_VOXELS)
        & (facing < MAX_SIDE_COSINE)
        & ((normals**2).sum(axis=1) > 0.25)
    )
    found = np.zeros(block.shape, bool)
    found[tuple(at[side].T)] = True
    return found


def _density_profile(block: GridBlock, at: NDArray[np.int64], height: Array) -> Array:
    """Median densities at heights DEEP, DEEP + 1/2, ... HIGH over the support."""
    heights = np.arange(MIN_SUPPORT_HEIGHT_VOXELS, MAX_SUPPORT_HEIGHT_VOXELS + 0.25, 0.5)
    values = block.density[tuple(at.T)]
    profile = np.zeros(len(heights))
    for number, level in enumerate(heights):
        here = np.abs(height - level) <= 0.3
        profile[number] = np.median(values[here]) if here.any() else profile[number - 1]
    # Photos do not say how dense it is inside; above, nothing rises again.
    top = int(np.argmax(profile))
    profile[:top] = np.maximum(profile[:top], profile[top])
    profile[top:] = np.minimum.accumulate(profile[top:])
    return profile


def _inpaint_colors(
    block: GridBlock,
    footprint: Footprint,
    new: NDArray[np.int64],
    column: tuple[NDArray[np.int64], NDArray[np.int64]],
    known: NDArray[np.int64],
    above: tuple[NDArray[np.int64], NDArray[np.int64], Array],
) -> GridBlock:
    """The block with the membrane's coefficients in the hole."""
    u, v, height = above
    shape = footprint.hole.shape
    slot = block.slot[tuple(known.T)]
    rows = (np.abs(height) < MAX_COLOR_HEIGHT_VOXELS) & (slot >= 0)
    cell = np.ravel_multi_index((u[rows], v[rows]), shape)
    weight = _visible_weights(cell, height[rows], block.depth[tuple(known[rows].T)])
    total = np.bincount(cell, weight, minlength=int(np.prod(shape)))
    given = total > 0.0
    width = int(np.prod(block.sh.shape[1:]))
    table = np.zeros((len(total), width))
    values = _clamp_visible_colors(block.sh[slot[rows]], footprint.support.normal / np.array(block.spacing))
    values = values.reshape(-1, width)
    for channel in range(width):
        table[:, channel] = np.bincount(cell, weight * values[:, channel], minlength=len(total))
    table[given] /= total[given][:, None]
    given &= footprint.around.reshape(-1)
    # The edge of the support is of another colour, often.
    inner = ndimage.binary_erosion(footprint.around | footprint.hole, iterations=EDGE_WIDTH_COLUMNS).reshape(
        -1
    )
    given = given & inner if (given & inner).any() else given
    share = _blend_weight(footprint).reshape(-1)
    sure = given & (share < MAX_BOUNDARY_BLEND)
    given = sure if sure.any() else given
    unknown = (footprint.hole.reshape(-1) | (share > 0.0)).reshape(shape)
    firm = np.where(total > 0.0, 1.0 - share, 0.0) * ~footprint.hole.reshape(-1)
    own, table = table, _inpaint_table(unknown, given.reshape(shape), table, firm.reshape(shape))
    sh = block.sh.copy()
    beside = np.ravel_multi_index((u, v), shape)
    rows = (slot >= 0) & (share[beside] > 0.0) & (height < MAX_COLOR_HEIGHT_VOXELS) & (total[beside] > 0.0)
    change = share[:, None] * (table - own)
    sh[slot[rows]] += change[beside[rows]].reshape(-1, *block.sh.shape[1:])
    place = block.slot[tuple(new.T)]
    kept = place >= 0
    cells = np.ravel_multi_index((column[0][kept], column[1][kept]), shape)
    sh[place[kept]] = table[cells].reshape(-1, *block.sh.shape[1:])
    return GridBlock(block.field, block.low, block.density, block.slot, sh)


def _blend_weight(footprint: Footprint) -> Array:
    """The share [U,V] that the membrane has in colours right beside the hole.

    What is close to where something stood is dark, so that the new light on it is the least sure.
    """
    if footprint.changed is None:
        return np.zeros(footprint.hole.shape)
    away = ndimage.distance_transform_edt(~footprint.hole)
    near = np.clip(1.0 - away / BLEND_WIDTH_COLUMNS, 0.0, 1.0) * footprint.around
    return np.asarray(near * np.clip(np.abs(footprint.changed) / FULL_BLEND_LOG_CHANGE, 0.0, 1.0))


def _visible_weights(column: NDArray[np.int64], height: Array, depth: AnyArray) -> Array:
    """The share [N] that vertices have in what is seen of their columns [N] from above.

    height, depth [N]: theirs over the support, and their optical depth.
    """
    order = np.lexsort((-height, column))
    passed = np.cumsum(depth[order].astype(np.float64)) - depth[order]
    first = np.r_[True, np.diff(column[order]) > 0]
    passed -= np.maximum.accumulate(np.where(first, passed, 0.0))
    share = np.zeros(len(column))
    share[order] = np.exp(-passed) * (1.0 - np.exp(-depth[order])) + 1e-6
    return share


def _clamp_visible_colors(sh: Float32, normal: Array) -> Array:
    """Coefficients [N,K,3] that are as sh [N,K,3] seen from the normal's side [3], and never below black.

    Those of single vertices may be far below, where nothing shows of it; their means would be darker than
    what is seen.
    """
    count = np.arange(VIEW_COUNT)
    up = (count + 0.5) / VIEW_COUNT
    angle = np.pi * (3.0 - np.sqrt(5.0)) * count
    across = np.sqrt(1.0 - up**2)
    u, v = np.linalg.svd(normal[None])[2][1:]
    n = normal / np.linalg.norm(normal)
    views = -(np.outer(up, n) + np.outer(across * np.cos(angle), u) + np.outer(across * np.sin(angle), v))
    basis = sh_basis(views, int(np.sqrt(sh.shape[1])) - 1)
    seen = np.maximum(0.5 + np.einsum("dk,nkc->ndc", basis, sh), 0.0) - 0.5
    firm = np.eye(sh.shape[1]) * VIEW_INDEPENDENCE_WEIGHT * VIEW_COUNT
    firm[0, 0] = 0.0
    return np.einsum("kd,ndc->nkc", np.linalg.solve(basis.T @ basis + firm, basis.T), seen)


def _inpaint_table(unknown: Mask, given: Mask, table: Array, firm: Array) -> Array:
    """The rows [U*V,C] with those of the unknown [U,V]: the membrane's, and the grain's where it goes on.

    What is seen from all sides of them, the first three values, has the pattern around, and fits to the rows
    themselves as far as these are `firm` [U,V].
    """
    spanned = solve_membrane(unknown, given, table)
    sought = unknown & ~given
    values = table[:, :3].sum(axis=1).reshape(given.shape)
    grain = estimate_orientation(
        values, given, lambda known, rows: solve_membrane(sought | given, known, rows)
    )
    rows, share = transport_colors(sought, given, table, grain)
    at = np.flatnonzero(sought)
    spanned[at] += share[:, None] * (rows - spanned[at])
    own, start = (each[:, :3].reshape(*given.shape, 3) for each in (table, spanned))
    spanned[at, :3] = inpaint_texture(sought, given, own, start, firm)[sought]
    return spanned


def solve_membrane(hole: Mask, given: Mask, table: Array) -> Array:
    """Rows [U*V,C] with those of the hole [U,V] solved for: each is the mean of its neighbours.

    Neighbours that are neither given nor in the hole do not count.
    """
    unknown = np.flatnonzero(hole.reshape(-1) & ~given.reshape(-1))
    number = np.full(hole.size, -1, np.int64)
    number[unknown] = np.arange(len(unknown))
    height, width = hole.shape
    pulls, sources, degree = [], np.zeros((len(unknown), table.shape[1])), np.full(len(unknown), 1e-6)
    y, x = np.divmod(unknown, width)
    for dy, dx in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        there = (y + dy >= 0) & (y + dy < height) & (x + dx >= 0) & (x + dx < width)
        other = np.where(there, (y + dy) * width + x + dx, 0)
        known = there & given.reshape(-1)[other]
        inner = there & (number[other] >= 0)
        degree += known.astype(float) + inner
        np.add.at(sources, np.flatnonzero(known), table[other[known]])
        pulls.append((np.flatnonzero(inner), number[other[inner]]))
    rows, columns = (np.concatenate(part) for part in zip(*pulls, strict=True))
    pull = sparse.csc_matrix((np.ones(len(rows)), (rows, columns)), (len(unknown),) * 2)
    solve = factorized((sparse.diags(degree) - pull).tocsc())
    out = table.copy()
    mean = table[given.reshape(-1)].mean(axis=0) if given.any() else np.zeros(table.shape[1])
    sources += 1e-6 * mean
    for channel in range(table.shape[1]):
        out[unknown, channel] = solve(sources[:, channel])
    return out
