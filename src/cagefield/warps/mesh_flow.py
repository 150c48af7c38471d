"""The flow of a mesh cage: its vertices' motion blended by harmonic coordinates; see `mesh_shell`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cagefield.geometry import bspline_lattice
from cagefield.geometry.cage import MAX_WAY_STATES, Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.triangle_mesh import Triangles
from cagefield.typing import Array, Float32
from cagefield.warps.extended_coordinates import Extended
from cagefield.warps.falloff import Falloff
from cagefield.warps.lattice_flow import STEP_STRAIN, falloff_numbers, outer_distance, slices_in_steps
from cagefield.warps.linear_motion import LinearMotion

MIN_MESH_STEPS, MAX_MESH_STEPS = 4, 64

HARMONIC_SWEEPS, OVER_RELAXATION = 30, 1.7
"""Sweeps over the nodes inside of a mesh from its mean value to its harmonic blend; `harmonic_inside`."""

SWEEPS = 16
"""Sweeps over the vertices that make the grid's velocity theirs, see `meet_points`."""


SHIFT: Array = np.array([0.61, 0.83, 0.47])
"""Direction in which the nodes are shifted against the cage, see `_nodes`."""


def blend(
    places: Array, vertices: Array, triangles: Triangles, motion: Array, far: float | None = None
) -> Array:
    """[N,4]: the motion [V,3] of vertices [V,3] blended at places [N,3], their distance from the mesh.

    `far`: distance, in radii of a triangle, from which one value stands for it, see `kernels.mean_value`.
    """
    from cagefield.warps.kernels.mean_value import FAR, blend_motion

    corners, moved, center = vertices[triangles], motion[triangles], vertices.mean(axis=0)
    middle = corners.mean(axis=1)
    normal = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1, keepdims=True)
    near = (radius * (FAR if far is None else far)) ** 2
    columns = (middle - center, normal, moved.mean(axis=1), near, radius)
    table = np.concatenate(columns, axis=1).astype(np.float32)
    out = np.empty((len(places), 4))
    blend_motion(np.ascontiguousarray(places), center, corners, moved, table, out)
    return out


def harmonic_inside(
    blended: Array, z: Array, triangles: Triangles, motion: Array, spacing: Array, inside: NDArray[np.intp]
) -> None:
    """Makes a blend [G^3,3] at nodes of a grid over [-1,1]^3 harmonic at those inside of a mesh, in place.

    z [V,3]: the mesh's vertices, shifted as the nodes are (`_nodes`); motion [V,3]; spacing [3] of the nodes,
    world units; inside [M]: numbers of nodes, none on the grid's faces. Before, the blend is a start inside
    and the value of nodes that are not.
    """
    from cagefield.warps.kernels.harmonic import NO_CROSSING, cross_lines, relax

    n = round(len(blended) ** (1.0 / 3.0))
    ends = np.empty((2, 3, n**3))
    ends[0], ends[1] = NO_CROSSING, -NO_CROSSING
    values = np.empty((2, 3, n**3, 3))
    cross_lines(n, 0.5 * (n - 1) * (z + 1.0), triangles, motion, ends, values)
    relax(n, inside, spacing**-2.0, ends, values, blended, HARMONIC_SWEEPS, OVER_RELAXATION)


@dataclass(frozen=True)
class MeshPiece:
    """A piece of the way of a mesh, s from 0 to 1: vertices [V,3] at its start A and its end B.

    x_j(s) = c(s) + F(s) y_j(s), with M the affine map that fits B over A best, F(s) from the identity to M
    (`LinearMotion`), c(s) the straight way of the vertices' mean, y_j(s) straight.
    """

    start: Array
    end: Array

    @cached_property
    def affine(self) -> Array:
        """M [3,3]."""
        a, b = self.start - self.start.mean(axis=0), self.end - self.end.mean(axis=0)
        return np.linalg.lstsq(a, b, rcond=None)[0].T

    @cached_property
    def _linear(self) -> LinearMotion:
        return LinearMotion(np.eye(3), self.affine)

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """(vertices [T,V,3], c [T,3], F [T,3,3]) at times s [T]."""
        a, b = self.start.mean(axis=0), self.end.mean(axis=0)
        y_a, y_b = self.start - a, (self.end - b) @ np.linalg.inv(self.affine).T
        F, _ = self._linear.at(s)
        c = a + s[:, None] * (b - a)
        y = y_a + s[:, None, None] * (y_b - y_a)
        return c[:, None] + y @ np.transpose(F, (0, 2, 1)), c, F

    def chord(self, s: float, h: float) -> tuple[Array, Array, Array, Array]:
        """(B [3,3], b [3], vertices [V,3], residual [V,3]) of the step from s to s + h.

        The implicit midpoint rule x' - x = h v((x + x') / 2) takes, with v = B x + b, the affine part of the
        motion from s to s + h exactly: B is its Cayley transform. With the residual at the vertices, midway,
        it takes each of them where it goes.
        """
        (P0, P1), (c0, c1), (F0, F1) = self.at(np.array([s, s + h]))
        A, one = F1 @ np.linalg.inv(F0), np.eye(3)
        B = (2.0 / h) * (A - one) @ np.linalg.inv(A + one)
        b = (c1 - c0) / h - B @ (0.5 * (c0 + c1))
        middle, rate = 0.5 * (P0 + P1), (P1 - P0) / h
        residual = rate - (middle @ B.T + b)
        residual[np.abs(residual) < 1e-12 * max(np.abs(rate).max(), 1e-300)] = 0.0
        return B, b, middle, residual


def pieces_of_mesh(inner: MeshCage, deformed: MeshCage) -> tuple[MeshPiece, ...]:
    """Pieces of the way of a mesh: straight, or through the states that bends and twists have left."""
    known = len(inner.way)
    states = list(deformed.way[known:]) if len(deformed.way) < MAX_WAY_STATES else list(deformed.way)
    if states and np.array_equal(states[0], inner.vertices):
        states = states[1:]
    way = [inner.vertices, *states, deformed.vertices]
    return tuple(MeshPiece(a, b) for a, b in pairwise(way) if not np.array_equal(a, b))


@dataclass(frozen=True)
class MeshFlow:
    """Flow of V^o onto itself, z -> Phi(z) in the coordinates z in [-1,1]^3 of a parallel-sided outer cage.

    The velocity at x, in a step of `MeshPiece.chord`: w (B x + b + e(x)), with e the residuals of the
    vertices blended by harmonic coordinates inside of the mesh (`kernels.harmonic`), outside by mean value
    coordinates (`kernels.mean_value`), and w the weight of `Falloff` at the distances d_i from the mesh, less
    one cell of the grid, and d_o from the outer cage. It is interpolated from a grid of nodes, one slice
    for each step, trilinear in z: so its slope has a bound, and a step of the implicit midpoint rule, which
    is its own inverse, is one to one where h |dv/dz| < 2 (see `LatticeFlow`).

    A mesh as outer cage has the coordinates of its box. d_o is then the distance from its surface, less one
    cell, and the velocity is 0 at nodes nearer than that: so it is in every cell that reaches outside, and
    the flow is the identity there to the bit.

    Where the motion is affine it is so inside, to rounding: the grid holds an affine velocity exactly. Else
    the nodes next to a vertex are changed until its own velocity is interpolated there.
    """

    triangles: Triangles
    pieces: tuple[MeshPiece, ...]
    outer: Cage
    falloff: Falloff
    cells: int

    @cached_property
    def confines(self) -> Extended:
        """The outer cage's coordinates z."""
        return Extended.from_cage(self.outer)

    @property
    def velocities(self) -> Float32:
        """dz/ds [K,G,G,G,3] at the nodes of the grid, z slowest, one slice for each step."""
        return self._velocities[0]

    @property
    def steps(self) -> Array:
        """Lengths [K] of the steps, in the time of their piece."""
        return self._velocities[1]

    @property
    def strain(self) -> float:
        """Most h |dv/dz| of a step."""
        return self._velocities[2]

    @property
    def is_one_to_one(self) -> bool:
        """True where each step is proven one to one."""
        return self.strain < 2.0

    def through(self, z: Array, *, backwards: bool = False) -> tuple[Array, Array]:
        """(Phi(z) [N,3], its Jacobians [N,3,3]) of z [N,3] in [-1,1]^3; backwards, those of Phi^-1."""
        from cagefield.warps.kernels.lattice_flow import flow_points

        moved, J = np.array(z, dtype=np.float64, order="C"), np.tile(np.eye(3), (len(z), 1, 1))
        flow_points(self.velocities, self.steps, backwards, 1e-13, moved, J)
        return moved, J

    @cached_property
    def _velocities(self) -> tuple[Float32, Array, float]:
        """(velocities, steps, most h |dv/dz|)."""
        parts = [self._slices(piece) for piece in self.pieces]
        steps = [np.full(len(part), 1.0 / len(part)) for part, _ in parts]
        return np.concatenate([part for part, _ in parts]), np.concatenate(steps), max(s for _, s in parts)

    def _slices(self, piece: MeshPiece) -> tuple[Float32, float]:
        """(velocities [K,G,G,G,3] of a piece, most h |dv/dz|), in as many steps as it takes."""

        def slice_at(k: int, steps: int) -> Float32:
            return self._slice(piece, k / steps, 1.0 / steps)

        def steps_for(bound: float) -> int:
            return int(np.clip(np.ceil(1.05 * bound / STEP_STRAIN), MIN_MESH_STEPS, MAX_MESH_STEPS))

        slices, bound = slices_in_steps(slice_at, steps_for, MIN_MESH_STEPS, MAX_MESH_STEPS)
        return slices, bound / len(slices)

    def _slice(self, piece: MeshPiece, s: float, h: float) -> Float32:
        """The velocity [G,G,G,3] of the step from s to s + h."""
        from cagefield.warps.kernels.mean_value import meet_points

        places, rows, d_o = _nodes(self.outer, self.cells)
        B, b, vertices, residual = piece.chord(s, h)
        found = blend(places, vertices, self.triangles, residual)
        d_i = (found[:, 3] - np.minimum(cell_diagonal(self.outer, self.cells), 0.5 * d_o)).clip(0.0)
        a, linear, _ = falloff_numbers(self.falloff)
        w, _ = self.falloff.weight(d_i / d_o, (a, linear))
        if residual.any():
            found[:, :3] = self._harmonic(found, rows, vertices, residual)
        v = w[:, None] * (places @ B.T + b + found[:, :3])
        flat = np.zeros(((self.cells + 1) ** 3, 3), dtype=np.float32)
        flat[rows] = v @ self.confines.inverse.T
        grid = flat.reshape(*3 * (self.cells + 1,), 3)
        if residual.any():
            z = (vertices - self.confines.center) @ self.confines.inverse.T
            wanted = (vertices @ B.T + b + residual) @ self.confines.inverse.T
            meet_points(grid, z, wanted, SWEEPS)
        return grid

    def _harmonic(self, found: Array, rows: NDArray[np.intp], vertices: Array, residual: Array) -> Array:
        """The blend [N,3] at the nodes `rows` [N], harmonic inside, from `blend` [N,4] of residuals [V,3]."""
        blended = np.zeros(((self.cells + 1) ** 3, 3))
        blended[rows] = found[:, :3]
        z = (vertices - self.confines.center) @ self.confines.inverse.T - 1e-7 * SHIFT
        spacing = np.linalg.norm(self.confines.frame, axis=0) * (2.0 / self.cells)
        harmonic_inside(blended, z, self.triangles, residual, spacing, rows[found[:, 3] <= 0.0])
        return blended[rows]


def cell_diagonal(outer: Cage, cells: int) -> float:
    """Longest diagonal of a cell of the grid, world units."""
    edges = Extended.from_cage(outer).frame * (2.0 / cells)
    signs = ((1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1))
    return float(max(np.linalg.norm(edges @ np.array(each)) for each in signs))


def distance_inside(mesh: MeshCage, places: Array) -> Array:
    """Distances [N] of places [N,3] inside of a mesh from its surface; 0 outside."""
    # With its triangles turned over, the inside is what lies outside.
    turned = np.ascontiguousarray(mesh.triangles[:, ::-1])
    return blend(places, mesh.vertices, turned, np.zeros_like(mesh.vertices))[:, 3]


@lru_cache(maxsize=8)
def _nodes(outer: Cage, cells: int) -> tuple[Array, NDArray[np.intp], Array]:
    """(places [N,3], numbers [N], d_o [N]) of the grid's nodes inside of an outer cage; see `MeshFlow`.

    Places are shifted by 1e-7 of the cage, so that none is on a face or an edge of a mesh of round numbers.
    """
    confines = Extended.from_cage(outer)
    z = 2.0 * bspline_lattice.grid(3 * (cells + 1,)) - 1.0
    rows = np.flatnonzero(np.abs(z).max(axis=1) < 1.0 - 1e-9)
    d_o = outer_distance(confines, z[rows])
    places = confines.center + (z[rows] + 1e-7 * SHIFT) @ confines.frame.T
    if isinstance(outer, MeshCage):
        d_o = distance_inside(outer, places) - cell_diagonal(outer, cells)
        inside = np.flatnonzero(d_o > 0.0)
        return places[inside], rows[inside], d_o[inside]
    return places, rows, d_o
