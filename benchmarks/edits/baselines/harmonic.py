"""The harmonic extension of a cage's motion: Laplace's equation for the displacement, on a regular grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Int, Mask
from cagefield.warps.hexahedron_map import HexahedronMap
from cagefield.warps.lattice import Lattice

RESOLUTION = 65
"""Nodes of the grid along each axis."""

_COARSEST = 17
_TOLERANCE = 1e-7
_MOST_STEPS = 2000
_BISECTIONS = 24
_LEAST_SHARE = 1e-3
"""A surface is taken to be at least this share of the spacing away from a node of the shell."""


@dataclass(frozen=True)
class HarmonicShell:
    """phi' = the identity plus the harmonic displacement that is phi's on the inner cage, 0 on the outer.

    Harmonic coordinates are linear in the values at the cage, so the deformation they give is the harmonic
    extension of the cage's displacement; DRFC weights its cage's vertices in this way. Solved backwards, as
    rendering needs it: in the deformed shell, for the displacement to canonical space. Laplace's equation
    holds at the nodes of a grid of `resolution`^3 over the outer cage's box that lie in the shell, with phi's
    displacement where a grid line crosses the inner cage's surface, and none where it crosses the outer's.
    Between nodes it is trilinear; nodes just beyond a surface are extrapolated across it.

    Source: Joshi et al., "Harmonic Coordinates for Character Articulation" (2007), section 3; for surfaces
    between nodes, Gibou et al., "A Second-Order-Accurate Symmetric Discretization of the Poisson Equation on
    Irregular Domains" (2002), section 3.
    """

    inner: HexahedronMap
    outer: Cage
    resolution: int = RESOLUTION

    @classmethod
    def from_cages(cls, inner: Cage, deformed: Cage, outer: Cage) -> HarmonicShell:
        """The shell map on the usual grid."""
        return cls(HexahedronMap(inner, deformed), outer)

    @cached_property
    def lattice(self) -> Lattice:
        """The solution; its box is the outer cage's, for a box, else one along the nearest rotation."""
        R = self.resolution
        origin, frame = _box_around(self.outer)
        g = np.linspace(0.0, 1.0, R)
        z, y, x = np.meshgrid(g, g, g, indexing="ij")
        nodes = origin + np.stack([x, y, z], axis=-1).reshape(-1, 3) @ frame.T
        edge = [(a == 0.0) | (a == 1.0) for a in (x, y, z)]
        inside, canonical, _ = self.inner(nodes)
        displacement = np.zeros_like(nodes)
        displacement[inside] = canonical - nodes[inside]
        free = self.outer.contains(nodes) & ~inside & ~(edge[0] | edge[1] | edge[2]).ravel()
        rows = np.flatnonzero(free)
        start = np.zeros((len(rows), 3))
        if (R + 1) // 2 >= _COARSEST:
            coarser = HarmonicShell(self.inner, self.outer, (R + 1) // 2).lattice
            start = coarser.to_canonical(nodes[rows])[0] - nodes[rows]
        weights = ((R - 1) / np.linalg.norm(frame, axis=0)) ** 2
        at = np.concatenate([rows] * 6)
        to = np.concatenate([rows + step for stride in (1, R, R * R) for step in (-stride, stride)])
        weight = np.repeat(weights, 2 * len(rows))
        cut = ~free[to]
        values, share = self._surface(nodes[at[cut]], nodes[to[cut]])
        weight[cut] /= np.maximum(share, _LEAST_SHARE)
        displacement[rows] = _solve(rows, at, to, cut, weight, values, start)
        # The nodes beyond a surface: so that interpolation meets the value at the crossing.
        share = np.maximum(share, 0.25)
        total, count = np.zeros_like(nodes), np.zeros(len(nodes))
        np.add.at(total, to[cut], values - (1.0 - share[:, None]) * displacement[at[cut]])
        np.add.at(count, to[cut], share)
        beyond = count > 0.0
        displacement[beyond] = total[beyond] / count[beyond, None]
        return Lattice(origin, frame, displacement.reshape(R, R, R, 3))

    def _surface(self, start: Array, end: Array) -> tuple[Array, Array]:
        """(displacement [N,3], share of the way [N]) where ways [N,3] out of the shell leave it."""
        low, high = np.zeros(len(start)), np.ones(len(start))
        inwards = self.inner.deformed.contains(end)
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            points = start + middle[:, None] * (end - start)
            out = np.where(inwards, self.inner.deformed.contains(points), ~self.outer.contains(points))
            low, high = np.where(out, low, middle), np.where(out, middle, high)
        displacement = np.zeros_like(start)
        on = start + high[:, None] * (end - start)
        rows = np.flatnonzero(inwards)
        _, canonical, _ = self.inner(on[rows])  # `high` is always in the closed cage
        displacement[rows] = canonical - on[rows]
        return displacement, high

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in the shell."""
        return self.lattice.to_canonical(points)


def _box_around(cage: Cage) -> tuple[Array, Array]:
    """(origin [3], edge vectors as columns [3,3]) of the least box, with right angles, along the cage."""
    U, _, Vt = np.linalg.svd(cage.axes)
    R = U @ Vt
    along = cage.corners @ R
    low, high = along.min(axis=0), along.max(axis=0)
    return R @ low, R * (high - low)


def _solve(rows: Int, at: Int, to: Int, cut: Mask, weight: Array, values: Array, start: Array) -> Array:
    """x [M,C] at the nodes `rows` with sum of weight (x_at - x_to) = 0 over the edges at each of them.

    Edges [E] lead from `at`, one of the rows, `to` another or, where `cut`, to a value [K,C] of its own.
    """
    number = np.full(int(to.max()) + 1, -1, dtype=np.intp)
    number[rows] = np.arange(len(rows))
    size = len(rows)
    own, other = number[at], number[to]
    entries = np.concatenate([np.bincount(own, weight, size), -weight[~cut]])
    places = np.concatenate([np.arange(size), own[~cut]]), np.concatenate([np.arange(size), other[~cut]])
    matrix = sparse.csr_array((entries, places), shape=(size, size))
    right = np.zeros((size, values.shape[1]))
    np.add.at(right, own[cut], weight[cut, None] * values)
    return conjugate_gradients(matrix, right, start)


def conjugate_gradients(matrix: sparse.csr_array, right: Array, start: Array) -> Array:
    """x [N,C] with matrix x = right to 1e-7 of each column; the matrix is symmetric, positive definite.

    Preconditioned with the diagonal.
    """
    scale = 1.0 / matrix.diagonal()[:, None]
    x = start.copy()
    residual = right - matrix @ x
    step = scale * residual
    product = _dots(residual, step)
    enough = _TOLERANCE**2 * _dots(right, scale * right)
    for _ in range(_MOST_STEPS):
        if (product <= enough).all():
            break
        image = matrix @ step
        length = _ratio(product, _dots(step, image))
        x += length * step
        residual -= length * image
        better = scale * residual
        before, product = product, _dots(residual, better)
        step = better + _ratio(product, before) * step
    return x


def _dots(a: Array, b: Array) -> Array:
    """The products of columns [C] of [N,C], three times as fast as by `sum`."""
    return np.einsum("nc,nc->c", a, b)


def _ratio(a: Array, b: Array) -> Array:
    """a / b, 0 where b is 0: a column that is solved already."""
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0.0)
