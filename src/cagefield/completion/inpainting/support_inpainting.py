"""Inpainting of a support: densities and colors of the columns of a footprint.

Densities are medians of the surfaces around, at the same height over the support. Colors are the membrane
over the hole: each coefficient solves Laplace's equation with the values at the rim as boundary. The lines
(`completion.inpainting.coherence_transport`) and patches (`completion.inpainting.exemplar_inpainting`) of a
texture are continued.

Source: Perez, Gangnet and Blake, "Poisson image editing" (2003), for the membrane (without guidance).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse

from cagefield.completion.inpainting.coherence_transport import estimate_orientation, transport_colors
from cagefield.completion.inpainting.exemplar_inpainting import inpaint_texture
from cagefield.completion.surfaces.footprint import MAX_SUPPORT_HEIGHT_VOXELS, Footprint
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.near_masks import dilate, distances_near
from cagefield.compute.cancellation import check_cancelled
from cagefield.fields.sh import sh_basis
from cagefield.typing import AnyArray, Array, Float32, Mask

MIN_SUPPORT_HEIGHT_VOXELS = -4.0
"""Minimum height over a support at which densities are rebuilt, voxels; up to MAX_SUPPORT_HEIGHT_VOXELS."""

MAX_COLOR_HEIGHT_VOXELS = 1.6
"""Maximum height over a support of its colors, voxels."""

EDGE_WIDTH_COLUMNS = 3
"""Width of the edge of a support, columns: its colors are not continued, and its normals may tilt."""

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

FOG_RANGE_VOXELS = 2.0
"""Height of fog over the heights at which densities are rebuilt, voxels."""

MAX_FOG_OPTICAL_DEPTH = 0.5
"""Maximum optical depth of fog per voxel."""

VIEW_COUNT = 32
"""Number of view directions in which colors are sampled."""

VIEW_INDEPENDENCE_WEIGHT = 0.01
"""Weight of the penalty on view-dependent coefficients."""


def load_solvers() -> None:
    """Load the libraries that inpainting needs, which takes about as long as to inpaint a small hole."""
    import scipy.interpolate
    import scipy.sparse.linalg  # noqa: F401


def inpaint_support(
    block: GridBlock, footprint: Footprint, removed: Mask, *, keep_removed: bool = False
) -> GridBlock:
    """Block with the support continued in the footprint's hole.

    removed [X,Y,Z]: mask of V^c. With `keep_removed`, beneath a continuous edit, no vertex of V^c changes.
    """
    check_cancelled()
    # Empty the crust of the part's surface between the support and V^c.
    near_removed = dilate(removed, 4)
    vertices = np.argwhere(near_removed | _near_support(block, footprint))
    u, v, height = footprint.locate(vertices.astype(np.float64))
    in_grid = u >= 0
    vertices, u, v, height = vertices[in_grid], u[in_grid], v[in_grid], height[in_grid]
    hole = footprint.hole[u, v]
    is_removed = removed[tuple(vertices.T)]
    around = footprint.surroundings[u, v] & ~is_removed
    in_height = (height >= MIN_SUPPORT_HEIGHT_VOXELS) & (height <= MAX_SUPPORT_HEIGHT_VOXELS)
    # Keep content above V^c: it is not of the part.
    top = np.full(footprint.hole.shape, -np.inf)
    np.maximum.at(top, (u[is_removed], v[is_removed]), height[is_removed])
    nearest = ndimage.distance_transform_edt(np.isinf(top), return_distances=False, return_indices=True)
    hole &= height <= top[tuple(nearest)][u, v] + 0.5
    known_columns = (u[around], v[around], height[around])
    rows = np.flatnonzero(hole)
    hole[rows] = ~_is_side(block, footprint, removed, vertices[rows], (u[rows], v[rows], height[rows]))
    if keep_removed:
        hole &= ~is_removed
    profile = _density_profile(block, vertices[around & in_height], height[around & in_height])
    crust = hole & (height > MAX_SUPPORT_HEIGHT_VOXELS) & near_removed[tuple(vertices.T)]
    is_new = hole & in_height
    mask = np.zeros(block.shape, bool)
    mask[tuple(vertices[crust].T)] = True
    block = block.with_density(mask, np.zeros(int(mask.sum()), np.float32))
    mask[:] = False
    mask[tuple(vertices[is_new].T)] = True
    values = np.zeros(block.shape, np.float32)
    heights = np.arange(MIN_SUPPORT_HEIGHT_VOXELS, MAX_SUPPORT_HEIGHT_VOXELS + 0.25, 0.5)
    values[tuple(vertices[is_new].T)] = np.interp(height[is_new], heights, profile)
    below = mask & (block.density > values)
    is_deep = np.zeros(block.shape, bool)
    is_deep[tuple(vertices[is_new & (height < -1.5)].T)] = True
    values = np.where(below & is_deep, block.density, values)
    block = block.with_density(mask, values[mask], slots=True)
    if keep_removed:
        above_support = (
            (around | hole)
            & (height > MIN_FOG_HEIGHT_VOXELS)
            & (height <= MAX_SUPPORT_HEIGHT_VOXELS + FOG_RANGE_VOXELS)
        )
        above_support &= _columns_beneath(footprint, np.argwhere(removed))[u, v]
        block = _remove_fog(
            block, vertices[above_support], np.interp(height[above_support], heights, profile)
        )
    return _inpaint_colors(
        block, footprint, vertices[is_new], (u[is_new], v[is_new]), vertices[around], known_columns
    )


def _columns_beneath(footprint: Footprint, vertices: NDArray[np.int64]) -> Mask:
    """Mask [U,V] of the columns under vertices [N,3] of a part, dilated by BLEND_WIDTH_COLUMNS."""
    u, v, _ = footprint.locate(vertices.astype(np.float64))
    columns = np.zeros(footprint.hole.shape, bool)
    columns[u[u >= 0], v[u >= 0]] = True
    return np.asarray(ndimage.distance_transform_edt(~columns) <= BLEND_WIDTH_COLUMNS)


def _remove_fog(block: GridBlock, vertices: NDArray[np.int64], max_density: Array) -> GridBlock:
    """Block without fog at vertices [N,3], up to the density profile [N] of the support.

    A continuous edit that lifts a part stretches the content between part and support into a veil.
    """
    rows = tuple(vertices.T)
    is_fog = (block.depth[rows] < MAX_FOG_OPTICAL_DEPTH) & (
        block.density[rows] > np.maximum(max_density, 0.0)
    )
    mask = np.zeros(block.shape, bool)
    mask[tuple(vertices[is_fog].T)] = True
    values = np.zeros(block.shape, np.float32)
    values[tuple(vertices[is_fog].T)] = np.maximum(max_density[is_fog], 0.0)
    return block.with_density(mask, values[mask])


def _near_support(block: GridBlock, footprint: Footprint) -> Mask:
    """Mask [X,Y,Z] of vertices at the heights that are rebuilt, or colored beneath a support."""
    support = footprint.support
    x, y, z = (
        (np.arange(size) - center) * slope
        for size, center, slope in zip(block.shape, support.point, support.normal, strict=True)
    )
    height = x[:, None, None] + y[:, None] + z
    lowest, highest = float(footprint.height.min()), float(footprint.height.max())
    is_deep = height < MIN_SUPPORT_HEIGHT_VOXELS + lowest
    is_high = height > MAX_SUPPORT_HEIGHT_VOXELS + FOG_RANGE_VOXELS + highest
    return np.asarray(~is_high & (~is_deep | (block.slot >= 0)))


def _is_side(
    block: GridBlock,
    footprint: Footprint,
    removed: Mask,
    vertices: NDArray[np.int64],
    place: tuple[NDArray[np.int64], NDArray[np.int64], Array],
) -> NDArray[np.bool_]:
    """Mask [N] of vertices [N,3] on the sides of the support's edge, away from the removed ones [X,Y,Z].

    place: (u, v, height) of the vertices over the support.
    """
    check_cancelled()
    columns = ndimage.binary_fill_holes(footprint.surroundings | footprint.hole)
    edge = footprint.has_surface & columns & ~ndimage.binary_erosion(columns, iterations=EDGE_WIDTH_COLUMNS)
    u, v, height = place
    is_side = edge[u, v] & (height < MAX_COLOR_HEIGHT_VOXELS)
    rows = np.flatnonzero(is_side)
    mask = np.zeros(block.shape, bool)
    mask[tuple(vertices[rows].T)] = True
    normals = block.normals_at(mask)
    distance = distances_near(removed, vertices[rows].astype(np.float64), SIDE_DISTANCE_VOXELS + 1.0)
    is_side[rows] = (
        (normals @ footprint.support.normal < MAX_SIDE_COSINE)
        & ((normals**2).sum(axis=1) > 0.25)
        & (distance > SIDE_DISTANCE_VOXELS)
    )
    return np.asarray(is_side)


def _density_profile(block: GridBlock, vertices: NDArray[np.int64], height: Array) -> Array:
    """Median densities [H] at heights MIN_SUPPORT_HEIGHT_VOXELS, +0.5, ... over the support."""
    check_cancelled()
    heights = np.arange(MIN_SUPPORT_HEIGHT_VOXELS, MAX_SUPPORT_HEIGHT_VOXELS + 0.25, 0.5)
    values = block.density[tuple(vertices.T)]
    profile = np.zeros(len(heights))
    for number, level in enumerate(heights):
        at_level = np.abs(height - level) <= 0.3
        profile[number] = np.median(values[at_level]) if at_level.any() else profile[number - 1]
    # Photos do not constrain the density inside: make the profile monotone on both sides of its maximum.
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
    """Block with inpainted coefficients in the hole.

    new, known: vertices [N,3] in the hole and in the surroundings; column: (u, v) of the new ones; above:
    (u, v, height) of the known ones.
    """
    check_cancelled()
    u, v, height = above
    shape = footprint.hole.shape
    slot = block.slot[tuple(known.T)]
    rows = (np.abs(height) < MAX_COLOR_HEIGHT_VOXELS) & (slot >= 0)
    cell = np.ravel_multi_index((u[rows], v[rows]), shape)
    weight = _visible_weights(cell, height[rows], block.depth[tuple(known[rows].T)])
    total = np.bincount(cell, weight, minlength=int(np.prod(shape)))
    is_given = total > 0.0
    width = int(np.prod(block.sh.shape[1:]))
    table = np.zeros((len(total), width))
    values = _clamp_visible_colors(block.sh[slot[rows]], footprint.support.normal / np.array(block.spacing))
    values = values.reshape(-1, width)
    for channel in range(width):
        table[:, channel] = np.bincount(cell, weight * values[:, channel], minlength=len(total))
    table[is_given] /= total[is_given][:, None]
    is_given &= footprint.surroundings.reshape(-1)
    # The edge of a support often has another color.
    inner = ndimage.binary_erosion(
        footprint.surroundings | footprint.hole, iterations=EDGE_WIDTH_COLUMNS
    ).reshape(-1)
    is_given = is_given & inner if (is_given & inner).any() else is_given
    blend = _blend_weight(footprint).reshape(-1)
    is_certain = is_given & (blend < MAX_BOUNDARY_BLEND)
    is_given = is_certain if is_certain.any() else is_given
    unknown = (footprint.hole.reshape(-1) | (blend > 0.0)).reshape(shape)
    confidence = np.where(total > 0.0, 1.0 - blend, 0.0) * ~footprint.hole.reshape(-1)
    stored, table = table, _inpaint_table(unknown, is_given.reshape(shape), table, confidence.reshape(shape))
    sh = block.sh.copy()
    known_cell = np.ravel_multi_index((u, v), shape)
    rows = (
        (slot >= 0)
        & (blend[known_cell] > 0.0)
        & (height < MAX_COLOR_HEIGHT_VOXELS)
        & (total[known_cell] > 0.0)
    )
    change = blend[:, None] * (table - stored)
    sh[slot[rows]] += change[known_cell[rows]].reshape(-1, *block.sh.shape[1:])
    new_slot = block.slot[tuple(new.T)]
    has_slot = new_slot >= 0
    cells = np.ravel_multi_index((column[0][has_slot], column[1][has_slot]), shape)
    sh[new_slot[has_slot]] = table[cells].reshape(-1, *block.sh.shape[1:])
    return GridBlock(block.field, block.low, block.density, block.slot, sh)


def _blend_weight(footprint: Footprint) -> Array:
    """Weight [U,V] of the membrane in stored colors right beside the hole.

    Surfaces close to the part were dark; the change of light is the least certain there.
    """
    if footprint.log_light_change is None:
        return np.zeros(footprint.hole.shape)
    distance = ndimage.distance_transform_edt(~footprint.hole)
    nearness = np.clip(1.0 - distance / BLEND_WIDTH_COLUMNS, 0.0, 1.0) * footprint.surroundings
    return np.asarray(
        nearness * np.clip(np.abs(footprint.log_light_change) / FULL_BLEND_LOG_CHANGE, 0.0, 1.0)
    )


def _visible_weights(column: NDArray[np.int64], height: Array, depth: AnyArray) -> Array:
    """Weights [N] of vertices in the visible colors of their columns [N], seen from above.

    height, depth [N]: heights over the support, and optical depths.
    """
    order = np.lexsort((-height, column))
    depth_above = np.cumsum(depth[order].astype(np.float64)) - depth[order]
    first = np.r_[True, np.diff(column[order]) > 0]
    depth_above -= np.maximum.accumulate(np.where(first, depth_above, 0.0))
    weight = np.zeros(len(column))
    weight[order] = np.exp(-depth_above) * (1.0 - np.exp(-depth[order])) + 1e-6
    return weight


def _clamp_visible_colors(sh: Float32, normal: Array) -> Array:
    """Coefficients [N,K,3] with the colors of sh [N,K,3] on the normal's side [3], clamped to black.

    Single vertices may be far below black where they do not show; their means would be darker than the
    surface.
    """
    count = np.arange(VIEW_COUNT)
    up = (count + 0.5) / VIEW_COUNT
    angle = np.pi * (3.0 - np.sqrt(5.0)) * count
    across = np.sqrt(1.0 - up**2)
    u, v = np.linalg.svd(normal[None])[2][1:]
    n = normal / np.linalg.norm(normal)
    views = -(np.outer(up, n) + np.outer(across * np.cos(angle), u) + np.outer(across * np.sin(angle), v))
    basis = sh_basis(views, int(np.sqrt(sh.shape[1])) - 1)
    visible = np.maximum(0.5 + np.einsum("dk,nkc->ndc", basis, sh), 0.0) - 0.5
    penalty = np.eye(sh.shape[1]) * VIEW_INDEPENDENCE_WEIGHT * VIEW_COUNT
    penalty[0, 0] = 0.0
    return np.einsum("kd,ndc->nkc", np.linalg.solve(basis.T @ basis + penalty, basis.T), visible)


def _inpaint_table(unknown: Mask, given: Mask, table: Array, confidence: Array) -> Array:
    """Rows [U*V,C] with the unknown columns [U,V] inpainted: membrane, transported lines, and texture.

    The first three values, the mean colors, get the texture, which fits stored rows by their `confidence`
    [U,V].
    """
    check_cancelled()
    filled = solve_membrane(unknown, given, table)
    unfilled = unknown & ~given
    values = table[:, :3].sum(axis=1).reshape(given.shape)
    orientation = estimate_orientation(
        values, given, lambda known, rows: solve_membrane(unfilled | given, known, rows)
    )
    rows, weight = transport_colors(unfilled, given, table, orientation)
    cells = np.flatnonzero(unfilled)
    filled[cells] += weight[:, None] * (rows - filled[cells])
    stored, start = (each[:, :3].reshape(*given.shape, 3) for each in (table, filled))
    filled[cells, :3] = inpaint_texture(unfilled, given, stored, start, confidence)[unfilled]
    return filled


def solve_membrane(hole: Mask, given: Mask, table: Array) -> Array:
    """Rows [U*V,C] with those of the hole [U,V] solved for: each is the mean of its four neighbors.

    Neighbors that are neither given nor in the hole do not count.
    """
    check_cancelled()
    unknown = np.flatnonzero(hole.reshape(-1) & ~given.reshape(-1))
    number = np.full(hole.size, -1, np.int64)
    number[unknown] = np.arange(len(unknown))
    height, width = hole.shape
    links, sources, degree = [], np.zeros((len(unknown), table.shape[1])), np.full(len(unknown), 1e-6)
    y, x = np.divmod(unknown, width)
    for dy, dx in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        in_grid = (y + dy >= 0) & (y + dy < height) & (x + dx >= 0) & (x + dx < width)
        other = np.where(in_grid, (y + dy) * width + x + dx, 0)
        is_given = in_grid & given.reshape(-1)[other]
        is_unknown = in_grid & (number[other] >= 0)
        degree += is_given.astype(float) + is_unknown
        np.add.at(sources, np.flatnonzero(is_given), table[other[is_given]])
        links.append((np.flatnonzero(is_unknown), number[other[is_unknown]]))
    rows, columns = (np.concatenate(part) for part in zip(*links, strict=True))
    adjacency = sparse.csc_matrix((np.ones(len(rows)), (rows, columns)), (len(unknown),) * 2)
    from scipy.sparse.linalg import factorized

    solve = factorized((sparse.diags(degree) - adjacency).tocsc())
    out = table.copy()
    mean = table[given.reshape(-1)].mean(axis=0) if given.any() else np.zeros(table.shape[1])
    sources += 1e-6 * mean
    for channel in range(table.shape[1]):
        out[unknown, channel] = solve(sources[:, channel])
    return out
