"""Ways to fill the shell of a continuous edit, by name: ours, the paper's, and stand-ins for the peers'."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from benchmarks.edits.baselines import PEERS, PeerShell
from cagefield.edits import Continuous, Edit, EditStack, Flow, ShellKind, shell_kind
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps import Shell
from cagefield.warps.interfaces import Mapped


@dataclass(frozen=True)
class Peer(ShellKind):
    """Stand-in for a peer's shell map, by its name in `peers.PEERS`."""

    peer: str

    @property
    def name(self) -> str:
        return self.peer

    def build(self, inner: Cage, deformed: Cage, outer: Cage) -> Shell:
        return PeerShell(PEERS[self.peer](inner, deformed, outer), deformed, outer)


PEER_LATTICE = 96
"""Nodes an axis of the lattice from which fields are rendered with a peer's map: it has no kernel."""


@dataclass(frozen=True)
class Method:
    """A shell map, and the lattice that it is evaluated from when a field is rendered; None is exactly."""

    shell: str
    lattice: int | None = None

    def of(self, edit: Edit) -> Edit:
        """The edit with this method in its shell; a discrete edit stays as it is."""
        if not isinstance(edit, Continuous):
            return edit
        kind = Peer(self.shell) if self.shell in PEERS else shell_kind(self.shell)
        if isinstance(kind, Flow) and isinstance(edit.shell, Flow):
            kind = edit.shell
        return edit.replace(shell=kind, lattice=self.lattice, allow_folding=True)

    def of_all(self, edits: EditStack) -> EditStack:
        """The stack with this method in all its shells."""
        return EditStack(self.of(edit) for edit in edits)


METHODS: dict[str, Method] = {
    "flow": Method("flow"),
    "flow 64": Method("flow", 64),
    "trilinear": Method("trilinear"),
    "trilinear 64": Method("trilinear", 64),
    "trilinear 128": Method("trilinear", 128),
    "trilinear 256": Method("trilinear", 256),
    "mean value": Method("mean value", PEER_LATTICE),
    "harmonic": Method("harmonic", PEER_LATTICE),
}
"""Compared methods, ours first."""

MAPS: tuple[str, ...] = tuple(dict.fromkeys(method.shell for method in METHODS.values()))
"""The maps among them, each once."""


class BackwardMap(Protocol):
    """A map of all space from deformed to canonical."""

    def to_canonical(self, points: Array) -> Mapped:
        """Deformed points [N,3] to canonical space."""


def exact_map(name: str, edit: Edit) -> BackwardMap:
    """The map that one of `MAPS` makes of a continuous edit's cages, evaluated exactly; folded ones, too.

    Raises:
        CagefieldError: an unknown map, or an edit that is not continuous.
        EditError: an inner cage that is not inside the outer one.
    """
    check_known((name,), MAPS)
    if not isinstance(edit, Continuous):
        raise CagefieldError(f'edit "{edit.name}" is discrete and has no shell; choose a continuous edit')
    return Method(name).of(edit).exact_warp


def check_known(names: Sequence[str], known: Sequence[str] = tuple(METHODS)) -> None:
    """Raises CagefieldError where a method is unknown."""
    for name in names:
        if name not in known:
            raise CagefieldError(f"there is no method {name!r}; choose from {', '.join(known)}")
