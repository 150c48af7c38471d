"""Space in the coordinates of a cage: trilinear inside it, and going on around it; see `trilinear_bend`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.trilinear_bend import AXIS_COEFFICIENTS, SIGNS, bends, bends_one_to_one, forms


@dataclass(frozen=True)
class Extended:
    """Space in a cage's coordinates: x = c + F y(xi).

    Parameters: center c [3], frame F [3,3], bend K [4,3]; the tilts, F^-1 and the distances of the faces from
    the center along their normals follow from them.
    """

    center: Array
    frame: Array
    bend: Array

    @staticmethod
    @lru_cache(maxsize=64)
    def from_cage(cage: Cage) -> Extended:
        """The coordinates of a cage at rest."""
        C = hexahedron.coefficients(cage.corners)
        F = np.ascontiguousarray(C[AXIS_COEFFICIENTS].T)
        return Extended(C[0], F, bends(C[None], F[None])[0])

    @cached_property
    def inverse(self) -> Array:
        """F^-1 [3,3]."""
        return np.asarray(np.linalg.inv(self.frame))

    @cached_property
    def heights(self) -> Array:
        """Distance [3] of each pair of faces of the affine part from the center."""
        return np.asarray(1.0 / np.linalg.norm(self.inverse, axis=1))

    @cached_property
    def is_affine(self) -> bool:
        """True for a parallelepiped."""
        return not self.bend.any()

    @cached_property
    def form(self) -> Array:
        """The bend's and the tilts' rows [10,3], see `forms`."""
        return np.asarray(forms(self.bend[None])[0])

    def points(self, xi: Array) -> Array:
        """x [N,3] of coordinates xi [N,3]."""
        y = xi if self.is_affine else xi + _factors(xi.T).T @ self.form
        return self.center + y @ self.frame.T

    def coordinates(self, points: Array, start: Array | None = None, enough: float = 1e-14) -> Array:
        """xi [N,3] of points [N,3], by Newton's method from xi = start; see `straighten`."""
        y = (points - self.center) @ self.inverse.T
        return y if self.is_affine else straighten(self.form, y, start, enough)

    def gradient(self, xi: Array) -> Array:
        """dxi/dx [N,3,3] at xi [N,3]; at a kink that of the side towards the cage's inside."""
        if self.is_affine:
            return np.broadcast_to(self.inverse, (len(xi), 3, 3))
        return hexahedron.invert(straightened_slope(self.form, xi)) @ self.inverse

    @cached_property
    def is_one_to_one(self) -> bool:
        """True when no two coordinates are the same point: det dx/dxi > 0 inside the cage and around it."""
        if self.is_affine:
            return True
        return bool(bends_one_to_one(self.bend[None])[0])


def straightened_slope(form: Array, xi: Array) -> Array:
    """dy/dxi [N,3,3]."""
    return np.transpose(np.stack(slope_columns(form, xi.T)), (2, 1, 0))


def straighten(form: Array, y: Array, start: Array | None = None, enough: float = 1e-14) -> Array:
    """xi [N,3] with y(xi) = y [N,3], by a damped Newton's method from `start` (else from y).

    It ends at a residual of `enough`, as a share of 1 + |y|. A point stuck at a kink is tried again from
    another start.
    """
    target = np.ascontiguousarray(y.T)  # components first: numpy's inner loops are long
    xi = target.copy() if start is None else start.T.copy()
    size = _newton(form, xi, target, enough)
    for again in _STARTS:
        rows = np.flatnonzero(size > 1e-6 * (1.0 + np.abs(target).max(axis=0)))
        if len(rows) == 0:
            break
        trial = np.repeat(again[:, None], len(rows), axis=1)
        new_size = _newton(form, trial, target[:, rows], enough)
        better = new_size < size[rows]
        xi[:, rows[better]], size[rows[better]] = trial[:, better], new_size[better]
    return np.ascontiguousarray(xi.T)


def _newton(form: Array, xi: Array, target: Array, enough: float) -> Array:
    """Residual norms [N] of y(xi) - target after moving xi [3,N] to the nearest root, in place."""
    form = form if form[4:].any() else form[:4]
    x, y, residual = xi, target, _residual(form, xi, target)
    size = np.abs(residual).max(axis=0)
    left, arrived = size, enough * (1.0 + np.abs(target).max(axis=0))
    rows = np.arange(len(size))  # those on their way; x, y, residual and left are theirs
    for _ in range(60):
        going = left > arrived[rows]
        if not going.all():
            rows, x, y, residual, left = (
                rows[going],
                x[:, going],
                y[:, going],
                residual[:, going],
                left[going],
            )
        if len(rows) == 0:
            break
        step = hexahedron.solve(slope_columns(form, x), residual)
        trial = x - step
        new = _residual(form, trial, y)
        new_left = np.abs(new).max(axis=0)
        worse, share = np.flatnonzero(new_left >= left), 1.0
        for _ in range(6):
            if len(worse) == 0:
                break
            share *= 0.5
            trial[:, worse] = x[:, worse] - share * step[:, worse]
            new[:, worse] = _residual(form, trial[:, worse], y[:, worse])
            new_left[worse] = np.abs(new[:, worse]).max(axis=0)
            worse = worse[new_left[worse] >= left[worse]]
        if len(worse):  # what no step improves has arrived, up to rounding, or is stuck
            kept = np.delete(np.arange(len(rows)), worse)
            rows, trial, y, new, new_left = (
                rows[kept],
                trial[:, kept],
                y[:, kept],
                new[:, kept],
                new_left[kept],
            )
        x, residual, left = trial, new, new_left
        xi[:, rows], size[rows] = x, left
    return np.asarray(size)


def _residual(form: Array, xi: Array, y: Array) -> Array:
    """y(xi) - y, all [3,N]."""
    return xi + form.T @ _factors(xi, len(form)) - y


def _factors(xi: Array, rows: int = 10) -> Array:
    """Basis values [4,N] or [10,N] at xi [3,N], factors of the first 4 or all 10 rows of a form."""
    a, b, c = xi.clip(-1.0, 1.0)
    ab = a * b
    if rows == 4:
        return np.stack([ab, a * c, b * c, ab * c])
    below, above = np.minimum(xi + 1.0, 0.0), np.maximum(xi - 1.0, 0.0)
    beyond = (below[0], above[0], below[1], above[1], below[2], above[2])
    return np.stack([ab, a * c, b * c, ab * c, *beyond])


def slope_columns(form: Array, xi: Array) -> tuple[Array, Array, Array]:
    """The three columns [3,N] of dy/dxi at xi [3,N], for the bend alone [4,3] or with its tilts [10,3]."""
    a, b, c = xi.clip(-1.0, 1.0)
    inside = np.abs(xi) <= 1.0
    A, B, C, D = form[:4, :, None]
    bc = b * c
    columns = (A * b + B * c + D * bc, A * a + C * c + D * (a * c), B * a + C * b + D * (a * b))
    for axis, column in enumerate(columns):
        column *= inside[axis]
        if len(form) > 4:
            column += form[4 + 2 * axis : 6 + 2 * axis].T @ np.stack([xi[axis] < -1.0, xi[axis] > 1.0])
        column[axis] += 1.0
    return columns


_STARTS = np.concatenate([np.zeros((1, 3)), SIGNS, 2.0 * SIGNS])
"""Where Newton's method starts again: the center, the corners, and a cube twice as large."""
