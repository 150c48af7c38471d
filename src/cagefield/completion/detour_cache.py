"""Detours of connected control points in one field, computed on demand, the latest of which are kept."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from cagefield.edits import Edit, PreparedEdit, PreparedStack
from cagefield.edits.chains import application_order
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.selection.connected_points import detours_of, with_detours
from cagefield.typing import Array

MAX_CACHED_DETOURS = 16
"""Maximum number of grids of detours in memory."""

AnyEdit = TypeVar("AnyEdit", bound=Edit)


class DetourCache:
    """Detours in a field, by control points and the edits under them."""

    def __init__(self, field: SplatField | VoxelField) -> None:
        self._field = field
        self._known: OrderedDict[tuple[object, ...], DetourGrid] = OrderedDict()

    def of_points(self, points: ControlPoints, below: PreparedStack) -> DetourGrid:
        """Detours of connected points under the edits `below`.

        Raises `EditError` for a control point without matter within the radius.
        """
        touching = _touching(points, below)
        key = (*touching, points)
        if key not in self._known:
            self._put(key, detours_of(points, self._field, PreparedStack(touching)))
        self._known.move_to_end(key)
        return self._known[key]

    def prepared(self, step: PreparedEdit, below: PreparedStack) -> PreparedEdit:
        """An edit with the detours of its connected control points; others, and those without effect, as
        they are. Raises as `of_points`, with the edit's name."""
        points = step.edit.inner
        if not isinstance(points, ControlPoints) or not points.is_unprepared:
            return step
        touching = _touching(points, below)
        key = (*touching, points)
        if key in self._known:
            self._known.move_to_end(key)
            return replace(step, edit=step.edit.replace(inner=points.with_detours(self._known[key])))
        edit = with_detours(step.edit, self._field, PreparedStack(touching))
        if edit is step.edit:
            return step
        assert isinstance(edit.inner, ControlPoints) and edit.inner.detours is not None
        self._put(key, edit.inner.detours)
        return replace(step, edit=edit)

    def in_stack(self, edits: Sequence[Edit]) -> list[Edit]:
        """The edits of a document, in its order, with the detours that each has in the order of application.

        Raises `EditError` as `prepared`, and for parents that are not possible.
        """
        found, below = list(edits), list[Edit]()
        for number in application_order(edits):
            found[number] = self.prepared(PreparedEdit(edits[number]), PreparedStack(below)).edit
            below.append(found[number])
        return found

    def _put(self, key: tuple[object, ...], detours: DetourGrid) -> None:
        self._known[key] = detours
        while len(self._known) > MAX_CACHED_DETOURS:
            self._known.popitem(last=False)


def _touching(points: ControlPoints, below: PreparedStack) -> tuple[PreparedEdit, ...]:
    """The edits below where one of them reaches the points' box; none where none does."""
    return (*below.steps,) if boxes_meet(below.boxes, points.aabb) else ()


def boxes_meet(boxes: Array, box: Array) -> bool:
    """True where one of boxes [B,2,3] meets a box [2,3]."""
    return bool(((boxes[:, 0] <= box[1]) & (box[0] <= boxes[:, 1])).all(axis=1).any())
