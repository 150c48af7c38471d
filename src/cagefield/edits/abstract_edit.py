"""Fields, checks and duties that edits of every kind share."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Any, TypedDict, TypeVar, cast

import numpy as np

from cagefield.edits.edit_names import problem_of_name, problem_of_parent
from cagefield.edits.grade import GRADE_FIELDS, NEUTRAL_GRADE, Grade
from cagefield.edits.operation_sequence import (
    ImpossibleOperationError,
    cage_after,
    cage_before_last,
    problem_of_count,
)
from cagefield.edits.operations import Operation
from cagefield.edits.options import DEFAULT_FEATHER_VOXELS, Fill, Relight, problem_of_infill
from cagefield.edits.safe_fraction import NOTHING_KNOWN, Search
from cagefield.edits.shells import ShellSettings
from cagefield.edits.transformable import Transformable
from cagefield.errors import EditError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask
from cagefield.warps import Warp

AnyEdit = TypeVar("AnyEdit", bound="AbstractEdit")


class ImpossibleEditError(EditError):
    """An edit whose operation `number`, counted from 1, makes no cage."""

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.number = number


class SharedOptions(TypedDict):
    """Fields that edits of every kind have, but for the operations, which a delete has not."""

    name: str
    enabled: bool
    parent: str
    fill: Fill
    relight: Relight
    feather: float


@dataclass(frozen=True)
class AbstractEdit(Transformable):
    """Fields and methods of an `Edit`, which adds the functions that make one of each kind."""

    inner: Cage
    _: KW_ONLY
    operations: tuple[Operation, ...] = ()
    name: str = ""
    enabled: bool = True
    parent: str = ""
    fill: Fill = "surroundings"
    relight: Relight = "occlusion"
    feather: float = DEFAULT_FEATHER_VOXELS
    grading: Grade = NEUTRAL_GRADE

    def __post_init__(self) -> None:
        object.__setattr__(self, "operations", tuple(self.operations))
        problem = (
            problem_of_name(self.name)
            or problem_of_parent(self.parent)
            or problem_of_count(len(self.operations))
        )
        if problem is not None:
            raise EditError(f"edit: {problem}")
        self._refuse(problem_of_infill(self.fill, self.relight, self.feather))
        if not isinstance(self.grading, Grade):
            self._refuse(f"grading must be a Grade(...), got {self.grading!r:.60}")
        self.deformed  # noqa: B018  an operation that makes an impossible cage is an error here

    @cached_property
    def deformed(self) -> Cage:
        """The inner cage after all operations."""
        try:
            return cage_after(self.inner, self.operations)
        except ImpossibleOperationError as error:
            raise ImpossibleEditError(str(self.error(str(error))), error.number) from None

    def then(self: AnyEdit, operation: Operation) -> AnyEdit:
        """The edit with one more operation."""
        return self.replace(operations=(*self.operations, operation))

    def replace(self: AnyEdit, **changes: Any) -> AnyEdit:
        """The edit with some fields changed; its kind stays."""
        return replace(self, **changes)

    def parented_to(self: AnyEdit, parent: AbstractEdit | str) -> AnyEdit:
        """The edit carried by another one of its stack, given by itself or by its name; "" for none.

        Cages and operations of the edit stay where the parent's content is at rest; see `chains`. Raises
        `EditError` for a parent without a name.
        """
        name = parent.name if isinstance(parent, AbstractEdit) else parent
        if isinstance(parent, AbstractEdit) and not name:
            raise self.error("its parent has no name; give it one, name=...")
        return self.replace(parent=name)

    @cached_property
    def without_parent(self: AnyEdit) -> AnyEdit:
        """The edit that nothing carries; itself where nothing does."""
        return self.replace(parent="") if self.parent else self

    @property
    def shared_options(self) -> SharedOptions:
        """Fields that an edit of another kind takes over."""
        return {
            "name": self.name,
            "enabled": self.enabled,
            "parent": self.parent,
            "fill": self.fill,
            "relight": self.relight,
            "feather": self.feather,
        }

    # ---- kind-specific ----

    @property
    @abstractmethod
    def shell_settings(self) -> ShellSettings:
        """Settings of the shell; of a discrete edit those for a change of its kind, without effect."""

    @abstractmethod
    def with_shell_settings(self: AnyEdit, settings: ShellSettings) -> AnyEdit:
        """The edit with other settings of the shell."""

    @property
    @abstractmethod
    def changes_geometry(self) -> bool:
        """False where the map is the identity: the inner cage of a move, copy or continuous edit is where it
        was."""

    @abstractmethod
    def grade_weights(self, points: Array, inside: Mask) -> Array:
        """Weights [N] in [0, 1] of the grade at canonical points [N,3]; `inside` [N] as in `Mapped`."""

    @property
    @abstractmethod
    def boxes(self) -> Array:
        """Deformed-space boxes [B,2,3] (min, max), B 0 to 2, outside which the edit changes nothing."""

    @property
    @abstractmethod
    def exact_warp(self) -> Warp:
        """The map of this edit without its lattice. Raises `EditError` as `check` does."""

    @property
    @abstractmethod
    def warp(self) -> Warp:
        """The map of this edit, through its lattice if it has one. Raises `EditError` as `check` does."""

    @abstractmethod
    def check(self) -> None:
        """Raise `EditError` where the edit cannot be evaluated, naming the fault and the share still safe."""

    @property
    @abstractmethod
    def is_possible(self) -> bool:
        """True where the edit can be evaluated: where `check` raises nothing. Faster than its message."""

    @abstractmethod
    def without_lattice(self: AnyEdit) -> AnyEdit:
        """The edit evaluated exactly; a discrete edit as it is."""

    @abstractmethod
    def largest_share(self, operation: Operation, cage: Cage, search: Search) -> float:
        """Largest safe share in [0,1] of an operation on the inner cage when that is at `cage`."""

    # ---- shared ----

    @property
    def is_graded(self) -> bool:
        """True where the edit changes color or opacity by its `grading`."""
        return not self.grading.is_neutral

    @property
    def ungraded(self: AnyEdit) -> AnyEdit:
        """The edit with a neutral grade; itself where it has one."""
        return cast(AnyEdit, self._ungraded) if self.is_graded else self

    @cached_property
    def _ungraded(self) -> AbstractEdit:
        return self.replace(grading=NEUTRAL_GRADE)

    @property
    def changes_anything(self) -> bool:
        """False where the edit neither moves nor grades anything."""
        return self.changes_geometry or self.is_graded

    def grade(self: AnyEdit, **values: float) -> AnyEdit:
        """The edit with some values of its `Grade` changed: grade(exposure=0.5, saturation=1.2).

        Raises `EditError` for an unknown name, a value out of its range, and a delete.
        """
        unknown = next((name for name in values if name not in GRADE_FIELDS), None)
        if unknown is not None:
            raise self.error(f"grade has {', '.join(GRADE_FIELDS)}, not {unknown}")
        return self.replace(grading=replace(self.grading, **values))

    @property
    def bounds(self) -> Array:
        """The box [2,3] that holds `boxes`; (inf, -inf) for an edit that changes nothing."""
        return bounds_of(self.boxes)

    def safe_fraction(self, operation: Operation | None = None, search: Search = NOTHING_KNOWN) -> float:
        """Largest t in [0,1], to 1e-3, at which the share t of an operation can follow this edit.

        1.0 where the whole operation is safe; otherwise everything from 0 to t is. The default is the last
        operation. A discrete edit is limited only by its cage turning inside out. `search` has knowledge
        from before.
        """
        if operation is not None:
            return self.largest_share(operation, self.deformed, search)
        if not self.operations:
            return 1.0
        before = cage_before_last(self.inner, self.operations)
        return self.largest_share(self.operations[-1], before, search)

    def error(self, message: str) -> EditError:
        """An error that names the edit."""
        return EditError(f'edit "{self.name}": {message}' if self.name else f"edit: {message}")

    def _refuse(self, problem: str | None) -> None:
        if problem is not None:
            raise self.error(problem)

    @property
    def _is_moved(self) -> bool:
        return not self.inner.has_shape_of(self.deformed)


def bounds_of(boxes: Array) -> Array:
    """The box [2,3] that holds boxes [B,2,3]; (inf, -inf) for none."""
    return np.stack([boxes[:, 0].min(axis=0, initial=np.inf), boxes[:, 1].max(axis=0, initial=-np.inf)])


def boxes_of_cages(cages: Sequence[Cage]) -> Array:
    """Axis-aligned boxes [B,2,3] (min, max) of cages."""
    return np.array([cage.aabb for cage in cages]).reshape(-1, 2, 3)
