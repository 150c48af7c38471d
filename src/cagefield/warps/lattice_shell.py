"""The map of a lattice cage: its spline inside, a flow around it that meets the spline exactly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cagefield.geometry import bspline_lattice, hexahedron
from cagefield.geometry.cage import Cage, LatticeCage
from cagefield.typing import Array, Float32, Mask
from cagefield.warps.cage_maps import flow_between, inner_map_between
from cagefield.warps.falloff import Falloff
from cagefield.warps.free_form_nodes import flow_arguments, node_places
from cagefield.warps.interfaces import InnerMap, NoInnerMap
from cagefield.warps.lattice_flow import LatticeFlow, outer_distance, outer_distance_gradient
from cagefield.warps.lattice_motion import Piece, pieces_between
from cagefield.warps.newton_inverse import inverted

GRIDS: tuple[int, ...] = (20, 32, 48)
"""Cells of the velocity's grid along each axis of the outer cage, tried one after the other."""

MOST_CORRECTION = 0.9
"""Most slope of rho r: below 1 the correction is one to one."""

LEAST_CORRECTION_DET = 0.05
"""Least det (1 + d(rho r)/dX) beside edges and corners of the canonical cage, where r may be steep."""

EDGE_SAMPLES = 33
"""Samples of each edge of the canonical cage."""

LEAST_GAP = 2e-3
"""The gap between the lattice and the outer cage, as a share of the outer cage's half-width."""

_CHUNK = 65_536


@dataclass(frozen=True)
class LatticeShell:
    """phi and phi' of a lattice in an outer cage; valid in all of V^o, the identity on its faces.

    Inside, phi = L^-1, with L the spline of the deformed control points over that of the canonical ones, an
    even grid. Around it,

        to_deformed(X) = Phi(R(X)),    R(X) = X + rho(X) r(clamp X),    r(s) = Phi^-1(L(s)) - s,

    with clamp X the nearest point (in u) of the canonical cage, rho = g^2 (3 - 2 g), g = d_o / (d_i + d_o), 1
    on the cage and 0 on the outer one, and Phi a flow that follows the lattice on its way (`LatticeFlow`). So
    the map equals L on the lattice's faces whatever Phi is; the better Phi follows, the less is left to r.

    One to one: L and its way by Bernstein coefficients, Phi step by step by a bound of its slope, R where the
    slope of rho r is below 1, or beside edges and corners, at which r may be steep, where its determinant is
    positive; both are sampled (`Surroundings.slope`, `Surroundings.least_edge_det`), not proven.

    Parameters: the canonical and the deformed inner cage, the outer cage, the falloff.
    """

    inner: LatticeCage
    deformed: LatticeCage
    outer: Cage
    falloff: Falloff

    @cached_property
    def pieces(self) -> tuple[Piece, ...] | None:
        """The way of the lattice, see `pieces_between`."""
        return pieces_between(self.inner, self.deformed)

    @cached_property
    def around(self) -> Surroundings:
        """The flow and its correction, on the coarsest grid that suffices, else on the finest."""
        assert self.pieces is not None
        for cells in GRIDS:
            flow = LatticeFlow(self.pieces, self.outer, self.falloff, cells)
            around = Surroundings(self.inner, self.deformed, flow)
            if flow.is_one_to_one and around.is_one_to_one:
                break
        return around

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """(deformed points [N,3], Jacobians [N,3,3]) of canonical points [N,3] in V^o."""
        around = self.around
        u = around.material(points)
        inside = hexahedron.all_three((u >= 0.0) & (u <= 1.0))
        moved, J = np.empty_like(points), np.empty((len(points), 3, 3))
        moved[inside], J[inside] = around.lattice(u[inside])
        rest = points[~inside]
        if len(rest):
            change, slope = around.correction(rest)
            moved[~inside], onward = around.flowed(rest + change, backwards=False)
            J[~inside] = onward @ (np.eye(3) + slope)
        return moved, J

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in V^o."""
        around = self.around
        A, b = self.inner.affine
        q, back = around.flowed(points, backwards=True)
        u, inside = around.inverted(points, q)
        moved, J = np.empty_like(points), np.empty((len(points), 3, 3))
        moved[inside] = b + u[inside] @ A.T
        J[inside] = hexahedron.invert(around.lattice(u[inside])[1])
        outside = np.flatnonzero(~inside)
        if len(outside):
            X = around.uncorrected(q[outside])
            moved[outside] = X
            J[outside] = hexahedron.invert(np.eye(3) + around.correction(X)[1]) @ back[outside]
        return moved, J

    def sample(self, resolution: int) -> Float32:
        """Displacements to canonical space [R^3,3], x fastest, of the nodes of a `Lattice`."""
        if not self.outer.is_affine:
            return self._sampled_exactly(resolution)
        from cagefield.warps.kernels.lattice_nodes import ITERATIONS, lattice_nodes_back

        around, flow = self.around, self.around.flow
        A, b = self.inner.affine
        confines = flow.confines
        outer = np.concatenate([confines.center[None], confines.inverse, confines.frame])
        material = np.concatenate([(confines.center - b)[None], confines.frame.T]) @ np.linalg.inv(A).T
        table = np.zeros((*around.face_table.shape[:-1], 4), dtype=np.float32)
        table[..., :3] = around.face_table @ confines.inverse.T
        out = np.empty((resolution**3, 3), dtype=np.float32)
        lattice_nodes_back(
            flow_arguments(flow.velocities, flow.steps, self.outer, outer, ITERATIONS, resolution),
            (*self._lattice(), node_places(self.outer, resolution), np.concatenate([b[None], A])),
            (
                material.astype(np.float32),
                confines.heights.astype(np.float32),
                table.reshape(-1),
                table.shape[1] - 1,
            ),
            1.5 * around.largest + 1e-9,
            resolution,
            out,
        )
        return out

    def _lattice(self) -> tuple[Array, Float32, Array, bool]:
        """(padded deformed control points, these less a center in flat rows of four, the center, linear)."""
        padded = self.around.padded
        center = self.deformed.control_points.mean(axis=0)
        rows = np.zeros((*padded.shape[:-1], 4), dtype=np.float32)
        rows[..., :3] = padded - center
        return padded, rows.reshape(-1), center, self.deformed.interpolation == "linear"

    def _sampled_exactly(self, resolution: int) -> Float32:
        origin, frame = self.outer.frame
        nodes = origin + bspline_lattice.grid(3 * (resolution,)) @ frame.T
        out = np.zeros((len(nodes), 3), dtype=np.float32)
        rows = np.flatnonzero(self.outer.contains(nodes))
        for first in range(0, len(rows), _CHUNK):
            part = rows[first : first + _CHUNK]
            out[part] = self.to_canonical(nodes[part])[0] - nodes[part]
        return out

    def least_ratio(self) -> float:
        """Least det of d(deformed)/d(canonical) at 4096 points of the outer cage: a sample, not a bound."""
        origin, frame = self.outer.frame
        points = origin + np.random.default_rng(0).random((4096, 3)) @ frame.T
        points = points[self.outer.contains(points)]
        return float(np.linalg.det(self.to_deformed(points)[1]).min())

    def problem(self) -> str | None:
        """Why the map is not one to one, in words that continue "the flow shell ...", or None."""
        if not self.inner.is_affine:
            return (
                "cannot surround the lattice: before any operation its control points must lie evenly in a"
                " box (or a parallelepiped); move them by operations instead"
            )
        for lattice, when in ((self.inner, " before any operation"), (self.deformed, "")):
            u, found = hexahedron.inverse(self.outer.corners, lattice.control_points)
            gap = float(np.where(found, 1.0 - np.abs(2.0 * u - 1.0).max(axis=1), -1.0).min())
            if gap < LEAST_GAP:
                return (
                    f"has no room{when}: the gap between the lattice and the outer cage is {gap:.2g} of the"
                    f" outer cage's half-width and must be at least {LEAST_GAP:g} on every side"
                )
        if self.deformed.has_shape_of(self.inner):
            return None
        if self.pieces is None:
            return "finds no way for the lattice that is proven not to fold"
        if not self.around.flow.is_one_to_one:
            return "is strained too much: the lattice moves too far for its gap to the outer cage"
        if not self.around.is_one_to_one:
            return "cannot follow the lattice closely enough: it is bent too much for the room around it"
        return None


@dataclass(frozen=True)
class Surroundings:
    """Phi and R of a `LatticeShell`, and what its lattice is on both sides."""

    inner: LatticeCage
    deformed: LatticeCage
    flow: LatticeFlow

    def material(self, points: Array) -> Array:
        """u [N,3] of canonical points [N,3], in the inner cage's affine coordinates."""
        A, b = self.inner.affine
        return np.asarray((points - b) @ np.linalg.inv(A).T)

    @cached_property
    def padded(self) -> Array:
        """Padded control points of the deformed lattice, as kernels take them."""
        return bspline_lattice.padded(self.deformed.control_points, self.deformed.shape)

    def lattice(self, u: Array) -> tuple[Array, Array]:
        """(L [N,3], its Jacobians by canonical points [N,3,3]) at u [N,3]."""
        from cagefield.warps.kernels.lattice_flow import lattice_points

        x, J = np.empty_like(u), np.empty((len(u), 3, 3))
        lattice_points(self.padded, self.deformed.interpolation == "linear", np.ascontiguousarray(u), x, J)
        return x, J @ np.linalg.inv(self.inner.affine[0])

    def flowed(self, points: Array, *, backwards: bool) -> tuple[Array, Array]:
        """(Phi or Phi^-1 of points [N,3] in V^o, Jacobians [N,3,3])."""
        z = self._in_outer(points)
        moved, J = self.flow.through(z, backwards=backwards)
        corners = self.flow.outer.corners
        ends = (
            hexahedron.jacobian(corners, 0.5 * (moved + 1.0)),
            hexahedron.jacobian(corners, 0.5 * (z + 1.0)),
        )
        J = ends[0] @ J @ hexahedron.invert(ends[1])
        return hexahedron.points(corners, 0.5 * (moved + 1.0)), J

    def _in_outer(self, points: Array) -> Array:
        """z [N,3] of points [N,3] in V^o, cut to it."""
        confines = self.flow.confines
        if confines.is_affine:
            return np.asarray(((points - confines.center) @ confines.inverse.T).clip(-1.0, 1.0))
        u, _ = hexahedron.inverse(self.flow.outer.corners, points)
        return np.asarray((2.0 * u - 1.0).clip(-1.0, 1.0))

    def residual(self, u: Array) -> tuple[Array, Array]:
        """(r [N,3], dr/dX [N,3,3]) at points of the canonical cage's faces, u [N,3]."""
        A, b = self.inner.affine
        x, D = self.lattice(u)
        back, J = self.flowed(x, backwards=True)
        return back - (b + u @ A.T), J @ D - np.eye(3)

    def correction(self, X: Array) -> tuple[Array, Array]:
        """(rho(X) r(clamp X) [N,3], its Jacobian [N,3,3]) at canonical points X [N,3] around the cage."""
        r, dr = self.residual(self.material(X).clip(0.0, 1.0))
        return self._faded(X, r, dr)

    def _faded(self, X: Array, r: Array, dr: Array) -> tuple[Array, Array]:
        u = self.material(X)
        rho, drho = self._rho(X, u)
        slope = r[:, :, None] * drho[:, None] + rho[:, None, None] * self._along_faces(u, dr)
        return rho[:, None] * r, slope

    def _along_faces(self, u: Array, dr: Array) -> Array:
        """d r(clamp X)/dX [N,3,3] at u [N,3] of X, from dr/dX [N,3,3] at clamp X."""
        A, _ = self.inner.affine
        within = ((u >= 0.0) & (u <= 1.0)).astype(np.float64)
        return np.asarray(dr @ ((A * within[:, None]) @ np.linalg.inv(A)))

    def _rho(self, X: Array, u: Array) -> tuple[Array, Array]:
        """(rho [N], its gradient [N,3])."""
        A, _ = self.inner.affine
        offset = (u - u.clip(0.0, 1.0)) @ A.T
        d_i = np.linalg.norm(offset, axis=1)
        beyond = ((u < 0.0) | (u > 1.0)).astype(np.float64)
        towards = offset / np.maximum(d_i, 1e-300)[:, None]
        grad_i = (towards[:, None] @ ((A * beyond[:, None]) @ np.linalg.inv(A)))[:, 0]
        z = self._in_outer(X)
        d_o = outer_distance(self.flow.confines, z)
        grad_o = outer_distance_gradient(self.flow.confines, z, d_o)
        total = np.maximum(d_i + d_o, 1e-300)
        g = d_o / total
        grad_g = (d_i[:, None] * grad_o - d_o[:, None] * grad_i) / (total * total)[:, None]
        return g * g * (3.0 - 2.0 * g), 6.0 * (g * (1.0 - g))[:, None] * grad_g

    def inverted(self, points: Array, q: Array) -> tuple[Array, Mask]:
        """(u [N,3], inside [N]) of deformed points [N,3], with q = Phi^-1 of them: inside are those of V."""
        from cagefield.warps.kernels.lattice_flow import invert_lattice

        A, _ = self.inner.affine
        u = self.material(q)
        clamped = u.clip(0.0, 1.0)
        away = np.linalg.norm((u - clamped) @ A.T, axis=1)
        inside = np.zeros(len(points), dtype=bool)
        near = np.flatnonzero(away <= 1.5 * self.largest + 1e-9)
        start, found = np.ascontiguousarray(clamped[near]), np.zeros(len(near), dtype=bool)
        linear, enough = self.deformed.interpolation == "linear", 1e-13 * np.abs(points).max(initial=1e-300)
        invert_lattice(self.padded, linear, np.ascontiguousarray(points[near]), start, enough, found)
        u[near] = start
        inside[near] = found & hexahedron.all_three((start >= -1e-12) & (start <= 1.0 + 1e-12))
        return u.clip(0.0, 1.0), inside

    def uncorrected(self, q: Array) -> Array:
        """X [N,3] with R(X) = q [N,3], by Newton's method."""

        def corrected(X: Array) -> tuple[Array, Array]:
            change, slope = self.correction(X)
            return X + change, np.eye(3) + slope

        return inverted(corrected, q, q, float(np.abs(self.flow.outer.corners).max()))[0]

    # ---- samples of the faces ----

    @cached_property
    def face_table(self) -> Array:
        """r [6,T,T,3] at even nodes of the canonical cage's faces -x, +x, -y, +y, -z, +z."""
        n = int(np.clip(8 * (max(self.deformed.shape) - 1), 24, 48)) + 1
        b, c = (g.ravel() for g in np.meshgrid(*2 * (np.linspace(0.0, 1.0, n),), indexing="ij"))
        u = np.empty((6, n * n, 3))
        for axis in range(3):
            for side in range(2):
                face = u[2 * axis + side]
                face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = side, b, c
        A, b = self.inner.affine
        on_faces = u.reshape(-1, 3)
        z, _ = self.flow.through(
            self._in_outer(self.lattice(on_faces)[0]), backwards=True, slopes=False, enough=1e-6
        )
        back = hexahedron.points(self.flow.outer.corners, 0.5 * (z + 1.0))
        return np.asarray((back - (b + on_faces @ A.T)).reshape(6, n, n, 3))

    @cached_property
    def _samples(self) -> tuple[Array, Array, Array]:
        """(u [S,3] of an even grid on the canonical cage's faces, r [S,3], dr/dX [S,3,3] there)."""
        u = bspline_lattice.grid((15, 15, 15))
        u = u[(np.abs(u - 0.5) == 0.5).any(axis=1)]
        return u, *self.residual(u)

    @cached_property
    def largest(self) -> float:
        """Largest |r| at samples of the canonical cage's faces."""
        return float(np.linalg.norm(self._samples[1], axis=1).max())

    @property
    def is_one_to_one(self) -> bool:
        """Whether R is one to one, as far as samples say."""
        return self.slope <= MOST_CORRECTION and self.least_edge_det >= LEAST_CORRECTION_DET

    def _outwards(self, u: Array, ways: Array) -> Iterator[tuple[Array, Array]]:
        """(rho [S], its gradient [S,3]) at 4 distances along ways [S,3] from u [S,3] on the cage's faces."""
        A, b = self.inner.affine
        lengths = np.linalg.norm(ways @ A.T, axis=1)
        z, dz = self._in_outer(b + u @ A.T), ways @ A.T @ self.flow.confines.inverse.T
        room = ((1.0 - z * np.sign(dz)) / np.maximum(np.abs(dz), 1e-9)).min(axis=1) * lengths
        for share in (1e-3, 0.15, 0.35, 0.6):
            v = u + ways * (share * room / lengths)[:, None]
            yield self._rho(b + v @ A.T, v)

    @cached_property
    def least_edge_det(self) -> float:
        """Least det (1 + d(rho r)/dX) at 4 distances beyond each face from samples of its edges and corners.

        Beyond a face the clamp's slope is that of the face; `slope` looks beyond edges and corners alone,
        where it is that of the edge, or 0. Samples are dense beside corners, where r is steepest.
        """
        u = edge_points(EDGE_SAMPLES)
        r, dr = self.residual(u)
        on_face = np.where(np.abs(u - 0.5) == 0.5, 2.0 * (u - 0.5), 0.0)
        least = 1.0
        for axis in range(3):
            rows = on_face[:, axis] != 0.0
            ways = on_face[rows] * np.eye(3)[axis]
            S = self._along_faces(u[rows] + ways, dr[rows])
            for rho, drho in self._outwards(u[rows], ways):
                slope = r[rows][:, :, None] * drho[:, None] + rho[:, None, None] * S
                least = min(least, float(np.linalg.det(np.eye(3) + slope).min()))
        return least

    @cached_property
    def slope(self) -> float:
        """Largest |d(rho r)/dX| (Frobenius norm) at 4 distances from each face sample."""
        u, r, dr = self._samples
        outwards = np.where(np.abs(u - 0.5) == 0.5, u - 0.5, 0.0)
        outwards /= np.abs(outwards).max(axis=1, keepdims=True)
        # d(rho r)/dX = r drho^T + rho S, with S = dr clamp'; the clamp's slope is that of the face all along.
        S = self._along_faces(u + outwards, dr)
        rS, SS, rr = (r[:, None] @ S)[:, 0], (S * S).sum(axis=(1, 2)), (r * r).sum(axis=1)
        most = 0.0
        for rho, drho in self._outwards(u, outwards):
            square = rr * (drho * drho).sum(axis=1) + rho * (2.0 * (rS * drho).sum(axis=1) + rho * SS)
            most = max(most, float(square.max()))
        return float(np.sqrt(most))


def edge_points(count: int) -> Array:
    """Points u [12 count,3] of a unit cube's edges, `count` on each, at extrema of a Chebyshev polynomial."""
    along = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1))
    ends = bspline_lattice.grid((2, 2, 1))[:, :2]
    edges = [
        np.insert(np.repeat(ends, count, axis=0), axis, np.tile(along, len(ends)), axis=1)
        for axis in range(3)
    ]
    return np.concatenate(edges)


@flow_between.register
def _(inner: LatticeCage, deformed: LatticeCage, outer: Cage, falloff: Falloff) -> LatticeShell:
    return LatticeShell(inner, deformed, outer, falloff)


@inner_map_between.register
def _(inner: LatticeCage, deformed: Cage) -> InnerMap:
    return NoInnerMap()  # the shell holds the map inside, too
