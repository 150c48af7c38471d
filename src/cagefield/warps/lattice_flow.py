"""The flow Phi that follows a lattice on its way through an outer cage; see `lattice_shell`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from cagefield.geometry import bspline_lattice, hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32
from cagefield.warps.extended_coordinates import Extended
from cagefield.warps.falloff import Falloff
from cagefield.warps.lattice_motion import Piece

STEP_STRAIN = 0.8
"""Most h |dv/dz| of a step; one is one to one below 2, where 1 - h/2 dv/dz is invertible."""

ENOUGH_STRAIN = 0.9
"""h |dv/dz| of a step that is not made shorter."""

LEAST_STEPS, MOST_STEPS = 6, 96

MARGIN = 1.0
"""Width around the lattice, in cells of the grid, in which all moves with it: as far as they interpolate."""

MAX_LATTICE_SAMPLES = 32
"""Most samples of a lattice, which its velocity far away is made of."""

SLOPE = 0.75
"""Slope of the smooth falloff at the outer cage, see `Falloff`."""


@dataclass(frozen=True)
class LatticeFlow:
    """Flow of V^o onto itself, z -> Phi(z) in the outer cage's coordinates z in [-1,1]^3.

    The velocity at x: each sample j of the lattice tells, by its own affine map, coordinates u_j(x). The
    means over the samples, with weights (|x - x_j|^2 + blur)^-3, of the distance between u_j(x) and the
    lattice, d_i, and of the lattice's velocity at clamp u_j(x), make w V, with w the weight of `Falloff` at
    d_i / d_o. Near the lattice, the distance and V are its own. The velocity is interpolated (trilinear in z)
    from a grid of nodes, one slice for each step.

    A step is the implicit midpoint rule, z' = m + h/2 v(m), z = m - h/2 v(m): backwards it is its own
    inverse, and it is one to one where h/2 |dv/dz| < 1, which the grid's differences bound.

    Chosen by measurement (`benchmarks/lattice_profiles.py` and three random lattices, 13 edits), geometric
    means of the least det J and the largest stretch around the lattice: 0.136 and 10.9; margin 0.7 0.086 and
    12.0, 1.4 0.105 and 15.4; slope at the outer cage 0.5 0.132 and 12.1, 0.95 0.134 and 10.6; 64 samples and
    32 are alike. A grid of 24 cells and 8 steps at least are no better than 20 and 6;
    4 steps leave nodes twice as far off.

    Parameters: the pieces of the way, the outer cage, the falloff, the grid's cells along each axis.
    """

    pieces: tuple[Piece, ...]
    outer: Cage
    falloff: Falloff
    cells: int

    @cached_property
    def confines(self) -> Extended:
        """The outer cage's coordinates z."""
        return Extended.from_cage(self.outer)

    @property
    def is_one_to_one(self) -> bool:
        """True where each step is proven one to one."""
        return bool(self._velocities[2] < 2.0)

    @property
    def velocities(self) -> Float32:
        """dz/ds [K,G,G,G,3] at the nodes of the grid, z slowest, one slice for each step."""
        return self._velocities[0]

    @property
    def steps(self) -> Array:
        """Lengths [K] of the steps, in the time of their piece."""
        return self._velocities[1]

    def through(
        self, z: Array, *, backwards: bool = False, slopes: bool = True, enough: float = 1e-13
    ) -> tuple[Array, Array]:
        """(Phi(z) [N,3], its Jacobians [N,3,3]) of z [N,3] in [-1,1]^3; backwards, those of Phi^-1.

        Without `slopes` the Jacobians are [0,3,3]; `enough` is the error of a step's midpoint.
        """
        from cagefield.warps.kernels.lattice_flow import flow_points

        moved, J = np.array(z, dtype=np.float64), np.tile(np.eye(3), (len(z) if slopes else 0, 1, 1))
        flow_points(self.velocities, self.steps, backwards, enough, moved, J)
        return moved, J

    @cached_property
    def _velocities(self) -> tuple[Float32, Array, float]:
        """(velocities, steps, most h |dv/dz|)."""
        parts = [self._slices(piece) for piece in self.pieces]
        steps = [np.full(len(part), 1.0 / len(part)) for part, _ in parts]
        return np.concatenate([part for part, _ in parts]), np.concatenate(steps), max(s for _, s in parts)

    def _slices(self, piece: Piece) -> tuple[Float32, float]:
        """(velocities [K,G,G,G,3] of a piece, most h |dv/dz|), in as many steps as it takes."""

        def slice_at(k: int, steps: int) -> Float32:
            return self._slice(piece, (k + 0.5) / steps)

        def steps_for(bound: float) -> int:
            return int(np.clip(np.ceil(1.05 * bound / STEP_STRAIN), LEAST_STEPS, MOST_STEPS))

        slices, bound = slices_in_steps(slice_at, steps_for, LEAST_STEPS, MOST_STEPS)
        return slices, bound / len(slices)

    def _slice(self, piece: Piece, s: float) -> Float32:
        """The velocity [G,G,G,3] at time s of a piece."""
        from cagefield.warps.kernels.lattice_flow import fill_slice

        places, reach, dz, margin = self._nodes
        frame, samples, blur = sampled(piece, s)
        start, change = piece.padded
        P = np.stack([start + s * change, change])
        n = self.cells + 1
        out = np.empty((n, n, n, 3), dtype=np.float32)
        linear = piece.interpolation == "linear"
        settings = np.array([blur, margin, *falloff_numbers(self.falloff)])
        fill_slice(places, reach, dz, frame, samples, P, linear, settings, out.reshape(-1, 3))
        return out

    @property
    def _nodes(self) -> tuple[Array, Array, Array, float]:
        return _nodes(self.outer, self.cells)


@lru_cache(maxsize=8)
def _nodes(outer: Cage, cells: int) -> tuple[Array, Array, Array, float]:
    """(places [N,3], 1 / d_o [N], -1 on faces, dz/dx [N or 1,3,3], margin) of the nodes of a flow's grid."""
    confines = Extended.from_cage(outer)
    z = 2.0 * bspline_lattice.grid(3 * (cells + 1,)) - 1.0
    places = hexahedron.points(outer.corners, 0.5 * (z + 1.0))
    reach = 1.0 / outer_distance(confines, z)
    reach[np.abs(z).max(axis=1) >= 1.0] = -1.0
    margin = MARGIN * float(np.linalg.norm(confines.frame, axis=0).max()) * 2.0 / cells
    if confines.is_affine:
        return places, reach, confines.inverse[None], margin
    slope = hexahedron.jacobian(outer.corners, 0.5 * (z + 1.0))
    return places, reach, 2.0 * hexahedron.invert(slope), margin


def slices_in_steps(
    slice_at: Callable[[int, int], Float32], steps_for: Callable[[float], int], least: int, most: int
) -> tuple[Float32, float]:
    """(velocities [K,G,G,G,3], bound of |dv/dz|) of a piece, in as many steps as that takes.

    slice_at(k, K): the velocity of step k of K; steps_for(bound): steps for a bound, from `least` to `most`.
    The first, the middle and the last of the least number of steps tell how many it takes; the others are
    made where that suffices.
    """
    steps, slices = least, {k: slice_at(k, least) for k in (0, least // 2, least - 1)}
    bound = max(map(slope_bound, slices.values()))
    while True:
        if bound > steps * ENOUGH_STRAIN and steps < most:
            steps, slices = steps_for(bound), {}
        slices.update({k: slice_at(k, steps) for k in range(steps) if k not in slices})
        bound = max(map(slope_bound, slices.values()))
        if bound <= steps * ENOUGH_STRAIN or steps >= most:
            return np.stack([slices[k] for k in range(steps)]), bound


def falloff_numbers(falloff: Falloff) -> Array:
    """(a, b, width) of a falloff, as kernels take them."""
    a = 1.0 if falloff.profile == "linear" else SLOPE
    return np.array([a, 0.0 if falloff.profile == "linear" else 1.0 - a * 17.0 / 18.0, falloff.width])


def sampled(piece: Piece, s: float) -> tuple[Array, Float32, float]:
    """(frame [11,3], samples [30,M], blur) of a piece at time s, as `kernels.lattice_flow` takes them."""
    c, F, dc, dF = piece.frame(s)
    counts, u = _sample_places(piece.shape)
    y, dy, d, dd = piece.samples(s, u)
    frame = np.concatenate([c[None], dc[None], np.linalg.inv(F), dF, F])
    inverse = hexahedron.invert(dy).reshape(-1, 9)
    rows = [y, u, np.linalg.norm(F @ dy, axis=1), inverse, d, dd.reshape(-1, 9)]
    samples = np.ascontiguousarray(np.concatenate(rows, axis=1).T, dtype=np.float32)
    spacing = np.linalg.norm(dy, axis=1) / counts
    return frame, samples, float((0.5 * spacing.mean()) ** 2)


@lru_cache(maxsize=64)
def _sample_places(shape: tuple[int, int, int]) -> tuple[Array, Array]:
    """(samples along each axis [3], their u [M,3]) of a lattice's shape."""
    counts = sample_counts(shape)
    axes = np.meshgrid(*((np.arange(n) + 0.5) / n for n in counts), indexing="ij")
    return np.array(counts, dtype=np.float64), np.stack([g.ravel() for g in axes], axis=1)


def sample_counts(shape: tuple[int, int, int]) -> tuple[int, int, int]:
    """Samples along each axis, two a cell, `MAX_LATTICE_SAMPLES` in all at most."""
    counts = np.minimum(2 * (np.array(shape) - 1), 10)
    while counts.prod() > MAX_LATTICE_SAMPLES:
        counts[np.argmax(counts)] -= 1
    return int(counts[0]), int(counts[1]), int(counts[2])


def slope_bound(grid: Float32) -> float:
    """A bound of |dv/dz| (Frobenius norm) of the trilinear interpolation of a grid [G,G,G,3] over [-1,1]^3.

    In a cell the derivative along an axis is a mean of the differences on its four edges along that axis.
    Infinite where a velocity is not finite.
    """
    from cagefield.warps.kernels.lattice_flow import largest_slope

    if not np.isfinite(grid).all():
        return float("inf")
    return float(0.5 * (len(grid) - 1) * np.sqrt(largest_slope(grid)))


def outer_distance(confines: Extended, z: Array) -> Array:
    """d_o [N] of `FlowShell` at z [N,3]: 0 on the faces of the outer cage."""
    D = np.maximum(0.5 * confines.heights * (1.0 - z * z), 1e-60)
    return np.asarray((D**-4.0).sum(axis=1) ** -0.25)


def outer_distance_gradient(confines: Extended, z: Array, d_o: Array) -> Array:
    """dd_o/dx [N,3]."""
    D = np.maximum(0.5 * confines.heights * (1.0 - z * z), 1e-60)
    by_z = -((d_o[:, None] / D) ** 5.0) * confines.heights * z
    return np.asarray((by_z[:, None] @ confines.gradient(z))[:, 0])
