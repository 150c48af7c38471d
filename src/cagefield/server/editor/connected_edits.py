"""Connected control points in the session: their detours, as far as the rendering process has found them.

A session has no field. The rendering process finds the detours of connected control points in the background
(`render_queue.background`); until then they are drawn and dragged as plain ones.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from cagefield.edits import Continuous, Edit
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.selection.element_selection import Selection
from cagefield.server.editor.identity_cache import IdentityCache

MAX_RESOLVED = 64
"""Edits whose form with detours is remembered: those of drags come and go."""


@dataclass(frozen=True)
class Wanted:
    """Connected points; their matter is the field without `removed` elements under the edits `below`."""

    points: ControlPoints
    below: tuple[Edit, ...]
    removed: Selection | None = None


class ConnectedEdits:
    """Detours by control points: grids, or the reason why there are none."""

    def __init__(self) -> None:
        self._found: dict[ControlPoints, tuple[Wanted, DetourGrid | str]] = {}
        self._resolved: IdentityCache[Edit, Edit] = IdentityCache(MAX_RESOLVED)

    def resolved(self, edit: Edit) -> Edit:
        """The edit with its detours where they are known; the same object for the same edit."""
        points = _unprepared(edit)
        found = None if points is None else self._found.get(points)
        if points is None or found is None or isinstance(found[1], str):
            return edit
        known = self._resolved.get(edit)
        if known is not None and _detours(known) is found[1]:
            return known
        return self._resolved.put(edit, edit.replace(inner=points.with_detours(found[1])))

    def problem(self, edit: Edit) -> str | None:
        """Why an edit's control points are connected to nothing, or None."""
        points = _unprepared(edit)
        found = None if points is None else self._found.get(points)
        return found[1] if found is not None and isinstance(found[1], str) else None

    def wanted(
        self, edits: Iterable[tuple[Edit, tuple[Edit, ...]]], removed: Selection | None = None
    ) -> Wanted | None:
        """The first of the edits, each with those below it, whose detours are unknown or of other matter.

        Forgets the detours of all other edits.
        """
        first, kept = None, dict[ControlPoints, tuple[Wanted, DetourGrid | str]]()
        for edit, below in edits:
            points = _unprepared(edit)
            if points is None:
                continue
            found = self._found.get(points)
            if found is not None:
                kept[points] = found
            wanted = Wanted(points, below, removed)
            if first is None and (found is None or found[0] != wanted):
                first = wanted
        self._found = kept
        return first

    def put(self, wanted: Wanted, found: DetourGrid | str) -> None:
        """The detours that were wanted, or why there are none."""
        if isinstance(found, DetourGrid):
            # Arrays that came through a pipe can be written; kernels know those that cannot.
            found = DetourGrid(found.origin, found.edge, found.values)
        self._found[wanted.points] = wanted, found


def is_unprepared(edit: Edit) -> bool:
    """True of an edit of connected control points, which has no detours in a session."""
    return _unprepared(edit) is not None


def _unprepared(edit: Edit) -> ControlPoints | None:
    points = edit.inner
    if isinstance(edit, Continuous) and isinstance(points, ControlPoints) and points.is_unprepared:
        return points
    return None


def _detours(edit: Edit) -> DetourGrid | None:
    return edit.inner.detours if isinstance(edit.inner, ControlPoints) else None
