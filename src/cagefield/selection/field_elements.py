"""Elements of splat fields and voxel fields."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.errors import FieldError
from cagefield.fields.contraction import uncontract
from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.selection.elements import Elements
from cagefield.typing import Array, Float32, Mask

MAX_GRID_CELLS = 160
"""Cells along the longest side of an occupancy grid: finer fields have several vertices in a cell."""

MIN_CELL_OPTICAL_DEPTH = 0.05
"""Optical depth of a voxel from which on its vertex is part of an element."""

CELL_SPLAT_WIDTHS = 2.0
"""Minimum edge of a cell in typical splat widths: neighbors on a surface are in touching cells."""

SPLAT_RADIUS_SIGMAS = 1.5
"""Standard deviations within which a splat is sampled, and that count as its radius."""

SAMPLES_ACROSS = 7
"""Samples across a splat that is wider than a cell, along each of its two larger axes."""

SAMPLED_BLOCK = 1 << 16
"""Splats sampled at a time."""


@memoized_weakly
def elements_of_field(field: SplatField | VoxelField) -> Elements:
    """Elements of a field, computed once while it lives.

    Raises FieldError for a field of another kind.
    """
    if isinstance(field, SplatField):
        return splat_elements(field)
    if isinstance(field, VoxelField):
        return cell_elements(field)
    raise FieldError(
        f"selections are of splats and voxels, not of a {type(field).__name__}; bake the field first"
    )


def splat_elements(field: SplatField) -> Elements:
    """Elements of a splat field, one for each splat, in its order.

    The occupancy grid spans `bounds`. A cell's transmittance is the product of those of its splats, each at
    its densest sample there (as `server.render_worker.splat_density` has it); splats narrower than a cell
    have one sample, at their mean.
    """
    low, high = field.bounds
    longest = float((high - low).max())
    edge = max(longest / MAX_GRID_CELLS, CELL_SPLAT_WIDTHS * field.sample_spacing)
    edge = min(edge, longest / 8.0)
    shape = tuple(int(n) for n in np.maximum(np.ceil((high - low) / edge), 1))
    cells = _cells_at(field.means, low, edge, shape)
    scales = np.sort(field.scales, axis=1)
    return Elements(
        kind="splats",
        positions=field.means,
        radii=(SPLAT_RADIUS_SIGMAS * scales[:, 1]).astype(np.float32),
        sizes=scales[:, 2].copy(),
        opacities=field.opacities,
        rgb=_mean_rgb(field.sh),
        cells=cells,
        occupancy=_splat_occupancy(field, cells, low, edge, shape),
        cell_edge=edge,
    )


def cell_elements(field: VoxelField) -> Elements:
    """Elements of a voxel field: the cells, of 1 or more vertices a side, with a vertex that is dense."""
    block = block_vertices(field)
    shape = tuple(math.ceil(n / block) for n in field.resolution)
    depth = field.density * np.float32(field.voxel_size.max())
    dense = np.flatnonzero(depth > MIN_CELL_OPTICAL_DEPTH)
    linear, slots = np.unique(cell_of_vertices(field)[dense], return_inverse=True)
    cells = np.stack(np.unravel_index(linear, shape), axis=1)
    most = np.zeros(len(linear), np.float32)
    np.maximum.at(most, slots, depth[dense])
    weights = depth[dense].astype(np.float64)
    total = np.bincount(slots, weights, len(linear))
    rgb = _mean_rgb(field.sh[dense])
    mean = np.stack([np.bincount(slots, weights * rgb[:, c], len(linear)) for c in range(3)], axis=1)
    middle: Array = (cells * block + 0.5 * (block - 1)).astype(np.float64)
    half = 0.5 * block
    spans = np.stack(
        [_world(field, middle + axis * half) - _world(field, middle - axis * half) for axis in np.eye(3)],
        axis=1,
    )
    edges = np.linalg.norm(spans, axis=2)
    opacities = -np.expm1(-most * block)
    occupancy = np.zeros(shape, np.float32)
    occupancy.reshape(-1)[linear] = opacities
    return Elements(
        kind="cells",
        positions=_world(field, middle).astype(np.float32),
        radii=(0.5 * np.linalg.norm(edges, axis=1)).astype(np.float32),
        sizes=edges.max(axis=1, initial=0.0).astype(np.float32),
        opacities=opacities.astype(np.float32),
        rgb=np.clip(mean / np.maximum(total, 1e-30)[:, None], 0.0, 1.0).astype(np.float32),
        cells=cells.astype(np.int32),
        occupancy=occupancy,
        cell_edge=float(field.voxel_size.max()) * block,
    )


def block_vertices(field: VoxelField) -> int:
    """Vertices along the edge of a cell."""
    return max(1, math.ceil(max(field.resolution) / MAX_GRID_CELLS))


def cell_of_vertices(field: VoxelField) -> NDArray[np.int64]:
    """Linear indices [M] of the cells of a field's stored vertices."""
    block = block_vertices(field)
    shape = tuple(math.ceil(n / block) for n in field.resolution)
    i, j, k = (index // block for index in np.unravel_index(field.vertices, field.resolution))
    return np.asarray(np.ravel_multi_index((i, j, k), shape))


def without_elements(
    field: SplatField | VoxelField, elements: Elements, mask: Mask
) -> SplatField | VoxelField:
    """Field without the elements that are True in `mask` [N]: splats, or all vertices of cells.

    Thin density around the removed cells, which is no element, goes too where it is in a cell that touches
    none of the others. Raises FieldError where nothing would be left.
    """
    if mask.all():
        raise FieldError("the selection is all of the field; leave something, or invert it")
    if isinstance(field, SplatField):
        return field.take(~mask)
    state = np.zeros(elements.occupancy.shape, np.int8)
    state[tuple(elements.cells[~mask].T)] = 1
    others = _grown(state == 1)
    state[tuple(elements.cells[mask].T)] = -1
    near_removed = _grown(state == -1)
    cell = cell_of_vertices(field)
    gone: Mask = np.asarray((state == -1) | (near_removed & ~others))
    return field.take(~gone.reshape(-1)[cell])


def _grown(mask: Mask) -> Mask:
    return np.asarray(ndimage.binary_dilation(mask, np.ones((3, 3, 3), bool)))


def _world(field: VoxelField, grid: Array) -> Array:
    """World positions [N,3] of grid coordinates [N,3]: the inverse of `VoxelField.grid_coordinates`."""
    lower, upper = field.grid_bounds
    points = lower + grid / (np.array(field.resolution) - 1) * (upper - lower)
    if not field.contracted:
        return np.asarray(points)
    return np.asarray(uncontract(points) * field.half_size + field.center)


def _mean_rgb(sh: Float32) -> Float32:
    return np.clip(0.5 + np.float32(C0) * sh[:, 0], 0.0, 1.0).astype(np.float32)


def _cells_at(points: Float32 | Array, low: Array, edge: float, shape: tuple[int, ...]) -> NDArray[np.int32]:
    """Cells [N,3] of points [N,3]; -1 outside of the grid."""
    cells = np.floor((points - low) / edge)
    inside: Mask = np.asarray(((cells >= 0) & (cells < shape)).all(axis=1))
    return np.where(inside[:, None], cells, -1).astype(np.int32)


def _splat_occupancy(
    field: SplatField, cells: NDArray[np.int32], low: Array, edge: float, shape: tuple[int, ...]
) -> Float32:
    total = int(np.prod(shape))
    log_transmittance = np.zeros(total)
    wide = np.sort(field.scales, axis=1)[:, 1] * SPLAT_RADIUS_SIGMAS > 0.5 * edge
    narrow = np.flatnonzero(~wide & (cells >= 0).all(axis=1))
    log_transmittance += np.bincount(
        np.ravel_multi_index(tuple(cells[narrow].T), shape), _log_passed(field.opacities[narrow]), total
    )
    reach = SPLAT_RADIUS_SIGMAS * field.scales.max(axis=1)[:, None]
    near = ((field.means + reach >= low) & (field.means - reach <= low + edge * np.array(shape))).all(axis=1)
    rows = np.flatnonzero(wide & near)
    for first in range(0, len(rows), SAMPLED_BLOCK):
        log_transmittance += _sampled(field, rows[first : first + SAMPLED_BLOCK], low, edge, shape)
    return (-np.expm1(log_transmittance)).astype(np.float32).reshape(shape)


def _sampled(
    field: SplatField, rows: NDArray[np.intp], low: Array, edge: float, shape: tuple[int, ...]
) -> Array:
    """Log transmittance [cells] of wide splats, each sampled on a grid in the plane of its larger axes."""
    total = int(np.prod(shape))
    scales = field.scales[rows].astype(np.float64)
    order = np.argsort(scales, axis=1)[:, 1:]
    turns = rotation_matrices(field.quaternions[rows].astype(np.float64))
    axes = np.take_along_axis(turns * scales[:, None, :], order[:, None, :], axis=2)
    steps = np.linspace(-SPLAT_RADIUS_SIGMAS, SPLAT_RADIUS_SIGMAS, SAMPLES_ACROSS)
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[(grid**2).sum(axis=1) <= SPLAT_RADIUS_SIGMAS**2 * (1.0 + 1e-9)]
    points = field.means[rows].astype(np.float64)[:, None] + np.einsum("nij,kj->nki", axes, grid)
    alpha = field.opacities[rows, None] * np.exp(-0.5 * (grid**2).sum(axis=1))
    cells = _cells_at(points.reshape(-1, 3), low, edge, shape)
    inside = np.flatnonzero(cells[:, 0] >= 0)
    cell = np.ravel_multi_index(tuple(cells[inside].T), shape)
    key = (inside // len(grid)) * total + cell
    order = np.lexsort((alpha.reshape(-1)[inside], key))
    last = np.append(key[order][1:] != key[order][:-1], True) if len(order) else np.zeros(0, bool)
    densest = order[last]
    passed = _log_passed(alpha.reshape(-1)[inside][densest])
    return np.bincount(cell[densest], passed, total).astype(np.float64)


def _log_passed(alpha: Float32 | Array) -> Array:
    return np.log1p(-np.minimum(alpha.astype(np.float64), 0.999))
