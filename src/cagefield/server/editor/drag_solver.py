"""Result of a drag or a numeric field on an edit's cages, limited to its safe fraction.

*Edit* mode moves the inner cage with the field: the operation joins the edit's. *Set* mode moves cages alone:
the inner cage as it was trained, the outer one, or both about the inner one's pivot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from cagefield.edits import Delete, Edit, Paste
from cagefield.edits import operations as ops
from cagefield.edits.operation_sequence import applied, cage_before_last
from cagefield.edits.operation_shares import share_of
from cagefield.edits.operations import Operation, Triple
from cagefield.edits.safe_fraction import SHARE_TOLERANCE, Search, largest_safe
from cagefield.errors import CagefieldError, EditError
from cagefield.geometry.cage import EDGES, FACES, Cage
from cagefield.server.editor.document import Entry
from cagefield.server.editor.pasting import crop_paste, crop_problem
from cagefield.server.editor.point_edits import check_operation
from cagefield.server.editor.validity import INSIDE_OUT, cause, problem

Target: TypeAlias = Literal["field", "inner", "outer", "both"]
"""Target of a drag: "field", the inner cage with the field (Edit mode); the others, cages alone (Set mode).

"both" turns and scales both cages about the inner cage's pivot.
"""


Limit: TypeAlias = tuple[Operation, float]


@dataclass(frozen=True)
class Moved:
    """An edit after the fraction `part` of an operation; `why` names the limit that stopped the rest.

    `problem` is the edit's, as `problem` finds it. `limit` is an operation and the share of it up to which
    everything is safe, to `SHARE_TOLERANCE`, where that was searched for.
    """

    edit: Edit
    part: float = 1.0
    why: str | None = None
    problem: str | None = None
    limit: Limit | None = None


def move_corners(corners: tuple[int, ...], by: Triple) -> Operation:
    """The operation that moves some corners: of a corner, an edge or a face where they are one."""
    chosen = tuple(sorted(set(corners)))
    if len(chosen) == 1:
        return ops.MoveCorner(chosen[0], by)
    if chosen in EDGES:
        return ops.MoveEdge((chosen[0], chosen[1]), by)
    face = next((name for name, ids in FACES.items() if ids == chosen), None)
    return ops.MoveCorners(chosen, by) if face is None else ops.MoveFace(face, by)


def move(entry: Entry, target: Target, operation: Operation, limit: Limit | None = None) -> Moved:
    """The entry's edit after as much of an operation as it can follow.

    `limit` is one that a former `move` of the entry and the target found.

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
        return _with_field(edit, operation, limit)
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


def _with_field(edit: Edit, operation: Operation, limit: Limit | None) -> Moved:
    if isinstance(edit, Delete):
        raise EditError(f'edit "{edit.name}" deletes its cage\'s content; choose move or copy to move it')
    whole = _followed_by(edit, operation)
    why = INSIDE_OUT if whole is None else problem(whole)
    if whole is not None and (why is None or problem(edit) is not None):
        return Moved(whole, problem=why, limit=limit)
    tried: dict[float, Edit] = {}

    def is_safe(t: float) -> bool:
        done = tried.get(t) or _followed_by(edit, operation, t)
        if done is None or problem(done) is not None:
            return False
        tried[t] = done
        return True

    part = edit.safe_fraction(operation, _search(is_safe, operation, limit))
    return Moved(tried[part] if part > 0.0 else edit, part, why, limit=(operation, part))


def _search(is_safe: Callable[[float], bool], operation: Operation, limit: Limit | None) -> Search:
    """Search of an operation that is not safe as a whole; a limit on the same way is that of this one."""
    ratio = None if limit is None else share_of(operation, limit[0])
    if limit is None or ratio is None:
        return Search(is_safe, unsafe=1.0)
    safe = ratio * limit[1]
    return Search(is_safe, min(safe, 1.0), min(safe + ratio * SHARE_TOLERANCE, 1.0))


def _followed_by(edit: Edit, operation: Operation, t: float = 1.0) -> Edit | None:
    """The edit with the share t of one more operation; None where that makes no cage."""
    try:
        operations = appended(edit.operations, operation if t == 1.0 else operation.part(t))
        # The error of an edit takes longer: it says how much would be possible.
        applied(operations[-1], cage_before_last(edit.inner, operations))
        return edit.replace(operations=operations)
    except CagefieldError:
        return None


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
