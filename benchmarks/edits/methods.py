"""Ways to fill the shell of a continuous edit, by name: ours, the paper's, and stand-ins for the peers'.

Within `peers()` an edit takes the peers' shells by name, and is evaluated and rendered with them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

from benchmarks.edits.baselines import PEERS, PeerShell
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps import SHELLS, Falloff, Shell
from cagefield.warps.interfaces import Mapped


def _as_shell(name: str) -> Callable[[Cage, Cage, Cage, Falloff], Shell]:
    def build(inner: Cage, deformed: Cage, outer: Cage, _falloff: Falloff) -> Shell:
        return PeerShell(PEERS[name](inner, deformed, outer), deformed, outer)

    return build


@contextmanager
def peers() -> Iterator[None]:
    """A context in which the peers are in `warps.SHELLS`, for edits that are made and evaluated there."""
    added = {name: _as_shell(name) for name in PEERS if name not in SHELLS}
    SHELLS.update(added)
    try:
        yield
    finally:
        for name in added:
            del SHELLS[name]


PEER_LATTICE = 96
"""Nodes an axis of the lattice from which fields are rendered with a peer's map: it has no kernel."""


@dataclass(frozen=True)
class Method:
    """A shell map, and the lattice that it is evaluated from when a field is rendered; None is exactly."""

    shell: str
    lattice: int | None = None

    def of(self, edit: Edit) -> Edit:
        """The edit with this method in its shell; a discrete edit stays as it is. Peers: within `peers`."""
        if edit.adjustment == "discrete":
            return edit
        falloff = {} if self.shell == "flow" else {"falloff": "smooth", "width": 1.0}
        return edit.replace(shell=self.shell, lattice=self.lattice, allow_folding=True, **falloff)

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
"""What is compared, ours first."""

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
    if edit.adjustment != "continuous":
        raise CagefieldError(f'edit "{edit.name}" is discrete and has no shell; choose a continuous edit')
    with peers():
        return Method(name).of(edit).exact_warp


def check_known(names: Sequence[str], known: Sequence[str] = tuple(METHODS)) -> None:
    """Raises CagefieldError where a method is unknown."""
    for name in names:
        if name not in known:
            raise CagefieldError(f"there is no method {name!r}; choose from {', '.join(known)}")
