"""The map of a mesh cage in an outer cage: the flow that follows its vertices, inside and around it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.typing import Array, Float32
from cagefield.warps.cage_maps import flow_between, inner_map_between
from cagefield.warps.falloff import Falloff
from cagefield.warps.free_form_nodes import flow_arguments
from cagefield.warps.interfaces import InnerMap, NoInnerMap
from cagefield.warps.mesh_flow import (
    MeshFlow,
    MeshPiece,
    cell_diagonal,
    distance_inside,
    pieces_of_mesh,
)

MIN_GAP = 0.02
"""Least gap between the mesh and the outer cage on the way, as a share of the outer cage's half-width."""

MIN_CELLS, MAX_CELLS = 20, 40
"""Cells of the velocity's grid along each axis of the outer cage."""

CELLS_PER_GAP = 2.5
"""Cells, at least, between the mesh and the outer cage."""

CELLS_PER_MESH_GAP = 5.0
"""Cells, at least, between an inner mesh and a mesh as outer cage: one at the outer surface stands still, one
at the inner mesh moves."""

STILL_CELLS = 2.2
"""Least distance of the inner mesh from a mesh as outer cage, in diagonals of a cell."""

_WAY_TIMES: Array = np.linspace(0.0, 1.0, 9)


@dataclass(frozen=True)
class MeshShell:
    """phi and phi' of a mesh cage together; valid in all of V^o, the identity on its faces.

    to_deformed is the flow Phi of a `MeshFlow`, to_canonical its inverse: each step is its own inverse, so
    that they close to rounding. Each step is proven one to one by a bound of its velocity's slope. Vertices
    go where they are moved; the space between follows their harmonic coordinates as a velocity.

    Parameters: the canonical and the deformed inner cage, the outer cage, with parallel faces or a mesh, the
    falloff.
    """

    inner: MeshCage
    deformed: MeshCage
    outer: Cage
    falloff: Falloff

    @cached_property
    def flow(self) -> MeshFlow:
        """The flow, on a grid that the gap between the cages asks for."""
        per_gap = CELLS_PER_MESH_GAP if isinstance(self.outer, MeshCage) else CELLS_PER_GAP
        wanted = 2.0 * per_gap / max(self._gap, 1e-6)
        cells = int(np.clip(np.ceil(wanted), MIN_CELLS, MAX_CELLS))
        return MeshFlow(self.inner.triangles, self._pieces, self.outer, self.falloff, cells)

    @cached_property
    def _pieces(self) -> tuple[MeshPiece, ...]:
        return pieces_of_mesh(self.inner, self.deformed)

    @cached_property
    def _gap(self) -> float:
        """Least 1 - |z| of the vertices on their way, negative outside of the outer cage.

        In a mesh as outer cage, the least distance from it over half the longest edge of its box.
        """
        confines = self._confines
        ways = [self.inner.vertices, *(x for piece in self._pieces for x in piece.at(_WAY_TIMES)[0])]
        if isinstance(self.outer, MeshCage):
            return self._room(self.outer, ways) / float(np.linalg.norm(confines[2], axis=0).max())
        return float(1.0 - max(np.abs((x - confines[0]) @ confines[1].T).max() for x in ways))

    def _room(self, outer: MeshCage, ways: list[Array]) -> float:
        """Least distance of the inner mesh on its way from a mesh as outer cage; 0 where it goes outside.

        Taken at vertices, and at the middles of edges and triangles.
        """
        edges, triangles = self.inner.mesh_edges, self.inner.triangles
        points = [np.concatenate([x, x[edges].mean(axis=1), x[triangles].mean(axis=1)]) for x in ways]
        return float(distance_inside(outer, np.concatenate(points)).min())

    @cached_property
    def _confines(self) -> tuple[Array, Array, Array]:
        """(center [3], dz/dx [3,3], dx/dz [3,3]) of the outer cage."""
        A, b = self.outer.affine
        return np.asarray(b + 0.5 * A.sum(axis=1)), np.asarray(2.0 * np.linalg.inv(A)), 0.5 * A

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """(deformed points [N,3], Jacobians [N,3,3]) of canonical points [N,3] in V^o."""
        return self._flowed(points, backwards=False)

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in V^o."""
        return self._flowed(points, backwards=True)

    def _flowed(self, points: Array, *, backwards: bool) -> tuple[Array, Array]:
        if not self._pieces:
            return points.copy(), np.tile(np.eye(3), (len(points), 1, 1))
        center, inverse, frame = self._confines
        z = ((points - center) @ inverse.T).clip(-1.0, 1.0)
        moved, J = self.flow.through(z, backwards=backwards)
        return points + (moved - z) @ frame.T, frame @ J @ inverse

    def sample(self, resolution: int) -> Float32:
        """Displacements to canonical space [R^3,3], x fastest, of the nodes of a `Lattice`; in float32."""
        from cagefield.warps.kernels.lattice_nodes import flow_nodes_back, mesh_iterations

        if not self._pieces:
            return np.zeros((resolution**3, 3), dtype=np.float32)
        flow = self.flow
        center, inverse, frame = self._confines
        frames = np.concatenate([center[None], inverse, frame])
        iterations = mesh_iterations(flow.strain)
        out = np.empty((resolution**3, 3), dtype=np.float32)
        arguments = flow_arguments(flow.velocities, flow.steps, self.outer, frames, iterations, resolution)
        flow_nodes_back(arguments, resolution, out)
        grid, ends = out.reshape(*3 * (resolution,), 3), [0, -1]
        grid[ends] = grid[:, ends] = grid[:, :, ends] = 0.0  # the outer faces, which the kernel rounds
        return out

    def least_ratio(self) -> float:
        """Least det of d(deformed)/d(canonical) at 4096 points of the outer cage: a sample, not a bound."""
        origin, frame = self.outer.frame
        points = origin + np.random.default_rng(0).random((4096, 3)) @ frame.T
        return float(np.linalg.det(self.to_deformed(points)[1]).min())

    def problem(self) -> str | None:
        """Why there is no such flow, in words that continue "the flow shell ...", or None."""
        if not np.array_equal(self.inner.triangles, self.deformed.triangles):
            return "needs the triangles of the inner cage to stay; move the mesh's vertices only"
        if not self.outer.is_affine:
            return "surrounds a mesh cage in an outer cage with parallel faces only; give it a box"
        if any(np.linalg.det(piece.affine) <= 1e-9 for piece in self._pieces):
            return "finds no way for the mesh, which is flattened or turned inside out as a whole"
        if self._gap < MIN_GAP:
            return (
                f"has no room: the gap between the mesh and the outer cage on its way is {self._gap:.2g} of"
                f" the outer cage's half-width and must be at least {MIN_GAP:g} on every side"
            )
        if isinstance(self.outer, MeshCage):
            half = float(np.linalg.norm(self._confines[2], axis=0).max())
            room, least = self._gap * half, STILL_CELLS * cell_diagonal(self.outer, self.flow.cells)
            if room < least:
                return (
                    f"has no room: the mesh comes to within {room:.2g} of the outer cage on its way, and must"
                    f" stay {least:.2g} from it"
                )
        if self._pieces and not self.flow.is_one_to_one:
            return "is strained too much: the mesh moves too far for its gap to the outer cage"
        return None


@flow_between.register
def _(inner: MeshCage, deformed: MeshCage, outer: Cage, falloff: Falloff) -> MeshShell:
    return MeshShell(inner, deformed, outer, falloff)


@inner_map_between.register
def _(inner: MeshCage, deformed: Cage) -> InnerMap:
    return NoInnerMap()  # the flow holds the map inside, too
