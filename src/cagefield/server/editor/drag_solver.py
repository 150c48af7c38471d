"""Result of a drag or a numeric field on an edit's cages, limited to its safe fraction.

*Edit* mode moves the inner cage with the field: the operation joins the edit's. *Set* mode moves cages alone:
the inner cage as it was trained, the outer one, or both about the inner one's pivot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from cagefield.edits import Delete, Edit, Paste
from cagefield.edits import operations as ops
from cagefield.edits.operations import Operation, Triple
from cagefield.edits.safe_fraction import largest_safe
from cagefield.errors import CagefieldError, EditError
from cagefield.geometry.cage import EDGES, FACES, Cage
from cagefield.server.editor.document import Entry
from cagefield.server.editor.pasting import crop_paste, crop_problem
from cagefield.server.editor.point_edits import check_operation
from cagefield.server.editor.validity import INSIDE_OUT, cause, problem

_ROUNDING = 1e-3
"""Share by which a drag stops earlier where operations, added up, are not safe as they were one by one."""

Target: TypeAlias = Literal["field", "inner", "outer", "both"]
"""Target of a drag: "field", the inner cage with the field (Edit mode); the others, cages alone (Set mode).

"both" turns and scales both cages about the inner cage's pivot.
"""


@dataclass(frozen=True)
class Moved:
    """An edit after the fraction `part` of an operation; `why` names the limit that stopped the rest.

    `problem` is the edit's, as `problem` finds it.
    """

    edit: Edit
    part: float = 1.0
    why: str | None = None
    problem: str | None = None


def move_corners(corners: tuple[int, ...], by: Triple) -> Operation:
    """The operation that moves some corners: of a corner, an edge or a face where they are one."""
    chosen = tuple(sorted(set(corners)))
    if len(chosen) == 1:
        return ops.MoveCorner(chosen[0], by)
    if chosen in EDGES:
        return ops.MoveEdge((chosen[0], chosen[1]), by)
    face = next((name for name, ids in FACES.items() if ids == chosen), None)
    return ops.MoveCorners(chosen, by) if face is None else ops.MoveFace(face, by)


def move(entry: Entry, target: Target, operation: Operation) -> Moved:
    """The entry's edit after as much of an operation as it can follow.

    Raises EditError for a locked edit, a deleted one, and an outer cage that is not there.
    """
    edit = entry.edit
    if entry.locked:
        raise EditError(f'edit "{edit.name}" is locked; unlock it to change it')
    outer = edit.shell_settings.outer
    if target == "outer" and outer is None:
        raise EditError(f'edit "{edit.name}" has no outer cage; give it one with "outer margin"')
    check_operation(outer if target == "outer" and outer is not None else edit.inner, operation)
    if target == "field":
        return _with_field(edit, operation)
    return _cages_alone(edit, target, operation)


def appended(operations: tuple[Operation, ...], last: Operation) -> tuple[Operation, ...]:
    """The operations with one more; moves of the same kind, one after the other, become one."""
    total = _sum(operations[-1], last) if operations else None
    return (*operations, last) if total is None else (*operations[:-1], total)


def _sum(first: Operation, second: Operation) -> Operation | None:
    """One operation in place of two moves of the same corners or of the whole cage; None for any others.

    Moves with a falloff stay apart: the second one's weights are those of the points as the first left them.
    """
    if isinstance(first, ops.MovePoints) and first.radius > 0.0:
        return None
    turning = ops.Rotate | ops.Scale | ops.Shear | ops.Bend | ops.Twist | ops.Taper | ops.Mirror
    if isinstance(first, turning) or isinstance(second, turning) or type(first) is not type(second):
        return None
    x, y, z = (a + b for a, b in zip(first.by, second.by, strict=True))
    total = replace(second, by=(x, y, z))
    return total if total == replace(first, by=total.by) else None


def _with_field(edit: Edit, operation: Operation) -> Moved:
    if isinstance(edit, Delete):
        raise EditError(f'edit "{edit.name}" deletes its cage\'s content; choose move or copy to move it')
    try:
        whole = edit.replace(operations=appended(edit.operations, operation))
    except CagefieldError:
        why = INSIDE_OUT
    else:
        found = problem(whole)
        if found is None or problem(edit) is not None:
            return Moved(whole, problem=found)
        why = found
    part = edit.safe_fraction(operation)
    while part > 0.0:
        done = edit.replace(operations=appended(edit.operations, operation.part(part)))
        if problem(done) is None:
            return Moved(done, part, why)
        part -= _ROUNDING
    return Moved(edit, 0.0, why)


def _cages_alone(edit: Edit, target: Target, operation: Operation) -> Moved:
    was_fine = problem(edit) is None

    def at(t: float) -> Edit:
        return _set_cages(edit, target, operation.part(t))

    def safe(t: float) -> bool:
        try:
            moved = at(t)
        except CagefieldError:
            return False
        return not was_fine or problem(moved) is None

    if isinstance(edit, Paste) and (refusal := crop_problem(edit, operation)) is not None:
        return Moved(edit, 0.0, refusal)
    part = largest_safe(safe)
    if part >= 1.0:
        return Moved(at(1.0), problem=None if was_fine else problem(at(1.0)))
    try:
        why = cause(problem(at(1.0)) or "the cages would not fit together on the way there")
    except CagefieldError:
        why = INSIDE_OUT
    return Moved(at(part) if part > 0.0 else edit, part, why)


def _set_cages(edit: Edit, target: Target, operation: Operation) -> Edit:
    if isinstance(edit, Paste):
        return crop_paste(edit, operation.apply(edit.deformed))
    inner = edit.inner if target == "outer" else operation.apply(edit.inner)
    settings = edit.shell_settings
    outer = settings.outer
    if outer is not None and target == "outer":
        outer = operation.apply(outer)
    elif outer is not None and target == "both" and not outer.follows_edit:
        about = operation.apply(Cage(outer.corners, pivot=edit.inner.pivot))
        outer = Cage(about.corners)
    return edit.replace(inner=inner).with_shell_settings(replace(settings, outer=outer))
