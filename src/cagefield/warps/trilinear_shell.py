"""The trilinear shell: six hexahedra between the faces of the inner cage and those of the outer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from cagefield.geometry import hexahedron, hexahedron_determinant
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.hexahedron_map import map_hexahedron

LEAST_RATIO = 1e-3
"""A shell whose determinant falls below this share of the canonical one counts as folded: the map to
canonical space is then stretched a thousandfold and more, beyond the precision of a float32 renderer."""

SIDES: tuple[str, ...] = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass(frozen=True)
class TrilinearShell:
    """phi' through six pairs of hexahedra, one for each side of the cages.

    The hexahedron of a side joins the inner cage's face to the outer cage's face of the same side. phi' is
    inverse-trilinear in the deformed one (deformed inner corners), then trilinear in the canonical one; the
    outer corners are shared. Neighbors share a bilinear face and the map on it, so phi' is continuous; it
    equals phi on the inner cage's faces and the identity on the outer cage's. Sides are those of the inner
    cage; the outer cage's corners are renumbered by the one of the 24 turns that fits them best.

    Source: Li & Pan, section 3: "trilinear interpolation, whose control points are sampled from the surface
    of cages".
    """

    inner: Cage
    deformed: Cage
    outer: Cage

    @cached_property
    def _outer_corners(self) -> Array:
        return self.outer.corners[_matching_turn(self.inner.axes, self.outer.axes)]

    @cached_property
    def canonical_hexahedra(self) -> Array:
        """Corners [6,8,3] in canonical space, in the order of `SIDES`."""
        return _hexahedra(self.inner.corners, self._outer_corners)

    @cached_property
    def deformed_hexahedra(self) -> Array:
        """Corners [6,8,3] in deformed space, in the order of `SIDES`."""
        return _hexahedra(self.deformed.corners, self._outer_corners)

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in the shell."""
        return _through(self.deformed_hexahedra, self.canonical_hexahedra, points)

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """(deformed points [N,3], Jacobians [N,3,3]) of canonical points [N,3] in the shell."""
        return _through(self.canonical_hexahedra, self.deformed_hexahedra, points)

    def least_ratio(self) -> float:
        """Least det of d(deformed)/d(canonical) over the shell, to 1e-3; <= 0 where it folds.

        Bisection on the ratio r at which det D - r det C, a triquadratic polynomial, stops being positive in
        one of the hexahedra: a bound over the whole shell, not a sample.
        """
        C, D = self._determinants
        low, high = -1e3, float((_at_corners(D) / _at_corners(C)).min())
        if hexahedron_determinant.is_positive(D - high * (1.0 - 1e-3) * C):
            return high
        step = max(1e-3, 1e-3 * abs(high))
        while not hexahedron_determinant.is_positive(D - (high - step) * C) and high - step > low:
            high, step = high - step, 2.0 * step
        low = high - step
        while high - low > 1e-3 * max(1.0, abs(high)):
            middle = 0.5 * (low + high)
            low, high = (
                (middle, high) if hexahedron_determinant.is_positive(D - middle * C) else (low, middle)
            )
        return low

    def problem(self) -> str | None:
        """Why the shell is not one to one, or None."""
        C, D = self._determinants
        if not hexahedron_determinant.is_positive(C):
            side = SIDES[_worst(C)]
            return (
                f"is folded before any operation, at side {side}: leave a gap between the cages on every"
                " side, and turn the inner cage's axes towards the outer cage's"
            )
        if not hexahedron_determinant.is_positive(D - LEAST_RATIO * C):
            return f"folds at side {SIDES[_worst(D - LEAST_RATIO * C)]}"
        return None

    @cached_property
    def _determinants(self) -> tuple[Array, Array]:
        return (
            hexahedron_determinant.determinant_coefficients(self.canonical_hexahedra),
            hexahedron_determinant.determinant_coefficients(self.deformed_hexahedra),
        )


def _hexahedra(inner: Array, outer: Array) -> Array:
    """Corners [6,8,3] of the shell hexahedra of inner and outer corners [8,3], each right-handed."""
    hexahedra = np.empty((6, 8, 3))
    for n, side in enumerate(SIDES):
        axis, bit = "xyz".index(side[1]), int(side[0] == "+")
        for k in range(8):
            on_face = k & ~(1 << axis) | bit << axis
            hexahedra[n, k] = outer[k] if k == on_face else inner[on_face]
    return hexahedra


def _through(source: Array, target: Array, points: Array) -> tuple[Array, Array]:
    """Points [N,3] from the hexahedra [6,8,3] that hold them into those of the same number."""
    best = np.full(len(points), np.inf)
    side = np.zeros(len(points), dtype=np.intp)
    coordinates = np.zeros_like(points)
    for n in range(6):
        low, high = source[n].min(axis=0), source[n].max(axis=0)
        slack = 1e-6 * (high - low).max()
        near = (best > 0.0) & ((points >= low - slack) & (points <= high + slack)).all(axis=1)
        rows = np.flatnonzero(near)
        u, found = hexahedron.inverse(source[n], points[rows])
        violation = np.where(found, np.maximum(-u, u - 1.0).max(axis=1).clip(0.0), np.inf)
        better = violation < best[rows]
        best[rows[better]], side[rows[better]], coordinates[rows[better]] = violation[better], n, u[better]
    if not np.isfinite(best).all():  # outside the shell, or in a fold
        rows = np.flatnonzero(~np.isfinite(best))
        side[rows], coordinates[rows] = _nearest(source, points[rows])
    coordinates = coordinates.clip(0.0, 1.0)  # a violation is a rounding of a face shared by two hexahedra
    mapped, J = np.empty_like(points), np.empty((len(points), 3, 3))
    for n in range(6):
        rows = np.flatnonzero(side == n)
        mapped[rows], J[rows] = map_hexahedron(source[n], target[n], coordinates[rows])
    return mapped, J


def _nearest(hexahedra: Array, points: Array) -> tuple[NDArray[np.intp], Array]:
    """(hexahedron number [N], u [N,3]) of the node of a 9^3 net in each hexahedron nearest to each point."""
    g = np.linspace(0.0, 1.0, 9)
    u = np.stack(np.meshgrid(g, g, g, indexing="ij"), axis=-1).reshape(-1, 3)
    net = np.concatenate([hexahedron.points(h, u) for h in hexahedra])
    nearest = np.array([int(np.argmin(((net - p) ** 2).sum(axis=1))) for p in points], dtype=np.intp)
    return nearest // len(u), u[nearest % len(u)]


def _matching_turn(inner_axes: Array, outer_axes: Array) -> NDArray[np.intp]:
    """Outer corner numbers [8] in the inner cage's order, under the proper turn that best aligns the axes."""
    alignment = (inner_axes.T @ outer_axes).ravel()
    fits = _TURN_SIGNS @ alignment
    # Ties go to the first turn, which is the identity.
    return np.asarray(_TURN_ORDERS[int(np.flatnonzero(fits > fits.max() - 1e-9)[0])])


def _turns() -> tuple[Array, NDArray[np.intp]]:
    """The 24 proper turns of the axes: signed permutation matrices [24,9] and corner orders [24,8]."""
    signs_of, orders = [], []
    for axes in permutations(range(3)):
        for signs in 1 - 2 * hexahedron.BITS.astype(np.intp):
            turn = np.eye(3)[list(axes)] * signs[:, None]
            if np.linalg.det(turn) > 0.0:
                signs_of.append(turn.ravel())
                orders.append(
                    [sum((k >> a & 1 ^ int(signs[a] < 0)) << axes[a] for a in range(3)) for k in range(8)]
                )
    return np.array(signs_of), np.array(orders, dtype=np.intp)


_TURN_SIGNS, _TURN_ORDERS = _turns()


def _at_corners(bernstein: Array) -> Array:
    return bernstein[:, ::2, ::2, ::2]


def _worst(bernstein: Array) -> int:
    return int(np.argmin(bernstein.reshape(6, -1).min(axis=1)))
