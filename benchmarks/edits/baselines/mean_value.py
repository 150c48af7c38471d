"""Mean value coordinates of closed triangle meshes, and the map between two cages that they give.

Notation: mesh vertices v_i, a_i = v_i - p for a point p, theta_jk the angle between a_j and a_k. For a
triangle (0, 1, 2), m = 1/2 (theta_01 n_01 + theta_12 n_12 + theta_20 n_20) with n_jk the unit vector along
a_j x a_k, and its weights w solve w_0 a_0 + w_1 a_1 + w_2 a_2 = m. The interpolant of values f_i is
sum w_i f_i / sum w_i over all triangles.

Source: Ju, Schaefer, Warren, "Mean Value Coordinates for Closed Triangular Meshes" (2005), section 3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cagefield.geometry import hexahedron
from cagefield.geometry.cage import FACES, Cage
from cagefield.typing import Array, Int
from cagefield.warps.hexahedron_map import HexahedronMap

_NEAR = 1e-7
"""Points nearer to a triangle's plane than this share of the mesh are taken three times as far beside it."""

_BESIDE: Array = np.array([0.5571, 0.6393, 0.5301])
_PLANAR = 1e-9
_CHUNK = 1 << 14  # edges times points held at a time


@dataclass(frozen=True)
class ClosedMesh:
    """A closed, oriented triangle mesh; several components are allowed (a shell has two).

    Parameters: vertices [V,3]; triangles [T,3], counter-clockwise seen from outside the volume they bound:
    the mesh of a hole is listed the other way round.
    """

    vertices: Array
    triangles: Int

    @cached_property
    def size(self) -> float:
        """Length of the diagonal of the mesh's box."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    @cached_property
    def edges(self) -> tuple[Int, Int, Array]:
        """(edges [E,2], edge of each triangle's side [T,3], sign [T,3]); side i lies opposite corner i."""
        sides = self.triangles[:, [[1, 2], [2, 0], [0, 1]]]
        unique, of_side = np.unique(np.sort(sides, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
        return unique, of_side.reshape(-1, 3), np.where(sides[..., 0] < sides[..., 1], 1.0, -1.0)

    def interpolate(self, values: Array, points: Array) -> tuple[Array, Array]:
        """(value [N,C], gradient [N,C,3]) at points [N,3] of values [V,C] given at the vertices.

        Linear functions are reproduced, and values on the mesh met linearly on each triangle. At a point of
        the mesh the value is that of a point 1e-7 of the mesh beside it, and the gradient one of the two.
        """
        value = np.empty((len(points), values.shape[1]))
        gradient = np.empty((len(points), values.shape[1], 3))
        size = max(1, _CHUNK // len(self.edges[0]))
        for start in range(0, len(points), size):
            part = slice(start, start + size)
            value[part], gradient[part] = self._interpolate(values, self._off_planes(points[part]))
        return value, gradient

    def _off_planes(self, points: Array) -> Array:
        corners = self.vertices[self.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        away = np.abs(points @ normals.T - (corners[:, 0] * normals).sum(axis=1)).min(axis=1)
        return np.where(
            (away < _NEAR * self.size)[:, None], points + 3.0 * _NEAR * self.size * _BESIDE, points
        )

    @cached_property
    def _at_edge(self) -> tuple[Int, Array]:
        """(triangles [E,2] at each edge, signs [E,2] of the edge in them)."""
        _, of_side, sign = self.edges
        order = np.argsort(of_side.ravel(), kind="stable")
        return (order // 3).reshape(-1, 2), sign.ravel()[order].reshape(-1, 2)

    def _interpolate(self, values: Array, points: Array) -> tuple[Array, Array]:
        edges, of_side, sign = self.edges
        a = self.vertices - points[:, None]
        c, g, dg = _edges(a[:, edges[:, 0]], a[:, edges[:, 1]])
        normals = sign[..., None] * c[:, of_side]  # [N,T,3,3], of the planes through p and each side
        m = 0.5 * (sign[..., None] * g[:, of_side]).sum(axis=2)
        det = (a[:, self.triangles[:, 0]] * normals[:, :, 0]).sum(axis=2)
        inverse = normals / det[..., None, None]  # rows of (a_0, a_1, a_2)^-1
        w = (inverse @ m[..., None])[..., 0]
        total = w.sum(axis=(1, 2))
        at = values[self.triangles].reshape(-1, values.shape[1])
        value = w.reshape(len(points), -1) @ at / total[:, None]
        # d(sum w f) = sum over triangles of f^T A^-1 (dm + (sum w) I), for f minus the value, so that what
        # the total changes by drops out; dm is gathered from the edges.
        f = values[self.triangles] - value[:, None, None]  # [N,T,3,C]
        along = f.swapaxes(2, 3) @ inverse  # [N,T,C,3]
        slope = np.einsum("ntck,nt->nck", along, w.sum(axis=2))
        triangles, signs = self._at_edge
        by_edge = 0.5 * (
            signs[:, 0, None, None] * along[:, triangles[:, 0]]
            + signs[:, 1, None, None] * along[:, triangles[:, 1]]
        )
        count = by_edge.shape[2]
        slope += by_edge.swapaxes(1, 2).reshape(len(points), count, -1) @ dg.reshape(len(points), -1, 3)
        return value, slope / total[:, None, None]


def _edges(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """(c, g, dg/dp) [N,E,...] with c = a x b, g = theta c / |c|, a = v_j - p and b = v_k - p [N,E,3]."""
    c = _cross(a, b)
    d = (a * b).sum(axis=2)
    squared = (c * c).sum(axis=2)
    s = np.sqrt(squared)
    product = d * d + squared  # |a|^2 |b|^2
    flat = (s < 1e-4 * np.abs(d)) & (d > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.where(flat, s / d, 0.0) ** 2
        # theta / s, and the derivative of that by s divided by s; series where the angle is small
        h = np.where(flat, (1.0 - x / 3.0) / d, np.arctan2(s, d) / s)
        q = np.where(flat, (-2.0 / 3.0 + 0.8 * x) / d**3, (d / product - h) / squared)
    along = b - a
    slope = q[..., None] * _cross(c, along) + (a + b) / product[..., None]
    dg = c[..., :, None] * slope[..., None, :]
    turned = h[..., None] * along  # dc = along x dp
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        dg[..., i, j] -= turned[..., k]
        dg[..., i, k] += turned[..., j]
    return c, h[..., None] * c, dg


def _cross(a: Array, b: Array) -> Array:
    c = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        c[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return c


@dataclass(frozen=True)
class MeanValueShell:
    """phi' by mean value coordinates of the surface of the shell, which is that of both cages.

    The outer cage's control points stay, the inner cage's, a hole in the shell, are moved by the user, as a
    cage's vertices are in NeRFshop and CageNeRF. A single cage around the object, as there, has no second
    surface at which the map could become the identity; the inner region moves by phi, as with every other
    method here. The map is evaluated backwards, as rendering needs it: coordinates with respect to the
    deformed surface, applied to the canonical one. No tetrahedra are made (NeRFshop deforms those of a mesh
    forwards and inverts them one by one). Faces are split into pairs of triangles, `splits` to a side, of the
    inner cage and of the outer one.
    """

    inner: HexahedronMap
    outer: Cage
    splits: tuple[int, int]

    @classmethod
    def from_cages(cls, inner: Cage, deformed: Cage, outer: Cage) -> MeanValueShell:
        """The shell map; faces are split where they, or phi on them, are not those of two triangles."""
        phi = HexahedronMap(inner, deformed)
        exact = phi.affine is not None and _is_planar(deformed)
        return cls(phi, outer, (1 if exact else 3, 1 if _is_planar(outer) else 3))

    @cached_property
    def _mesh(self) -> tuple[ClosedMesh, Array]:
        """The deformed shell's surface, and the displacement [V,3] to canonical space of its vertices."""
        (u, inner), (w, outer) = (cube_surface(splits) for splits in self.splits)
        hole = hexahedron.points(self.inner.deformed.corners, u)
        moved = hexahedron.points(self.inner.canonical.corners, u) - hole
        vertices = np.concatenate([hexahedron.points(self.outer.corners, w), hole])
        mesh = ClosedMesh(vertices, np.concatenate([outer, inner[:, ::-1] + len(w)]))
        return mesh, np.concatenate([np.zeros_like(w), moved])

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in the shell."""
        mesh, displacement = self._mesh
        value, slope = mesh.interpolate(displacement, points)
        return points + value, np.eye(3) + slope


def cube_surface(splits: int) -> tuple[Array, Int]:
    """(u [V,3] in [0,1]^3, triangles [12 splits^2, 3]) of the unit cube's surface, seen from outside."""
    nodes: dict[tuple[int, ...], int] = {}
    triangles = []
    for axis, at, i, j in _cells(splits):
        quad = []
        for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
            node = [0, 0, 0]
            node[axis], node[(axis + 1) % 3], node[(axis + 2) % 3] = at, i + di, j + dj
            quad.append(nodes.setdefault(tuple(node), len(nodes)))
        if at == 0:
            quad.reverse()
        triangles += [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
    return np.array(list(nodes), dtype=np.float64) / splits, np.array(triangles, dtype=np.intp)


def _cells(splits: int) -> Iterator[tuple[int, int, int, int]]:
    """(axis, node on it, i, j) of the squares on a cube's faces."""
    for axis in range(3):
        for at in (0, splits):
            for i in range(splits):
                for j in range(splits):
                    yield axis, at, i, j


def _is_planar(cage: Cage) -> bool:
    """True where all six faces are planar, to 1e-9 of the cage."""
    for ids in FACES.values():
        v = cage.corners[list(ids)]
        if abs(float(np.linalg.det(v[1:] - v[0]))) > _PLANAR * float(np.ptp(cage.corners, axis=0).max()) ** 3:
            return False
    return True
