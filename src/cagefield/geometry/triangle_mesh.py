"""Closed triangle meshes: their validation, winding numbers, orientation.

Source of the winding number: van Oosterom and Strackee, "The Solid Angle of a Plane Triangle" (1983).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import CageError
from cagefield.geometry.cage_checks import format_vector
from cagefield.typing import Array, Mask

MAX_MESH_VERTICES = 512
"""Vertices of a mesh cage: the velocity of its flow takes all of them at each node of a grid."""

Triangles = NDArray[np.int64]

_FLAT_SHARE = 1e-9
"""Least area of a triangle, and volume of a mesh, as a share of its extent to the power 2 or 3."""

_PAIRS_AT_A_TIME = 100_000
"""Pairs of points and triangles at a time."""


def closed_mesh(vertices: ArrayLike, triangles: ArrayLike) -> tuple[Array, Triangles]:
    """(vertices [V,3] float64, triangles [F,3] int64), both read-only, of a closed surface.

    Raises `CageError` for vertices that are not finite, too many or unused; no triangles, or flat ones; an
    open, branching or inconsistently oriented surface; and one inside out.
    """
    v: Array = _numbers(vertices, np.float64, "vertices")
    t: Triangles = _numbers(triangles, np.int64, "triangles")
    if len(t) == 0:
        raise CageError("mesh has 0 triangles; give it a closed surface")
    if not 4 <= len(v) <= MAX_MESH_VERTICES:
        raise CageError(
            f"mesh has {len(v)} vertices, a mesh cage has 4 to {MAX_MESH_VERTICES}; decimate it, in a"
            " 3D editor, say"
        )
    for bad in np.flatnonzero(~np.isfinite(v).all(axis=1)):
        raise CageError(f"vertex {bad} of the mesh must be finite, got {format_vector(v[bad])}")
    if t.min() < 0 or t.max() >= len(v):
        raise CageError(f"triangles name vertices 0 to {len(v) - 1}, got {t.min()} to {t.max()}")
    unused = np.setdiff1d(np.arange(len(v)), t)
    if len(unused):
        raise CageError(f"vertex {unused[0]} of the mesh belongs to no triangle; leave it out")
    check_edges(t)
    size = float(np.ptp(v, axis=0).max())
    areas = 0.5 * np.linalg.norm(np.cross(v[t[:, 1]] - v[t[:, 0]], v[t[:, 2]] - v[t[:, 0]]), axis=1)
    if areas.min() <= _FLAT_SHARE * size**2:
        k = int(np.argmin(areas))
        raise CageError(f"triangle {k} of the mesh, vertices {t[k].tolist()}, is flat; merge its vertices")
    volume = signed_volume(v, t)
    if abs(volume) <= _FLAT_SHARE * size**3:
        raise CageError("mesh encloses no volume; give it a thickness")
    if volume < 0.0:
        raise CageError(
            "mesh is inside out: its triangles must be counter-clockwise seen from outside; turn them over"
            " (triangles[:, ::-1])"
        )
    v.setflags(write=False)
    t.setflags(write=False)
    return v, t


def check_edges(t: Triangles) -> None:
    """Raise `CageError` where an edge of triangles [F,3] has not exactly two, in opposite directions."""
    directed = t[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    if (directed[:, 0] == directed[:, 1]).any():
        raise CageError("a triangle of the mesh names a vertex twice; leave it out")
    unique, counts = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    if (counts == 1).any():
        edge = unique[np.argmax(counts == 1)].tolist()
        raise CageError(
            f"mesh is open: edge {edge} has one triangle ({np.count_nonzero(counts == 1)} such edges); close"
            " its holes in a 3D editor"
        )
    if (counts > 2).any():
        k = int(np.argmax(counts))
        raise CageError(
            f"mesh branches: edge {unique[k].tolist()} has {counts[k]} triangles and must have 2; separate"
            " the parts there"
        )
    twice, counts = np.unique(directed, axis=0, return_counts=True)
    if (counts > 1).any():
        raise CageError(
            f"triangles at edge {twice[np.argmax(counts)].tolist()} of the mesh face opposite ways; make"
            " normals consistent in a 3D editor"
        )


def mesh_edges(t: Triangles) -> Triangles:
    """The edges [E,2] of triangles [F,3], the lower number of a vertex first."""
    return np.unique(np.sort(t[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def check_crossings(v: Array, t: Triangles) -> None:
    """Raise `CageError` where an edge of the mesh goes through a triangle that it has no vertex with."""
    edges = mesh_edges(t)
    ends, faces = v[edges], v[t]
    low_e, high_e, low_f, high_f = ends.min(1), ends.max(1), faces.min(1), faces.max(1)
    meet = np.ones((len(edges), len(t)), dtype=bool)
    for a in range(3):
        meet &= (low_e[:, None, a] <= high_f[:, a]) & (high_e[:, None, a] >= low_f[:, a])
    i, j = np.nonzero(meet)
    shares = (edges[i][:, :, None] == t[j][:, None]).any(axis=(1, 2))
    i, j = i[~shares], j[~shares]
    p, q = ends[i, 0], ends[i, 1]
    a, b, c = faces[j, 0], faces[j, 1], faces[j, 2]
    sides = _volume(a, b, c, p) * _volume(a, b, c, q) < 0.0
    u, w, x = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
    through = sides & (((u > 0) & (w > 0) & (x > 0)) | ((u < 0) & (w < 0) & (x < 0)))
    if through.any():
        k = int(np.argmax(through))
        raise CageError(
            f"mesh crosses itself: edge {edges[i[k]].tolist()} goes through the triangle of vertices"
            f" {t[j[k]].tolist()}; move its vertices apart"
        )


def signed_volume(v: Array, t: Triangles) -> float:
    """Volume of a closed mesh, negative where it is inside out."""
    a, b, c = (v[t[:, n]] - v.mean(axis=0) for n in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def winding_numbers(v: Array, t: NDArray[np.integer], points: Array) -> Array:
    """Winding numbers [N] of a closed mesh around points [N,3]: 1 inside, 0 outside."""
    found = np.empty(len(points))
    chunk = max(1, _PAIRS_AT_A_TIME // len(t))
    for first in range(0, len(points), chunk):
        rows = points[first : first + chunk]
        a, b, c = (v[t[:, n]][None] - rows[:, None] for n in range(3))
        la, lb, lc = (np.linalg.norm(d, axis=2) for d in (a, b, c))
        numerator = np.einsum("pfi,pfi->pf", a, np.cross(b, c))
        denominator = la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb
        found[first : first + chunk] = np.arctan2(numerator, denominator).sum(axis=1) / (2.0 * np.pi)
    return found


def encloses(v: Array, t: NDArray[np.integer], points: Array) -> Mask:
    """Mask [N] of the points [N,3] with a winding number of the mesh above one half."""
    return np.asarray(winding_numbers(v, t, points) > 0.5)


def _volume(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Six times the volumes [N] of tetrahedra."""
    return np.asarray(np.einsum("ni,ni->n", b - a, np.cross(c - a, d - a)))


def _numbers(value: ArrayLike, kind: Any, name: str) -> Any:
    """A copy [N,3] of one kind of numbers, or a `CageError`."""
    try:
        raw = np.array(value)
        array: Any = raw.reshape(0, 3).astype(kind) if raw.size == 0 else raw.astype(kind)
    except (TypeError, ValueError, OverflowError):
        raise CageError(f"{name} of a mesh must be rows of 3 numbers, got {value!r:.60}") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise CageError(f"{name} of a mesh must have shape [N,3], got {list(array.shape)}")
    if kind is np.int64 and not np.array_equal(array, raw.reshape(array.shape)):
        raise CageError("triangles of a mesh must be whole numbers of vertices")
    return array
