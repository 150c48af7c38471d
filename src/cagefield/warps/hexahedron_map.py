"""The inner map phi: the deformed inner cage onto the canonical one, exactly."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask


@dataclass(frozen=True)
class HexahedronMap:
    """phi for a pair of cages: x_c(u(p)), with u(p) the trilinear coordinates of p in the deformed cage.

    Where the cage was only transformed (translated, rotated, scaled, sheared) phi is affine and evaluated in
    closed form; where it was deformed, u(p) comes from Newton's method (`geometry.hexahedron.inverse`).

    `mirrored` are axes 0 to 2 of the cages along which u goes to 1 - u: the content is reflected.

    Source: Li & Pan, section 3, "trilinear interpolation" of a cage's inside.
    """

    canonical: Cage
    deformed: Cage
    mirrored: tuple[int, ...] = ()

    @cached_property
    def onto(self) -> Array:
        """Corners [8,3] of the canonical cage in the order of those of the deformed one that they go to."""
        flip = sum(1 << axis for axis in self.mirrored)
        return self.canonical.corners[np.arange(8) ^ flip]

    @cached_property
    def affine(self) -> tuple[Array, Array] | None:
        """(A [3,3], b [3]) with phi(p) = A p + b, or None where phi is not affine (to 1e-12 of the cage)."""
        return _affine_between(self.deformed.corners, self.onto)

    @cached_property
    def inverse(self) -> HexahedronMap:
        """The map from the canonical cage onto the deformed one."""
        return HexahedronMap(self.deformed, self.canonical, self.mirrored)

    def __call__(self, points: Array) -> tuple[Mask, Array, Array]:
        """(inside [N], phi(p) [M,3], J [M,3,3]) of deformed points [N,3]; M counts those inside the cage."""
        u, inside = self.deformed.coordinates(points)
        if self.affine is not None:
            A, b = self.affine
            return inside, points[inside] @ A.T + b, np.broadcast_to(A, (int(inside.sum()), 3, 3))
        return inside, *map_hexahedron(self.deformed.corners, self.onto, u[inside])


def map_hexahedron(corners: Array, onto: Array, u: Array) -> tuple[Array, Array]:
    """(x_onto(u) [N,3], Jacobian [N,3,3]) of the map that keeps u, from one hexahedron onto another."""
    J = hexahedron.jacobian(onto, u) @ hexahedron.invert(hexahedron.jacobian(corners, u))
    return hexahedron.points(onto, u), J


def _affine_between(source: Array, target: Array) -> tuple[Array, Array] | None:
    """(A, b) that takes corners [8,3] to corners [8,3], or None."""
    C, D = hexahedron.coefficients(source), hexahedron.coefficients(target)
    A = D[[1, 2, 4]].T @ hexahedron.center_inverse(C)
    bend = D[[3, 5, 6, 7]] - C[[3, 5, 6, 7]] @ A.T
    if np.abs(bend).max() > 1e-12 * np.abs(D[[1, 2, 4]]).max():
        return None
    return A, D[0] - A @ C[0]
