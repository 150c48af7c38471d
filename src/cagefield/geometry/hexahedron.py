"""The trilinear hexahedron: map, Jacobian and inverse, in float64.

Notation: corners v_k, k = x + 2y + 4z with x, y, z in {0, 1} (VTK voxel order); u in [0,1]^3;
x(u) = sum_k N_k(u) v_k with N_k the trilinear weights. Internally xi = 2u - 1 and the monomial form

    x(xi) = C_0 + C_1 xi + C_2 eta + C_4 zeta + C_3 xi eta + C_5 xi zeta + C_6 eta zeta + C_7 xi eta zeta

whose index has the bits of its variables. The inverse works on y = W (x - C_0) with W the inverse of the
Jacobian at the center, so that y = xi + (four terms that vanish on parallelepipeds): thin and sheared
hexahedra are as well conditioned as cubes. `hex_determinant` tests the Jacobian's sign.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from cagefield.typing import Array, Mask

BITS: Array = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)], dtype=np.float64)
"""[8,3] u of the eight corners."""

EDGES: tuple[tuple[int, int], ...] = tuple(
    (i, i | 1 << axis) for axis in range(3) for i in range(8) if not i >> axis & 1
)
"""Pairs (i, j) of corners, i < j, that differ in one bit."""

FACES: dict[str, tuple[int, int, int, int]] = {
    f"{sign}{name}": tuple(k for k in range(8) if (k >> axis & 1) == bit)  # type: ignore[misc]
    for axis, name in enumerate("xyz")
    for sign, bit in (("+", 1), ("-", 0))
}
"""The corners of each face, by its name."""

_SIGNS = 2.0 * BITS - 1.0
_TO_MONOMIAL: Array = (
    np.array([[np.prod(_SIGNS[k] ** BITS[m]) for k in range(8)] for m in range(8)], dtype=np.float64) / 8.0
)
_CHUNK = 16384
_DEPTH = 12
_ON_FACE = 1e-11
"""A point this close to a hexahedron, as a share of its half-size, is on its face; besides the rounding of
the point's own coordinates."""


def coefficients(corners: Array) -> Array:
    """Monomial coefficients C [...,8,3] of hexahedra with corners [...,8,3]."""
    return np.asarray(_TO_MONOMIAL @ corners)


def points(corners: Array, u: Array) -> Array:
    """x(u) [N,3] for u [N,3] in a hexahedron with corners [8,3]."""
    return np.ascontiguousarray(_evaluate(coefficients(corners), 2.0 * u.T - 1.0).T)


def jacobian(corners: Array, u: Array) -> Array:
    """dx/du [N,3,3] at u [N,3]; column j is the derivative along u_j."""
    columns = _derivative(coefficients(corners), 2.0 * u.T - 1.0)  # [3 (u_j), 3 (x_i), N]
    return np.ascontiguousarray(2.0 * np.transpose(columns, (2, 1, 0)))


def inverse(corners: Array, targets: Array) -> tuple[Array, Mask]:
    """u [N,3] with x(u) = targets [N,3], and a mask [N] of the points where such a u was found.

    Every target that has a preimage in [0,1]^3 gets it, if the determinant is positive over the hexahedron.
    Others get a preimage outside the cube, or none (mask False, u unspecified); targets outside the hull of
    the corners are not tried. A target on a face up to rounding gets a u on that face.

    Damped Newton with the analytic Jacobian from the affine guess; targets that it did not take to [0,1]^3
    are tried again from the centers of the sub-hexahedra whose boxes hold them, so that no preimage in the
    cube is missed.
    """
    C = coefficients(corners)
    W = center_inverse(C)
    y = (targets - C[0]) @ W.T
    on_face = face_tolerance(corners, W)
    K = C[[3, 5, 6, 7]] @ W.T  # y = xi + K0 xi eta + K1 xi zeta + K2 eta zeta + K3 xi eta zeta
    if np.abs(K).max() < 1e-14:  # a parallelepiped up to rounding
        xi = np.where(np.abs(y) <= 1.0 + on_face, y.clip(-1.0, 1.0), y)
        return 0.5 * (xi + 1.0), all_three(np.isfinite(y))
    local = (corners - C[0]) @ W.T
    rows = np.flatnonzero(_in_hull(local, y))
    y = y[rows]
    xi = np.empty_like(y)
    found = np.empty(len(y), dtype=bool)
    for start in range(0, len(y), _CHUNK):
        part = slice(start, start + _CHUNK)
        xi[part], found[part] = _newton(K, y[part], y[part].clip(-1.0, 1.0))
    _snap(K, y, xi, on_face)
    retry = np.flatnonzero(~found | (np.abs(xi).max(axis=1, initial=0.0) > 1.0))
    if len(retry):
        better, where = _newton_from_cells(K, y[retry], on_face)
        xi[retry[where]] = better[where]
        found[retry[where]] = True
    u, mask = np.full(targets.shape, np.nan), np.zeros(len(targets), dtype=bool)
    u[rows], mask[rows] = 0.5 * (xi + 1.0), found
    return u, mask


def face_tolerance(corners: Array, W: Array) -> float:
    """Excess of |xi| over 1 up to which a point is on a face; W [3,3] as `center_inverse` returns it."""
    rounding = np.finfo(np.float64).eps * np.abs(corners).max() * np.abs(W).sum(axis=1).max()
    return float(_ON_FACE + 100.0 * rounding)


def center_inverse(C: Array) -> Array:
    """W [3,3], the inverse of dx/dxi at the center of the hexahedron with monomial coefficients C [8,3].

    A singular one, as only folded hexahedra have, is moved off zero by 1e-9 of its size.
    """
    J = C[[1, 2, 4]].T
    size = np.abs(J).max()
    if abs(np.linalg.det(J / size)) < 1e-15:
        J = J + 1e-9 * size * np.eye(3)
    return np.asarray(np.linalg.inv(J))


def invert(matrices: Array) -> Array:
    """The inverses [N,3,3] of matrices [N,3,3], by cofactors; singular ones have it moved off zero."""
    rows = [matrices[:, i].T for i in range(3)]
    size = np.abs(matrices).max(axis=(1, 2), initial=1e-300)
    a, b, c = (row / size for row in rows)
    cofactors = [cross(b, c), cross(c, a), cross(a, b)]
    det = _off_zero((a * cofactors[0]).sum(axis=0), 1e-30)
    return np.ascontiguousarray(np.transpose(np.stack(cofactors) / (det * size), (2, 1, 0)))


def inside(u: Array, found: Mask) -> Mask:
    """Mask [N] of the points whose u, as `inverse` returns it, lies in the closed unit cube."""
    return found & all_three((u >= 0.0) & (u <= 1.0))


def all_three(mask: Mask) -> Mask:
    """Where all of [N,3] are True: `all(axis=1)` takes ten times as long."""
    return np.asarray(mask[:, 0] & mask[:, 1] & mask[:, 2])


def _evaluate(C: Array, xi: Array) -> Array:
    """x [3,N] at xi [3,N]; the component axis comes first so that numpy's inner loops are long."""
    x, y, z = xi
    c = C[:, :, None]
    return np.asarray(c[0] + c[1] * x + y * (c[2] + c[3] * x) + z * (c[4] + c[5] * x + y * (c[6] + c[7] * x)))


def _derivative(C: Array, xi: Array) -> tuple[Array, Array, Array]:
    """The three columns [3,N] of dx/dxi at xi [3,N]."""
    x, y, z = xi
    c = C[:, :, None]
    return (
        c[1] + c[3] * y + z * (c[5] + c[7] * y),
        c[2] + c[3] * x + z * (c[6] + c[7] * x),
        c[4] + c[5] * x + y * (c[6] + c[7] * x),
    )


def _newton(K: Array, y: Array, start: Array) -> tuple[Array, Mask]:
    """Roots xi [N,3] of xi + K-terms = y [N,3] from a start, and a mask of those with residual < 1e-11."""
    C = _centered(K)
    y, xi = y.T.copy(), start.T.copy()
    residual = _evaluate(C, xi) - y
    size = np.abs(residual).max(axis=0)
    # Below this the residual is the rounding of its own evaluation.
    arrived = 4e-16 * (1.0 + np.abs(y).max(axis=0, initial=0.0))
    active = np.flatnonzero(size > arrived)
    for _ in range(40):
        if len(active) == 0:
            break
        step = solve(_derivative(C, xi[:, active]), residual[:, active])
        # A step of more than one cell leaves the region in which the linearisation says anything.
        step /= np.maximum(1.0, np.abs(step).max(axis=0) / 2.0)
        before = size[active]
        _line_search(C, y, xi, residual, size, active, step)
        # A point that creeps is stuck at a fold outside the hexahedron, or has converged.
        active = active[(size[active] < 0.9 * before) & (size[active] > arrived[active])]
    return np.ascontiguousarray(xi.T), np.asarray(size < 1e-11)


def _centered(K: Array) -> Array:
    """Monomial coefficients [8,3] of xi + K-terms."""
    return np.concatenate([np.zeros((1, 3)), np.eye(3)[:2], K[:1], np.eye(3)[2:], K[1:]])


def _snap(K: Array, y: Array, xi: Array, tolerance: float) -> None:
    """Move roots xi [N,3] just outside [-1,1]^3 onto the cube where that is a root, too, up to rounding.

    Near a corner where the determinant almost vanishes, rounding of the point moves xi by far more than
    rounding: the residual decides, not xi.
    """
    excess = np.abs(xi).max(axis=1, initial=0.0) - 1.0
    near = np.flatnonzero((excess > 0.0) & (excess < 1e-3))
    clipped = xi[near].clip(-1.0, 1.0)
    residual = np.abs(_evaluate(_centered(K), clipped.T) - y[near].T).max(axis=0)
    close = residual <= tolerance
    xi[near[close]] = clipped[close]


def _line_search(
    C: Array, y: Array, xi: Array, residual: Array, size: Array, rows: NDArray[np.intp], step: Array
) -> None:
    """Move the given columns of xi [3,N] by -step, halved until the residual falls, in place."""
    for _ in range(8):
        trial = xi[:, rows] - step
        new = _evaluate(C, trial) - y[:, rows]
        new_size = np.abs(new).max(axis=0)
        better = new_size < size[rows]
        moved = rows[better]
        xi[:, moved], residual[:, moved], size[moved] = trial[:, better], new[:, better], new_size[better]
        # A point that no longer improves at rounding level has converged.
        worse = ~better & (size[rows] > 1e-14)
        if not worse.any():
            return
        rows, step = rows[worse], 0.5 * step[:, worse]


def _newton_from_cells(K: Array, y: Array, on_face: float) -> tuple[Array, Mask]:
    """Roots in [-1,1]^3 found from the centers of the sub-hexahedra whose boxes hold y, and their mask.

    A sub-hexahedron lies in the box of its own eight corners. Newton's method is tried from those of the
    512, and for the remaining points, near corners where the determinant almost vanishes, from ever smaller
    ones.
    """
    C = _centered(K)
    best = np.zeros((len(y), 3))
    done = np.zeros(len(y), dtype=bool)
    rows, cell = np.arange(len(y)), np.zeros((len(y), 3), dtype=np.intp)
    for level in range(1, _DEPTH + 1):
        cell = (2 * cell[:, None] + BITS.astype(np.intp)).reshape(-1, 3)
        rows = np.repeat(rows, 8)
        low, high = _cell_boxes(C, cell, level)
        holds = ((y[rows] >= low) & (y[rows] <= high)).all(axis=1)
        rows, cell = rows[holds], cell[holds]
        if len(rows) == 0:
            break
        if level >= 3:
            middle: Array = np.asarray((2 * cell + 1) * 0.5**level - 1.0, dtype=np.float64)
            xi, found = _newton(K, y[rows], middle)
            _snap(K, y[rows], xi, on_face)
            good = found & np.asarray(np.abs(xi).max(axis=1, initial=0.0) <= 1.0)
            best[rows[good]], done[rows[good]] = xi[good], True
            rows, cell = rows[~done[rows]], cell[~done[rows]]
    return best, done


def _cell_boxes(C: Array, cell: NDArray[np.intp], level: int) -> tuple[Array, Array]:
    """(min [M,3], max [M,3]) of the sub-hexahedra with indices [M,3] out of 2^level along each axis."""
    slack = 1e-9
    if level <= 3:  # few cells, asked for by many points
        g = np.linspace(-1.0, 1.0, 2**level + 1)
        nodes = np.stack(np.meshgrid(g, g, g, indexing="ij")).reshape(3, -1)
        net = _evaluate(C, nodes).reshape(3, len(g), len(g), len(g))
        corners = np.stack([net[:, _ends(i)][:, :, _ends(j)][:, :, :, _ends(k)] for i, j, k in BITS])
        at = (slice(None), *cell.T)
        return corners.min(axis=0)[at].T - slack, corners.max(axis=0)[at].T + slack
    xi = (cell[:, None] + BITS) * 0.5 ** (level - 1) - 1.0
    corners = _evaluate(C, xi.reshape(-1, 3).T).T.reshape(-1, 8, 3)
    return corners.min(axis=1) - slack, corners.max(axis=1) + slack


def _ends(bit: float) -> slice:
    """All nodes of an axis but the last (0) or the first (1)."""
    return slice(1, None) if bit else slice(None, -1)


def _in_hull(local: Array, y: Array) -> Mask:
    """Mask [N] of the points that a box and the six face normals do not prove to be outside the hull."""
    normals = [np.eye(3)]
    for axis, side in product(range(3), (0, 1)):
        face = local[BITS[:, axis] == side]
        normals.append(np.cross(face[3] - face[0], face[2] - face[1])[None])
    n = np.concatenate(normals)
    reach = local @ n.T
    slack = 1e-9 * np.abs(reach).max(axis=0)
    along = y @ n.T
    inside = (along >= reach.min(axis=0) - slack) & (along <= reach.max(axis=0) + slack)
    return np.asarray(inside.all(axis=1))


def solve(J: tuple[Array, Array, Array], r: Array) -> Array:
    """J^-1 r [3,N] by Cramer's rule, from the columns [3,N] of J; singular J are moved off zero."""
    a, b, c = J
    bc, ar = cross(b, c), cross(a, r)
    det = _off_zero((a * bc).sum(axis=0), 1e-12)
    return np.stack([(r * bc).sum(axis=0), (c * ar).sum(axis=0), -(b * ar).sum(axis=0)]) / det


def _off_zero(values: Array, least: float) -> Array:
    return np.where(np.abs(values) < least, np.copysign(least, values), values)


def cross(a: Array, b: Array) -> Array:
    """a x b of vectors [3,...]; the component axis comes first."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
