"""Ways to fill the shell of a continuous edit, by name: ours, the paper's, and stand-ins for the peers'."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from cagefield.benchmarking.peers import PEERS, PeerWarp
from cagefield.edits import Edit
from cagefield.errors import CagefieldError
from cagefield.hexahedron import Array
from cagefield.warps import SHELLS
from cagefield.warps.hexahedron import HexahedronMap
from cagefield.warps.maps import Mapped

MAPS: tuple[str, ...] = (*(name for name in ("flow", "trilinear") if name in SHELLS), *PEERS)
"""The maps there are, ours first."""


class BackwardMap(Protocol):
    """A map of all space from deformed to canonical."""

    def to_canonical(self, points: Array) -> Mapped:
        """Deformed points [N,3] to canonical space."""


def exact_map(name: str, edit: Edit) -> BackwardMap:
    """The map that a method makes of a continuous edit's cages, evaluated exactly; folded ones, too.

    Raises:
        CagefieldError: an unknown method, or an edit that is not continuous.
        EditError: an inner cage that is not inside the outer one.
    """
    check_known((name,))
    if edit.adjustment != "continuous" or edit.outer is None:
        raise CagefieldError(f'edit "{edit.name}" is discrete and has no shell; choose a continuous edit')
    if name in SHELLS:
        return edit.replace(shell=name, lattice=None, allow_folding=True).exact_warp
    edit.replace(allow_folding=True).check()
    shell = PEERS[name](edit.inner, edit.deformed, edit.outer)
    return PeerWarp(HexahedronMap(edit.inner, edit.deformed), edit.outer, shell)


def check_known(names: Sequence[str]) -> None:
    """Raises CagefieldError where a method is unknown."""
    for name in names:
        if name not in MAPS:
            raise CagefieldError(f"there is no method {name!r}; choose from {', '.join(MAPS)}")
