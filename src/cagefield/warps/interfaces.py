"""Protocols of shells and warps, and the result type of every map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cagefield.typing import Array, Mask


@dataclass(frozen=True)
class Mapped:
    """Points after a map, its Jacobians, and the points that have no counterpart.

    points [N,3]; jacobian [N,3,3], d(mapped)/d(given); lost [N]: to canonical space, deformed points that are
    empty; to deformed space, canonical points that nothing in the deformed scene shows. Lost points are
    returned where they were, with the identity as Jacobian. inside [N]: the deformed points of V of a
    discrete edit, taken to canonical space; False otherwise.
    """

    points: Array
    jacobian: Array
    lost: Mask
    inside: Mask

    @classmethod
    def identity(cls, points: Array) -> Mapped:
        """The points as they are (the same values, bit for bit), each with the identity as Jacobian."""
        jacobian = np.tile(np.eye(3), (len(points), 1, 1))
        return cls(points.copy(), jacobian, *np.zeros((2, len(points)), dtype=bool))

    def put(self, rows: NDArray[np.intp] | Mask, points: Array, jacobian: Array) -> None:
        """Write the map's values for some rows."""
        self.points[rows], self.jacobian[rows] = points, jacobian


class InnerMap(Protocol):
    """phi: the region that a deformed inner cage holds, exactly onto the canonical one."""

    def __call__(self, points: Array) -> tuple[Mask, Array, Array]:
        """(inside [N], phi(p) [M,3], J [M,3,3]) of deformed points [N,3]; M counts those inside."""

    @property
    def inverse(self) -> InnerMap:
        """The map of the canonical region onto the deformed one."""


@dataclass(frozen=True)
class NoInnerMap:
    """The inner map of a cage whose inside has no map of its own: it holds no point."""

    def __call__(self, points: Array) -> tuple[Mask, Array, Array]:
        """No point of [N,3] is inside."""
        return np.zeros(len(points), dtype=bool), np.zeros((0, 3)), np.zeros((0, 3, 3))

    @property
    def inverse(self) -> NoInnerMap:
        """Itself."""
        return self


class Shell(Protocol):
    """A map of V^o minus V onto V^o minus V^c: equal to phi on the faces of V, the identity on those of V^o.

    Arguments must lie in the closed shell; results for other points are unspecified.
    """

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3]."""

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """(deformed points [N,3], Jacobians [N,3,3]) of canonical points [N,3]; the inverse."""

    def least_ratio(self) -> float:
        """Least det J of `to_deformed` over the shell; <= 0 where the shell folds."""

    def problem(self) -> str | None:
        """Why the shell is not one to one, in words that continue "the trilinear shell ...", or None."""


class Warp(Protocol):
    """The map of one edit, all regions together."""

    def to_canonical(self, points: Array) -> Mapped:
        """Deformed points [N,3] to canonical space."""

    def to_deformed(self, points: Array) -> Mapped:
        """Canonical points [N,3] to deformed space."""
