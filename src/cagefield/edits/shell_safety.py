"""Safety of a continuous edit: whether its shell can surround a deformed inner cage, and how far it could."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cagefield.edits.operation_sequence import cages_along
from cagefield.edits.operations import Operation
from cagefield.edits.safe_fraction import NOTHING_KNOWN, Search, flow_reach, format_share, largest_safe
from cagefield.edits.shells import Flow, ShellKind
from cagefield.errors import CageError
from cagefield.geometry.cage import Cage
from cagefield.geometry.cage_checks import format_vector
from cagefield.geometry.face_distance import outside_by
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.warps import Shell

_MAX_SEARCHED_OPERATIONS = 500
"""Maximum number of operations searched for the one from which an impossible edit never recovered."""


@dataclass(frozen=True)
class ShellSafety:
    """Safety analysis of the shell between an inner and an outer cage.

    - inner: the canonical inner cage V^c; outer: the outer cage V^o.
    - kind: kind of the shell.
    - build: shell with the inner cage at a deformed one.
    - allow_folding: True counts a folded shell as safe.
    """

    inner: Cage
    outer: Cage
    kind: ShellKind
    build: Callable[[Cage], Shell]
    allow_folding: bool = False

    def largest_share(self, operation: Operation, cage: Cage, search: Search = NOTHING_KNOWN) -> float:
        """Largest safe share in [0,1] of an operation on the inner cage when that is at `cage`."""

        def own_check(t: float) -> bool:
            try:
                return self.is_safe(operation.part(t).apply(cage))
            except CageError:
                return False

        is_safe = search.check or own_check
        if search.is_over and is_safe(search.safe):
            return search.safe
        if isinstance(self.kind, Flow) and self.inner.is_hexahedron:
            if search.unsafe > 1.0 and is_safe(1.0):
                return 1.0
            for fine in (False,) if self.outer.is_affine else (False, True):
                reach = flow_reach(operation, cage, (self.inner, self.outer), fine=fine)
                if reach < 1.0 and is_safe(reach):
                    return reach
        return largest_safe(is_safe, search)

    def safe_part(self, operations: Sequence[Operation]) -> str:
        """Clause with the safe share of the operation after which the edit never recovered."""
        cages = [self.inner, *cages_along(self.inner, operations)]
        # Of very many operations only the last are searched, which take a second.
        first = max(0, len(operations) - _MAX_SEARCHED_OPERATIONS)
        for number in range(len(operations), first, -1):
            if self.is_safe(cages[number - 1]):
                operation = operations[number - 1]
                share = format_share(self.largest_share(operation, cages[number - 1]))
                return f"; {share} of this {operation.noun} (operation {number}, {operation}) is safe"
        return ""

    @property
    def is_safe_at_rest(self) -> bool:
        """`is_safe` before all operations; remembered for equal cages."""
        return _is_safe_at_rest(self.kind, self.inner, self.outer, self.allow_folding)

    def is_safe(self, deformed: Cage) -> bool:
        """True where the edit can be evaluated with its inner cage at `deformed`."""
        if isinstance(self.kind, Flow):  # which finds corners outside by itself
            return self.build(deformed).problem() is None
        if not self.outer.contains(deformed.corners).all():
            return False
        return self.allow_folding or self.build(deformed).problem() is None

    def fault(self, deformed: Cage) -> tuple[str, str]:
        """(fault, cure) with the inner cage at a `deformed` that is not safe."""
        handles = deformed.handles
        has_corners = self.inner.is_hexahedron
        outside = np.flatnonzero(~self.outer.contains(handles))
        if len(outside) and isinstance(self.outer, MeshCage):
            k = int(outside[0])
            return (
                f"outer cage must contain the inner cage: {deformed.handle_noun} {k} at"
                f" {format_vector(handles[k])} is outside of its mesh",
                "; enlarge the outer cage",
            )
        if len(outside):
            face, distance, k = max(
                ((*outside_by(self.outer, handles[k]), int(k)) for k in outside),
                key=lambda item: item[1],
            )
            return (
                f"outer cage must contain the inner cage: {deformed.handle_noun} {k} at"
                f" {format_vector(handles[k])} is {distance:.3g} outside face {face}",
                "; enlarge the outer cage"
                + (" or make the edit discrete" if self.inner.is_hexahedron else ""),
            )
        if has_corners:
            cure = "; reduce it, enlarge the outer cage, or make the edit discrete"
        else:
            cure = "; reduce it" if self.outer.follows_edit else "; reduce it, or enlarge the outer cage"
        return (
            f"the {self.kind.name} shell {self.build(deformed).problem()}",
            "" if deformed is self.inner else cure,
        )


@lru_cache(maxsize=64)
def _is_safe_at_rest(kind: ShellKind, inner: Cage, outer: Cage, allow_folding: bool) -> bool:
    build = lambda deformed: kind.build(inner, deformed, outer)  # noqa: E731
    return ShellSafety(inner, outer, kind, build, allow_folding).is_safe(inner)
