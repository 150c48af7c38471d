"""Stand-ins, without meshes, for the deformations of published cage methods, under the same handle motion.

Each is a backward shell map: from the shell between the deformed inner cage and the outer cage to canonical
space, equal to phi on the inner cage and to the identity on the outer one, as `warps.maps.Shell` asks. They
have no inverse in closed form and are no choice for an edit; they are here to be compared with.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cagefield.benchmarking.peers.harmonic import HarmonicShell
from cagefield.benchmarking.peers.mean_value import MeanValueShell
from cagefield.cages import Cage
from cagefield.hexahedron import Array
from cagefield.warps.hexahedron import HexahedronMap
from cagefield.warps.maps import Mapped


class BackwardShell(Protocol):
    """The half of a shell that rendering needs."""

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in the shell."""


PEERS: dict[str, Callable[[Cage, Cage, Cage], BackwardShell]] = {
    "mean value": MeanValueShell.of,
    "harmonic": HarmonicShell.of,
}
"""Peer by name: called with (canonical inner, deformed inner, outer) cages."""


@dataclass(frozen=True)
class PeerWarp:
    """phi in V, a peer's map in V^o minus V, the identity outside V^o; to canonical space."""

    inner: HexahedronMap
    outer: Cage
    shell: BackwardShell

    def to_canonical(self, points: Array) -> Mapped:
        """Deformed points [N,3] to canonical space."""
        mapped = Mapped.identity(points)
        rows = np.flatnonzero(self.outer.contains(points))
        inside, canonical, J = self.inner(points[rows])
        mapped.put(rows[inside], canonical, J)
        shell = rows[~inside]
        if len(shell):
            mapped.put(shell, *self.shell.to_canonical(points[shell]))
        return mapped


__all__ = ["PEERS", "BackwardShell", "HarmonicShell", "MeanValueShell", "PeerWarp"]
