"""Tensor-product lattices of control points, linear or cubic B-spline, in float64.

Notation: control points P [n,3], n = nx ny nz, x fastest; u in [0,1]^3; s = (n_a - 1) u_a along each axis,
with cell floor(s) and t = s - floor(s) in [0,1]. "linear": x(u) is trilinear in each cell, continuous (C0).
"bspline": the uniform cubic B-spline whose control points go on evenly by one beyond each end,
P_-1 = 2 P_0 - P_1. It is C2 throughout, reaches the corner points, has weights >= 0 that sum to 1 (x(u) lies
in the hull of the points), second derivative 0 along the normal of each face, and gives back every affine map
of an even grid: with 2 points along an axis it is linear there.

Source: de Boor, "A Practical Guide to Splines"; the ends are those of a natural spline.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cagefield.geometry import hexahedron
from cagefield.typing import Array, Mask

INTERPOLATIONS: tuple[str, ...] = ("bspline", "linear")

_STARTS = 4
"""Nearest samples from which Newton's method starts, one after the other."""


def padded(points: Array, shape: tuple[int, int, int]) -> Array:
    """Control points [nz+2,ny+2,nx+2,3] with one more beyond each end, of points [n,3]."""
    nx, ny, nz = shape
    P = points.reshape(nz, ny, nx, 3)
    for axis in range(3):
        P = np.moveaxis(P, axis, 0)
        P = np.concatenate([2.0 * P[:1] - P[1:2], P, 2.0 * P[-1:] - P[-2:-1]])
        P = np.moveaxis(P, 0, axis)
    return np.ascontiguousarray(P)


def weights(t: Array, interpolation: str) -> tuple[Array, Array]:
    """(weights [N,4] of the four points around a cell, their derivatives in t) at t [N]."""
    zero, one = np.zeros_like(t), np.ones_like(t)
    if interpolation == "linear":
        return np.stack([zero, 1.0 - t, t, zero], axis=1), np.stack([zero, -one, one, zero], axis=1)
    r = 1.0 - t
    w = [r**3, 4.0 - 6.0 * t**2 + 3.0 * t**3, 4.0 - 6.0 * r**2 + 3.0 * r**3, t**3]
    d = [-3.0 * r**2, 9.0 * t**2 - 12.0 * t, 12.0 * r - 9.0 * r**2, 3.0 * t**2]
    return np.stack(w, axis=1) / 6.0, np.stack(d, axis=1) / 6.0


def evaluate(points: Array, shape: tuple[int, int, int], interpolation: str, u: Array) -> tuple[Array, Array]:
    """(x(u) [N,C], dx/du [N,C,3]) at u [N,3] of values [n,C] at the control points.

    Beyond [0,1]^3 the outermost cells' polynomials go on.
    """
    nx, ny, nz = shape
    P = points.reshape(nz, ny, nx, -1)
    for axis in range(3):
        P = np.moveaxis(P, axis, 0)
        P = np.moveaxis(np.concatenate([2.0 * P[:1] - P[1:2], P, 2.0 * P[-1:] - P[-2:-1]]), 0, axis)
    last = np.array(shape) - 1.0
    s = u * last
    cell = np.floor(s).clip(0.0, last - 1.0)
    (wx, dx), (wy, dy), (wz, dz) = (weights(t, interpolation) for t in (s - cell).T)
    i, j, k = (cell.astype(np.intp)).T
    four = np.arange(4)
    near = P[
        (k[:, None] + four)[:, :, None, None],
        (j[:, None] + four)[:, None, :, None],
        (i[:, None] + four)[:, None, None, :],
    ]  # [N,4,4,4,C]
    rows, slopes = np.einsum("ni,nkjic->nkjc", wx, near), np.einsum("ni,nkjic->nkjc", dx, near)
    flat, across = np.einsum("nj,nkjc->nkc", wy, rows), np.einsum("nj,nkjc->nkc", dy, rows)
    along = np.einsum("nj,nkjc->nkc", wy, slopes)
    value = np.einsum("nk,nkc->nc", wz, flat)
    columns = [np.einsum("nk,nkc->nc", w, c) for w, c in ((wz, along), (wz, across), (dz, flat))]
    jacobian = np.stack(columns, axis=2)
    return value, jacobian * last


def grid(shape: tuple[int, int, int]) -> Array:
    """u [n,3] of an even grid over [0,1]^3, x fastest."""
    z, y, x = np.meshgrid(*(np.linspace(0.0, 1.0, n) for n in reversed(shape)), indexing="ij")
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)


def inverse(
    points: Array, shape: tuple[int, int, int], interpolation: str, targets: Array
) -> tuple[Array, Mask]:
    """(u [N,3], found [N]) with x(u) = targets [N,3] and u in [0,1]^3, to 1e-9, where there is such a u.

    Newton's method with shortened steps, from the nearest of an even grid of samples (three a cell along each
    axis), then from the next nearest. Exact where the determinant is positive over the lattice.
    """
    from scipy.spatial import cKDTree

    starts = grid((3 * shape[0] - 2, 3 * shape[1] - 2, 3 * shape[2] - 2))
    tree = cKDTree(evaluate(points, shape, interpolation, starts)[0])
    u, found = np.full(targets.shape, np.nan), np.zeros(len(targets), dtype=bool)
    size = np.ptp(points, axis=0).max()
    _, nearest = tree.query(targets, k=_STARTS)
    for n in range(_STARTS):
        rows = np.flatnonzero(~found)
        if len(rows) == 0:
            break
        x, good = newton(
            lambda v: evaluate(points, shape, interpolation, v), targets[rows], starts[nearest[rows, n]], size
        )
        inside = good & hexahedron.all_three((x >= -1e-9) & (x <= 1.0 + 1e-9))
        u[rows[inside]], found[rows[inside]] = x[inside].clip(0.0, 1.0), True
    return u, found


def newton(
    values: Callable[[Array], tuple[Array, Array]], targets: Array, start: Array, size: float
) -> tuple[Array, Mask]:
    """(u [N,3], found [N]) with x(u) = targets [N,3] to 1e-11 of a size, by Newton's method."""
    u = start.copy()
    x, J = values(u)
    left = np.linalg.norm(x - targets, axis=1)
    share = np.ones(len(u))
    for _ in range(60):
        rows = np.flatnonzero((left > 1e-13 * size) & (share > 1e-4))
        if len(rows) == 0:
            break
        step = (hexahedron.invert(J[rows]) @ (x - targets)[rows][:, :, None])[:, :, 0]
        step /= np.maximum(1.0, np.abs(step).max(axis=1, keepdims=True) / 0.5)
        trial = (u[rows] - share[rows, None] * step).clip(-0.5, 1.5)
        new, slope = values(trial)
        new_left = np.linalg.norm(new - targets[rows], axis=1)
        better = new_left < left[rows]
        share[rows] = np.where(better, np.minimum(1.0, 2.0 * share[rows]), 0.25 * share[rows])
        rows = rows[better]
        u[rows], x[rows], J[rows], left[rows] = trial[better], new[better], slope[better], new_left[better]
    return u, left <= 1e-11 * size
