"""Cages around selections: an oriented box with few outliers, its division for a lattice.

The box is the smallest by volume over rotations, found from the principal axes and from the world's: its
objective is the product of the extents between two quantiles, so that outliers do not turn it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.errors import CagefieldError
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32

OUTLIER_QUANTILE = 0.005
"""Share of the positions on each side of the box that may be outliers."""

OUTLIER_GAP = 0.1
"""Positions beyond the quantile by at most this share of the extent are no outliers."""

FITTED_POINTS = 4000
"""Positions from which the rotation is found, at most."""

UPRIGHT_GAIN = 0.97
"""A turned box replaces the upright one where its volume is below this share of it."""

MIN_EDGE_SHARE = 1e-3
"""Shortest edge of a box, as a share of its longest: a flat selection gets a thin box."""

OUTER_MARGIN_SHARE = 0.6
"""Margin of an outer cage, in middle edges of the inner one."""


def oriented_box(points: Array, *, margin: float = 0.0, radii: Array | Float32 | float = 0.0) -> Cage:
    """Box around points [N,3] with a margin, world units; few outliers may be outside.

    A point counts as a ball of its radius, `radii` [N] or one for all. The box's axes are those nearest to
    the world's. Points that are at most OUTLIER_GAP of the extent beyond the quantiles are inside.

    Raises CagefieldError without points, for NaN, or a negative margin.
    """
    p = np.asarray(points, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3 or not len(p):
        raise CagefieldError("a box needs at least one point [N,3]: nothing is selected")
    if not np.isfinite(p).all() or not margin >= 0.0:
        raise CagefieldError("points and margin of a box must be finite, and the margin 0 or more")
    r = np.broadcast_to(np.asarray(radii, dtype=np.float64), (len(p),))
    stride = -(-len(p) // FITTED_POINTS)
    turn = _smallest_rotation(p[::stride])
    axes = _nearest_to_world(turn)
    u = p @ axes
    low, high = _extent(u - r[:, None], u + r[:, None])
    low, high = low - margin, high + margin
    longest = float((high - low).max())
    thin = (
        np.maximum(0.5 * (MIN_EDGE_SHARE * longest - (high - low)), 0.0)
        if longest > 0.0
        else np.full(3, 1e-6)
    )
    low, high = low - thin, high + thin
    return Cage((low + hexahedron.BITS * (high - low)) @ axes.T)


def outer_cage_of_box(inner: Cage) -> Cage:
    """Outer cage of a box of any proportions: its margin is OUTER_MARGIN_SHARE of the box's middle edge."""
    lengths = np.linalg.norm(inner.affine[0], axis=0)
    return inner.grown(OUTER_MARGIN_SHARE * float(np.median(lengths)))


def lattice_cells(cage: Cage, most: int = 4) -> tuple[int, int, int]:
    """Cells along each axis that divide a box into lattice cells as near to cubes as possible.

    The longest axis has `most` cells, up to 7, others 1 or more in proportion.
    """
    if not 1 <= most <= 7:
        raise CagefieldError(f"a lattice has 1 to 7 cells along an axis, not {most}")
    lengths = np.linalg.norm(cage.affine[0], axis=0)
    cells = np.clip(np.round(most * lengths / lengths.max()), 1, most).astype(int)
    return int(cells[0]), int(cells[1]), int(cells[2])


def _smallest_rotation(p: Array) -> Array:
    """Rotation [3,3], axes as columns, with the least volume between quantiles."""
    upright = np.eye(3)
    starts = [upright]
    if len(p) > 3:
        _, _, vt = np.linalg.svd(p - np.median(p, axis=0), full_matrices=False)
        starts.append(vt.T if np.linalg.det(vt) > 0.0 else -vt.T)
    best = min((_descend(p, start) for start in starts), key=lambda found: found[0])
    return best[1] if best[0] < UPRIGHT_GAIN * _volume(p, upright) else upright


def _descend(p: Array, turn: Array) -> tuple[float, Array]:
    """(volume, rotation) after steps about each axis that shrink the box, halved until they are small."""
    volume, step = _volume(p, turn), np.radians(20.0)
    while step > np.radians(0.3):
        improved = False
        for axis in range(3):
            for sign in (1.0, -1.0):
                rotvec = np.zeros(3)
                rotvec[axis] = sign * step
                other = turn @ Rotation.from_rotvec(rotvec).as_matrix()
                size = _volume(p, other)
                if size < volume * (1.0 - 1e-9):
                    volume, turn, improved = size, other, True
        if not improved:
            step *= 0.5
    return volume, turn


def _volume(p: Array, axes: Array) -> float:
    """Product of the extents between quantiles, each at least a share of the longest."""
    u = np.sort(p @ axes, axis=0)
    cut = int(OUTLIER_QUANTILE * len(u))
    lengths = u[len(u) - 1 - cut] - u[cut]
    return float(np.prod(np.maximum(lengths, MIN_EDGE_SHARE * lengths.max())))


def _extent(low: Array, high: Array) -> tuple[Array, Array]:
    """(low [3], high [3]) of intervals [N,3], without outliers."""
    first, last = np.sort(low, axis=0), np.sort(high, axis=0)
    cut = int(OUTLIER_QUANTILE * len(low))
    a, b = first[cut], last[len(last) - 1 - cut]
    gap = OUTLIER_GAP * (b - a)
    near_low = np.where(first >= a - gap, first, np.inf).min(axis=0)
    near_high = np.where(last <= b + gap, last, -np.inf).max(axis=0)
    return near_low, near_high


def _nearest_to_world(turn: Array) -> Array:
    """The columns of a rotation, in order and direction nearest to the world's axes; right-handed."""
    from scipy.optimize import linear_sum_assignment

    _, order = linear_sum_assignment(-np.abs(turn))
    axes = turn[:, order]
    axes = axes * np.where(np.diagonal(axes) < 0.0, -1.0, 1.0)
    if np.linalg.det(axes) < 0.0:
        weakest = int(np.argmin(np.abs(np.diagonal(axes))))
        axes[:, weakest] *= -1.0
    return np.asarray(axes)
