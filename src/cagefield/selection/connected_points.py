"""Detours of connected control points: ways through the dense matter of a field, less the straight ones.

On a grid around the points, a node is occupied where the field is dense. From the occupied node nearest to
each control point Dijkstra's algorithm finds the shortest way along the 26 neighbors of occupied nodes; less
the length that such a way would have without obstacles, it is the detour E, exactly 0 wherever the way is
free, and at most the radius, which it is without a way. In empty space E is that of the nearest occupied
node, made smooth beyond the neighbors of occupied ones: across a gap of 3 nodes or more both sides have
their own E, and narrower ones are a compromise.

Source: Dijkstra, "A note on two problems in connexion with graphs" (1959). Blender's proportional editing,
"Connected Only", has the same distance along the edges of a mesh.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from cagefield.compute.cancellation import check_cancelled
from cagefield.edits import Continuous, Edit, EditMap, Paste, PreparedStack
from cagefield.errors import EditError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage_checks import format_vector
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.selection.field_elements import block_vertices, elements_of_field
from cagefield.selection.neighborhoods import FLOOD_OPACITY, NEIGHBORS
from cagefield.typing import Array, Float32, Mask

NODES_PER_RADIUS = 32
"""Nodes along a radius, at most: a step of the flow is as short as E is steep."""

MAX_NODES = 2_000_000
"""Nodes of a grid, at most: its edge grows with points that are far apart."""

PADDING_NODES = 3
"""Nodes around the reach of the points."""

SMOOTHING_STEPS = 24
"""Means over 3^3 nodes by which E becomes smooth in empty space."""

MAX_SUBNODES = 3
"""Samples of the field along the edge of a node, at most; one that is dense makes the node occupied."""

_HALF_NEIGHBORS = [o for o in np.ndindex(3, 3, 3) if o > (1, 1, 1)]

AnyEdit = TypeVar("AnyEdit", bound=Edit)


def with_detours(edit: AnyEdit, field: SplatField | VoxelField, below: EditMap) -> AnyEdit:
    """The edit with the detours of its connected control points in a field; another edit as it is.

    `below` holds the edits under it: their deformed field is the matter. An edit that is off, or changes
    nothing, stays as it is too. Raises `EditError` for a control point without matter within the radius.
    """
    points = edit.inner
    if not (isinstance(edit, Continuous) and isinstance(points, ControlPoints) and points.is_unprepared):
        return edit
    if not (edit.enabled and edit.changes_anything):
        return edit
    try:
        return edit.replace(inner=points.with_detours(detours_of(points, field, below)))
    except EditError as error:
        raise edit.error(str(error)) from None


def detours_of(points: ControlPoints, field: SplatField | VoxelField, below: EditMap) -> DetourGrid:
    """Detours of control points in a field under the edits `below`.

    Raises `EditError` for a control point without matter within the radius.
    """
    y, r = points.local_points, points.radius
    low, high = y.min(axis=0) - r, y.max(axis=0) + r
    stretch = float(np.linalg.norm(points.linear, 2))
    cell = elements_of_field(field).cell_edge / stretch
    edge = max(cell, r / NODES_PER_RADIUS, float(np.prod(high - low) / MAX_NODES) ** (1.0 / 3.0))
    shape = np.ceil((high - low) / edge).astype(np.intp) + 1 + 2 * PADDING_NODES
    origin = low - PADDING_NODES * edge
    occupied = np.zeros(tuple(shape), bool)
    per_edge = int(np.clip(np.ceil(edge / cell - 0.25), 1, MAX_SUBNODES))
    for i, plane in enumerate(occupied):
        check_cancelled()
        nodes = np.stack(np.meshgrid([i], *(np.arange(n) for n in plane.shape), indexing="ij"), axis=-1)
        for sub in np.ndindex(per_edge, per_edge, per_edge):
            offset = (np.array(sub) + 0.5) / per_edge - 0.5
            q = origin + edge * (nodes.reshape(-1, 3) + offset)
            plane |= _is_dense(points.pivot + q @ points.linear.T, field, below).reshape(plane.shape)
    starts, ways = _starts(points, occupied, origin, edge)
    values = np.full(occupied.shape, r)
    values[occupied] = _detours(occupied, starts, ways, edge, r)
    values = _in_empty_space(values, occupied)
    base = np.floor((y - origin) / edge + 0.5).astype(np.intp)
    for i, j, k in base:
        values[i - 1 : i + 2, j - 1 : j + 2, k - 1 : k + 2] = 0.0
    return DetourGrid(origin, edge, values)


def _is_dense(p: Array, field: SplatField | VoxelField, below: EditMap) -> Mask:
    """Mask [N] of points [N,3] where the field under edits is dense."""
    # The content of pasted splats is not on the field: nothing is connected through it.
    edits = PreparedStack(s for s in below.steps if not (isinstance(s.edit, Paste) and s.part is None))
    if not len(edits.steps):
        return _occupancy(field, p) >= FLOOD_OPACITY
    mapped = edits.to_canonical(p)
    dense = (_occupancy(field, mapped.points) >= FLOOD_OPACITY) & (mapped.layer == 0)
    for number, layer in enumerate(edits.layers, start=1):
        rows = np.flatnonzero(mapped.layer == number)
        if len(rows):
            q = mapped.points[rows]
            sigma, _ = layer(q, np.tile([0.0, 0.0, 1.0], (len(q), 1)))
            dense[rows] = -np.expm1(-sigma * elements_of_field(field).cell_edge) >= FLOOD_OPACITY
    return np.asarray(dense)


def _occupancy(field: SplatField | VoxelField, p: Array) -> Float32:
    """Opacity [N] of the cells of a field at canonical points [N,3]; 0 beyond them."""
    elements = elements_of_field(field)
    if isinstance(field, VoxelField):
        cells = np.floor((field.grid_coordinates(p) + 0.5) / block_vertices(field)).astype(np.intp)
    else:
        cells = np.floor((p - field.bounds[0]) / elements.cell_edge).astype(np.intp)
    rows = np.flatnonzero(((cells >= 0) & (cells < elements.occupancy.shape)).all(axis=1))
    found = np.zeros(len(p), np.float32)
    found[rows] = elements.occupancy[tuple(cells[rows].T)]
    return found


def _starts(
    points: ControlPoints, occupied: Mask, origin: Array, edge: float
) -> tuple[NDArray[np.intp], Array]:
    """(nodes [n,3], distances [n]) of the occupied node nearest to each control point."""
    nodes = np.argwhere(occupied)
    found, ways = [], []
    for number, y in enumerate(points.local_points):
        away = np.linalg.norm(origin + edge * nodes - y, axis=1)
        if not len(nodes) or away.min() > points.radius:
            raise EditError(
                f"control point {number} at {format_vector(points.points[number])} is connected to nothing:"
                " the field is empty within its radius; move the point, enlarge the radius, or leave"
                " connected out"
            )
        found.append(nodes[away.argmin()])
        ways.append(float(away.min()))
    return np.array(found), np.array(ways)


def _detours(occupied: Mask, starts: NDArray[np.intp], ways: Array, edge: float, most: float) -> Array:
    """Detours [M] of the occupied nodes, at most `most`."""
    number = np.full(occupied.shape, -1, np.int32)
    nodes = np.argwhere(occupied)
    number[occupied] = np.arange(len(nodes))
    padded = np.pad(number, 1, constant_values=-1)
    rows, columns, lengths = [], [], []
    for neighbor in _HALF_NEIGHBORS:
        i, j, k = nodes.T
        other = padded[i + neighbor[0], j + neighbor[1], k + neighbor[2]]
        there = np.flatnonzero(other >= 0)
        rows.append(there)
        columns.append(other[there])
        lengths.append(np.full(len(there), edge * np.sqrt(np.abs(np.array(neighbor) - 1).sum())))
    # One more node, from which the ways to the control points' nodes start; csgraph takes 0 for no edge.
    count = len(nodes)
    rows.append(np.full(len(starts), count))
    columns.append(number[tuple(starts.T)])
    lengths.append(np.maximum(ways, 1e-9 * edge))
    graph = coo_array(
        (np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))), (count + 1, count + 1)
    )
    free = np.full(count, np.inf)
    for start, way in zip(starts, ways, strict=True):
        across = np.sort(np.abs(nodes - start), axis=1)
        # Steps along all three axes, then along two, then along one.
        octile = across @ np.array([np.sqrt(3.0) - np.sqrt(2.0), np.sqrt(2.0) - 1.0, 1.0])
        free = np.minimum(free, way + edge * octile)
    check_cancelled()
    found = dijkstra(_smallest(graph), directed=False, indices=count)[:count]
    return np.clip(found - free, 0.0, most)


def _smallest(graph: coo_array) -> coo_array:
    """The graph in rows, of edges given twice the shorter one: coo_array adds them up."""
    order = np.lexsort((graph.data, graph.col, graph.row))
    row, column, data = graph.row[order], graph.col[order], graph.data[order]
    first = np.ones(len(row), bool)
    first[1:] = (row[1:] != row[:-1]) | (column[1:] != column[:-1])
    return coo_array((data[first], (row[first], column[first])), graph.shape).tocsr()


def _in_empty_space(values: Array, occupied: Mask) -> Array:
    """Values [X,Y,Z] of occupied nodes, gone on with in empty space."""
    nearest = ndimage.distance_transform_edt(~occupied, return_distances=False, return_indices=True)
    spread = values[tuple(nearest)]
    near = ndimage.binary_dilation(occupied, NEIGHBORS)
    for _ in range(SMOOTHING_STEPS):
        spread = np.where(near, spread, ndimage.uniform_filter(spread, 3, mode="nearest"))
    return np.asarray(spread.clip(0.0))
