"""Validation of cage corners and vectors; `CageError` names the value and the cure."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import CageError
from cagefield.geometry import bspline_lattice, hexahedron, hexahedron_determinant, lattice_determinant
from cagefield.typing import Array, Mask

MOST_POINTS = 8
"""Control points of a lattice along an axis."""

_FLAT = 1e-9
"""Least Jacobian determinant of a valid cage, as a share of the product of its mean edge lengths."""


def vector(value: ArrayLike, name: str) -> Array:
    """A finite float64 vector [3], or a `CageError` that names it."""
    return read_only(value, (3,), name)


def factors(value: ArrayLike, name: str) -> Array:
    """Three positive finite factors [3] from one or three, or a `CageError` that names them."""
    raw = np.asarray(value, dtype=np.float64)
    v = read_only(np.full(3, raw) if raw.ndim == 0 else raw, (3,), name)
    if not (v > 0.0).all():
        axis = int(np.argmin(v))
        raise CageError(f"{name} must be positive along every axis, got {v[axis]:g} along {'xyz'[axis]}")
    return v


def read_only(value: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """A finite float64 array that cannot be written, or a `CageError` that names it."""
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise CageError(f"{name} must be numbers of shape {list(shape)}, got {value!r}") from None
    if array.shape != shape:
        raise CageError(f"{name} must have shape {list(shape)}, got {list(array.shape)}")
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0]
        label = f"{name}: corner {where[0]}" if len(shape) == 2 else name
        shown = array[where[0]] if len(shape) == 2 else array
        raise CageError(f"{label} must be finite, got {format_vector(shown)}")
    array.setflags(write=False)
    return array


def format_vector(v: Array) -> str:
    """A point as text, "(0.41, 0.10, 0.93)"."""
    return "(" + ", ".join(f"{x:.4g}" for x in v) + ")"


def corner_number(corner: int) -> int:
    """The number of a corner, 0 to 7, or a `CageError`."""
    if isinstance(corner, bool) or not isinstance(corner, (int, np.integer)) or not 0 <= corner <= 7:
        raise CageError(f"corner {corner!r} is not a corner of a cage: corners are 0 to 7, k = x + 2y + 4z")
    return int(corner)


def point_numbers(points: Iterable[int], count: int) -> NDArray[np.intp]:
    """Numbers [k] of points of a cage with that many, each named once, or a `CageError`."""
    chosen = list(points)
    for point in chosen:
        if isinstance(point, bool) or not isinstance(point, int | np.integer) or not 0 <= point < count:
            raise CageError(f"point {point!r} is not a point of this cage: its points are 0 to {count - 1}")
    if not chosen or len(set(chosen)) < len(chosen):
        raise CageError(f"points must name one or more points, each once, got {chosen}")
    return np.array(chosen, dtype=np.intp)


def lattice_shape(shape: Iterable[int]) -> tuple[int, int, int]:
    """Control points along x, y and z, 2 to `MOST_POINTS` each, or a `CageError`."""
    counts = list(shape)
    whole = all(isinstance(n, int | np.integer) and not isinstance(n, bool) for n in counts)
    if len(counts) != 3 or not whole or not all(2 <= n <= MOST_POINTS for n in counts):
        raise CageError(
            f"a lattice has 2 to {MOST_POINTS} control points along each of three axes (1 to"
            f" {MOST_POINTS - 1} cells), got points {counts}"
        )
    return int(counts[0]), int(counts[1]), int(counts[2])


def check_lattice(
    points: Array, shape: tuple[int, int, int], interpolation: str, *, proven: bool = False
) -> None:
    """Raise `CageError` where the determinant of a lattice with points [n,3] is not proven positive."""
    if interpolation not in bspline_lattice.INTERPOLATIONS:
        names = " or ".join(bspline_lattice.INTERPOLATIONS)
        raise CageError(f'interpolation must be {names}, got "{interpolation!s:.40}"')
    if proven:
        return
    answer, cell = lattice_determinant.verdict(points, shape, interpolation)
    if answer == "proven":
        return
    if answer == "undecided":
        raise CageError(
            f"lattice is too close to folding in cell {cell}: its determinant is not proven positive there;"
            " move the control points around that cell less"
        )
    A, _ = lattice_determinant.fit(points, shape)
    if abs(np.linalg.det(A)) <= _FLAT * np.linalg.norm(A, axis=0).prod():
        raise CageError("lattice has zero size: its control points span no volume")
    if np.linalg.det(A) < 0.0:
        raise CageError("lattice is mirrored: list its control points x fastest, in a right-handed frame")
    least, u = lattice_determinant.least_determinant(points, shape, interpolation)
    near = np.round(u * (np.array(shape) - 1)).astype(int)
    number = int(near[0] + shape[0] * (near[1] + shape[1] * near[2]))
    raise CageError(
        f"lattice is inside out in cell {cell}, near control point {number} at"
        f" {format_vector(points[number])}: its determinant falls to {least:.3g} of its mean and must stay"
        " positive; move the control points there less"
    )


def are_valid(corners: Array) -> Mask:
    """Mask [B] of the corners [B,8,3] that a `Cage` may have."""
    bernstein, lengths = _orientation(corners)
    floor = _FLAT * lengths.prod(axis=1)
    return (floor > 0.0) & hexahedron_determinant.are_positive(bernstein - floor[:, None, None, None])


def _orientation(corners: Array) -> tuple[Array, Array]:
    """(Bernstein coefficients [B,3,3,3] of the determinants, mean edges [B,3] along each axis)."""
    tails, heads = np.array(hexahedron.EDGES).T
    lengths = np.linalg.norm(corners[:, heads] - corners[:, tails], axis=2)
    return hexahedron_determinant.determinant_coefficients(corners), lengths.reshape(-1, 3, 4).mean(axis=2)


def _is_nearly_a_box(corners: Array) -> bool:
    """True only of corners [8,3] that `are_valid`, by a bound that takes a tenth of its time.

    With columns A of the Jacobian at the center and K the largest bend, an edge is 2 A within 8 |K|, and the
    determinant of any three edges, one along each axis, is 8 det A within 8 ((a + 4 K)^3 - a^3), a = max |A|.
    """
    C = hexahedron.coefficients(corners)
    (a, b, c), bends = C[[1, 2, 4]].tolist(), C[[3, 5, 6, 7]]
    cross = (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0])
    det = a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]
    size = math.sqrt(max(x * x + y * y + z * z for x, y, z in (a, b, c)))
    most = size + 4.0 * math.sqrt(3.0) * float(np.abs(bends).max())
    volume = size * size * size
    return det > 2.0 * (most * most * most - volume) + 1e-6 * volume


def check_orientation(corners: Array) -> None:
    """Raise `CageError` where the Jacobian determinant is not positive over the whole hexahedron."""
    if _is_nearly_a_box(corners) or are_valid(corners[None])[0]:
        return
    bernstein, lengths = (each[0] for each in _orientation(corners[None]))
    floor = _FLAT * lengths.prod()
    at_corners = bernstein[::2, ::2, ::2].transpose(2, 1, 0).ravel()  # corner k = x + 2y + 4z
    k = int(np.argmin(at_corners))
    where = f"corner {k} at {format_vector(corners[k])}"
    if lengths.min() == 0.0 or np.abs(at_corners).max() <= floor:
        raise CageError(
            f"cage has zero size: its mean edges along x, y, z are {format_vector(lengths)} long and {where}"
            " spans no volume; give it a positive size along every axis"
        )
    if at_corners.max() < 0.0:
        raise CageError(
            f"cage is mirrored: the Jacobian determinant is negative at every corner ({at_corners[k]:.3g} at"
            f" {where}); list the corners in the order k = x + 2y + 4z of a right-handed frame"
        )
    if at_corners.min() > floor:
        g = np.linspace(0.0, 1.0, 17)
        u = np.stack(np.meshgrid(g, g, g, indexing="ij"), axis=-1).reshape(-1, 3)
        det = np.linalg.det(hexahedron.jacobian(corners, u))
        worst = int(np.argmin(det))
        k = int(np.argmin(((hexahedron.BITS - u[worst]) ** 2).sum(axis=1)))
        raise CageError(
            f"cage is inside out between its corners, nearest to corner {k} at {format_vector(corners[k])}:"
            f" the Jacobian determinant there falls to {det[worst]:.3g} and must stay positive; move corner"
            f" {k} away from the middle of the cage"
        )
    raise CageError(
        f"cage is inside out at {where}: the Jacobian determinant there is {at_corners[k]:.3g} and must be"
        f" positive; move corner {k} back from the opposite faces"
    )


def check_shear(S: Array) -> None:
    """Raise `CageError` for a shear [3,3] that is not finite or turns space inside out."""
    if not np.isfinite(S).all():
        raise CageError(f"shear factors must be finite, got {_named_shears(S)}")
    if np.linalg.det(S) <= 0.0:
        raise CageError(
            f"shear must not turn space inside out: {_named_shears(S)} has determinant"
            f" {np.linalg.det(S):.3g}; use smaller factors"
        )


def _named_shears(S: Array) -> str:
    names = {f"{a}{b}": S[i, j] for i, a in enumerate("xyz") for j, b in enumerate("xyz") if i != j}
    return ", ".join(f"{name}={value:g}" for name, value in names.items() if value != 0.0)
