"""Positivity of a lattice's Jacobian determinant, proven by Bernstein coefficients.

Notation: see `bspline_lattice`. In a cell the determinant is a polynomial of degree m = 2 (linear) or 8
(cubic) in each of the cell's coordinates, and of degree 3 in the time of points that move in straight lines.
Its values at m + 1 (4) places an axis determine it, and so its Bernstein coefficients, whose least is a lower
bound.
Cells that the bound leaves open are halved along every axis.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb
from typing import Literal, TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cagefield.geometry import bspline_lattice, hexahedron
from cagefield.typing import Array

Verdict: TypeAlias = Literal["proven", "folded", "undecided"]
"""Whether a determinant is positive throughout: proven, refuted by a place, or neither after all halvings."""

LEAST_DETERMINANT = 1e-4
"""Least determinant, as a share of that of the best affine fit, which counts as positive: rounding of the
coefficients is below 1e-9."""

_DEPTH = 4
_MOST_BLOCKS = 4096
_CELLS_AT_ONCE = 32


def fit(points: Array, shape: tuple[int, int, int]) -> tuple[Array, Array]:
    """(A [3,3], b [3]) of the affine map x = b + A u that fits the control points [n,3] best."""
    u = bspline_lattice.grid(shape) - 0.5
    A = ((points - points.mean(axis=0)).T @ u) / (u * u).sum(axis=0)
    return A, points.mean(axis=0) - A @ np.full(3, 0.5)


def verdict(
    points: Array, shape: tuple[int, int, int], interpolation: str, end: Array | None = None
) -> tuple[Verdict, tuple[int, int, int]]:
    """(verdict, cell) on the determinant of a lattice, in the frame of its affine fit.

    With `end` [n,3], on all of the straight way of the control points from `points` to `end`.
    The cell (x, y, z) is one that is folded or undecided.
    """
    key = (points.tobytes(), None if end is None else end.tobytes(), shape, interpolation)
    return _verdict(*key)


@lru_cache(maxsize=4096)
def _verdict(
    data: bytes, end_data: bytes | None, shape: tuple[int, int, int], interpolation: str
) -> tuple[Verdict, tuple[int, int, int]]:
    points = np.frombuffer(data).reshape(-1, 3)
    A, _ = fit(points, shape)
    size = np.linalg.norm(A, axis=0)
    if size.min() == 0.0 or np.linalg.det(A / size) <= 1e-9:
        return "folded", (0, 0, 0)
    nets = [points @ np.linalg.inv(A).T]
    if end_data is not None:
        nets.append(np.frombuffer(end_data).reshape(-1, 3) @ np.linalg.inv(A).T)
    windows = [_cells(net, shape) for net in nets]
    doubtful = np.flatnonzero(np.max([_strain(w, shape, interpolation) for w in windows], axis=0) >= 1.0)
    for first in range(0, len(doubtful), _CELLS_AT_ONCE):
        part = doubtful[first : first + _CELLS_AT_ONCE]
        answer, row = _cell_verdict([w[part] for w in windows], shape, interpolation)
        if answer != "proven":
            nx, ny, cell = shape[0] - 1, shape[1] - 1, int(part[row])
            return answer, (cell % nx, cell // nx % ny, cell // (nx * ny))
    return "proven", (0, 0, 0)


def _cells(net: Array, shape: tuple[int, int, int]) -> Array:
    """The 64 control points [B,4,4,4,3] (z, y, x) of each cell, x fastest."""
    windows = sliding_window_view(bspline_lattice.padded(net, shape), (4, 4, 4), axis=(0, 1, 2))
    return np.moveaxis(windows, 3, 6).reshape(-1, 4, 4, 4, 3)


def _strain(windows: Array, shape: tuple[int, int, int], interpolation: str) -> Array:
    """A bound [B] of |dx/du - 1| in each cell; below 1 the determinant is positive.

    The columns of dx/du are means of the differences between neighboring control points.
    """
    if interpolation == "linear":
        windows = windows[:, 1:3, 1:3, 1:3]
    total = np.zeros(len(windows))
    for a in range(3):
        edges = np.diff(windows, axis=3 - a) * (shape[a] - 1)
        edges = edges - np.eye(3)[a]
        total += (edges**2).sum(axis=-1).reshape(len(windows), -1).max(axis=1)
    return np.asarray(total)


def _cell_verdict(
    windows: list[Array], shape: tuple[int, int, int], interpolation: str
) -> tuple[Verdict, int]:
    """(verdict, row of the worst) on cells with control points [B,4,4,4,3], one net or a start and an end."""
    degree = 2 if interpolation == "linear" else 8
    nodes, to_bernstein, halves = _bernstein(degree)
    V, D = bspline_lattice.weights(nodes, interpolation)
    columns = []
    for a in range(3):
        x, y, z = (D if a == b else V for b in range(3))
        columns.append(
            [np.einsum("kr,jq,ip,brqpc->bkjic", z, y, x, w, optimize=True) * (shape[a] - 1) for w in windows]
        )
    splits = [halves] * 3
    a, b, c = (column[0] for column in columns)
    if len(windows) == 2:
        time, to_time, time_halves = _bernstein(3)
        a, b, c = (s[..., None, :] + time[:, None] * (e - s)[..., None, :] for s, e in columns)
        splits.append(time_halves)
    a, b, c = (np.moveaxis(column, -1, 0) for column in (a, b, c))
    det = (a * hexahedron.cross(b, c)).sum(axis=0)
    for axis in range(1, 4):
        det = np.moveaxis(np.tensordot(to_bernstein, det, axes=(1, axis)), 0, axis)
    if len(windows) == 2:
        det = det @ to_time.T
    return _positive(det - LEAST_DETERMINANT, splits)


def _positive(blocks: Array, splits: list[Array]) -> tuple[Verdict, int]:
    """(verdict, row of the worst) on polynomials with Bernstein coefficients [B,m+1,m+1,m+1,...]."""
    corners = (slice(None), *(slice(None, None, n - 1) for n in blocks.shape[1:]))
    rows = np.arange(len(blocks))
    for depth in range(_DEPTH + 1):
        open_ = blocks.reshape(len(blocks), -1).min(axis=1) <= 0.0
        blocks, rows = blocks[open_], rows[open_]
        if len(blocks) == 0:
            return "proven", 0
        at_corners = blocks[corners].reshape(len(blocks), -1).min(axis=1)
        if at_corners.min() <= 0.0:
            return "folded", int(rows[np.argmin(at_corners)])
        if depth == _DEPTH or len(blocks) > _MOST_BLOCKS >> len(splits):
            break
        for axis, halves in enumerate(splits, start=1):
            both = np.tensordot(halves, blocks, axes=(2, axis))  # [2,m+1,B,...]
            blocks = np.moveaxis(both, 1, axis + 1).reshape(-1, *blocks.shape[1:])
            rows = np.concatenate([rows, rows])
    return "undecided", int(rows[0])


@lru_cache(maxsize=4)
def _bernstein(degree: int) -> tuple[Array, Array, Array]:
    """(places [m+1] in [0,1], matrix from values there to Bernstein coefficients, halving [2,m+1,m+1])."""
    n = np.arange(degree + 1)
    nodes = 0.5 - 0.5 * np.cos(np.pi * n / degree)
    binomials = np.array([comb(degree, int(k)) for k in n], dtype=np.float64)
    basis = binomials * nodes[:, None] ** n * (1.0 - nodes[:, None]) ** (degree - n)
    left = np.array([[comb(i, j) / 2.0**i if j <= i else 0.0 for j in n] for i in n])
    return nodes, np.asarray(np.linalg.inv(basis), dtype=np.float64), np.stack([left, left[::-1, ::-1]])


def least_determinant(points: Array, shape: tuple[int, int, int], interpolation: str) -> tuple[float, Array]:
    """(least determinant at 5 places a cell and axis, over that of the affine fit, u [3] there): a sample."""
    u = bspline_lattice.grid((4 * shape[0] - 3, 4 * shape[1] - 3, 4 * shape[2] - 3))
    A, _ = fit(points, shape)
    det = np.linalg.det(bspline_lattice.evaluate(points, shape, interpolation, u)[1])
    worst = int(np.argmin(det))
    return float(det[worst] / max(abs(float(np.linalg.det(A))), 1e-300)), u[worst]
