"""Stand-ins, without meshes, for the deformations of published cage methods, under the same handle motion.

Each is a backward shell map: from the shell between the deformed inner cage and the outer cage to canonical
space, equal to phi on the inner cage and to the identity on the outer one, as `warps.interfaces.Shell` asks.
They have no inverse in closed form, and may fold; they are here to be compared with.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from benchmarks.edits.baselines.harmonic import HarmonicShell
from benchmarks.edits.baselines.mean_value import MeanValueShell
from cagefield.errors import EditError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array


class BackwardShell(Protocol):
    """The half of a shell that rendering needs."""

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in the shell."""


PEERS: dict[str, Callable[[Cage, Cage, Cage], BackwardShell]] = {
    "mean value": MeanValueShell.from_cages,
    "harmonic": HarmonicShell.from_cages,
}
"""Peer by name: called with (canonical inner, deformed inner, outer) cages."""


@dataclass(frozen=True)
class PeerShell:
    """A peer's map as the shell of an edit; folded or not, it is evaluated."""

    backward: BackwardShell
    deformed: Cage
    outer: Cage

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in the shell."""
        return self.backward.to_canonical(points)

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """Raises EditError: the map back is all there is."""
        raise EditError(f'a {type(self.backward).__name__} has no map to deformed space; use shell="flow"')

    def least_ratio(self) -> float:
        """Least det J of the map's inverse over 20,000 points of the shell; <= 0 where the map folds."""
        points = self.outer.frame[0] + np.random.default_rng(0).random((20_000, 3)) @ self.outer.frame[1].T
        points = points[self.outer.contains(points)]
        det = np.linalg.det(self.to_canonical(points[~self.deformed.contains(points)])[1])
        return float(det.min() if det.min() <= 0.0 else 1.0 / det.max())

    def problem(self) -> str | None:
        """None: whether a peer's map folds is what is measured."""
        return None


__all__ = ["PEERS", "BackwardShell", "HarmonicShell", "MeanValueShell", "PeerShell"]
