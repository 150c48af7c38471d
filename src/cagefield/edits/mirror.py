"""Mirror: the content of a cage reflected along one of the cage's own axes.

Notation: u in [0,1]^3 are the cage's trilinear coordinates. Without a mirror, the point of V with
coordinates u shows the point of V^c with the same ones; with mirrors along a set of axes it shows the one
with 1 - u_a for each axis a of the set. The cage stays where it is, so a mirror commutes with all other
operations, and two along one axis are none, exactly.

The map's Jacobian J = O S has det J < 0 for an odd number of axes. View directions are O^T d, covariances
J C J^T, as of rotations; harmonics c'_l = M_l(O) c_l (`fields.sh_rotation`), since f(O^T d) has harmonics of
the degrees of f: those of odd parity along a mirrored axis change their sign. Only quaternions cannot hold O:
axes of a covariance may be turned over, and a page has -O with a bit (`pages.page_splats`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from cagefield.errors import CageError
from cagefield.geometry.cage import Cage

MIRROR_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Mirror:
    """Reflect the content of the cage along an axis of its own; of a move, a copy or a paste."""

    axis: str
    noun: ClassVar[str] = "mirroring"

    def apply(self, cage: Cage) -> Cage:
        """The cage itself: only its content is reflected. Raises `CageError` for an unknown axis."""
        if self.axis not in MIRROR_AXES:
            raise CageError(f'mirror must be along x, y or z, axes of the cage, got "{self.axis!s:.20}"')
        return cage

    def part(self, t: float) -> Mirror:
        """The mirroring itself: it has no part, and is there once the edit has begun."""
        return self

    def __str__(self) -> str:
        return f"along {self.axis}"


def mirrored_axes(operations: Iterable[object]) -> tuple[int, ...]:
    """Axes 0 to 2, rising, along which an odd number of the operations mirror."""
    axes: set[int] = set()
    for operation in operations:
        if isinstance(operation, Mirror):
            axes ^= {MIRROR_AXES.index(operation.axis)}
    return tuple(sorted(axes))
