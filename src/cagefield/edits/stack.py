"""Edits in order, as a document has them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import SupportsIndex

from cagefield.edits.chains import resolved_edits
from cagefield.edits.edit import Continuous, Edit
from cagefield.edits.edit_map import EditMap
from cagefield.edits.options import problem_of_lattices
from cagefield.edits.prepared import PreparedEdit
from cagefield.errors import EditError


@dataclass(frozen=True)
class LatticeError:
    """How far an edit's lattice is off its exact map, in voxels: at most, and on average over the shell.

    `number` is the edit's place in its stack, from 0.
    """

    number: int
    name: str
    resolution: int
    worst: float
    mean: float


@dataclass(frozen=True)
class EditStack(EditMap):
    """Edits e_1 ... e_n: the deformed field of e_k is the canonical field of e_(k+1).

    A sample goes through phi_n first and phi_1 last. Edits that are not enabled, or change nothing, are
    passed over. Edits with a parent are applied directly before it (`chains`), wherever they are listed.
    """

    edits: tuple[Edit, ...] = ()

    def __init__(self, edits: Iterable[Edit] = ()) -> None:
        object.__setattr__(self, "edits", tuple(edits))
        for number, edit in enumerate(self.edits):
            if not isinstance(edit, Edit):
                raise EditError(f"an edit stack holds edits: item {number} is a {type(edit).__name__}")

    def __len__(self) -> int:
        return len(self.edits)

    def __iter__(self) -> Iterator[Edit]:
        return iter(self.edits)

    def __getitem__(self, number: SupportsIndex) -> Edit:
        return self.edits[number]

    @property
    def resolved(self) -> tuple[Edit, ...]:
        """All edits in the order of application, without parents (`chains.resolved_edits`).

        Raises `EditError` for a parent that is missing, ambiguous, a paste or in a circle.
        """
        return resolved_edits(self.edits)

    @property
    def active(self) -> tuple[Edit, ...]:
        """The edits that are enabled and change something, in the order of application.

        Raises `EditError` as `resolved` does.
        """
        return tuple(edit for edit in self.resolved if edit.enabled and edit.changes_anything)

    @property
    def steps(self) -> tuple[PreparedEdit, ...]:
        return tuple(PreparedEdit(edit) for edit in self.active)

    def append(self, edit: Edit) -> EditStack:
        """The stack with one more edit at its end."""
        return EditStack((*self.edits, edit))

    def set(self, number: int, edit: Edit) -> EditStack:
        """The stack with one edit replaced."""
        edits = list(self.edits)
        edits[number] = edit
        return EditStack(edits)

    def remove(self, number: int) -> EditStack:
        """The stack without one edit."""
        edits = list(self.edits)
        del edits[number]
        return EditStack(edits)

    def move(self, number: int, to: int) -> EditStack:
        """The stack with one edit taken out and put in at another place."""
        edits = list(self.edits)
        edits.insert(to, edits.pop(number))
        return EditStack(edits)

    def lattice_errors(self, voxel_size: float, *, samples: int = 5_000) -> tuple[LatticeError, ...]:
        """The errors of the active edits that have a lattice, in voxels of an edge in world units.

        Measured at that many random points of each shell, between the inner and the outer cage. Raises
        `EditError` for an edit that cannot be evaluated, or a voxel size that is not positive.
        """
        if not voxel_size > 0.0:
            raise EditError(f"voxel_size must be positive, the edge of a voxel, got {voxel_size!r}")
        errors = []
        for number, edit in enumerate(self.edits):
            if not isinstance(edit, Continuous) or edit.lattice is None:
                continue
            if edit.enabled and edit.changes_anything:
                worst, mean = (error / voxel_size for error in edit.lattice_error(samples=samples))
                errors.append(LatticeError(number, edit.name, edit.lattice, worst, mean))
        return tuple(errors)

    def check(self) -> None:
        """Raise `EditError` for the first active edit that cannot be evaluated, for too large lattices, and
        for parents that are not possible."""
        too_large = problem_of_lattices(
            edit.kernel_lattice for edit in self.edits if edit.enabled and isinstance(edit, Continuous)
        )
        if too_large is not None:
            raise EditError(too_large)
        for edit in self.active:
            edit.check()
