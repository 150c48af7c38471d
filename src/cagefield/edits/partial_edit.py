"""An edit on its way: gone through to a part of what it does, as camera paths show it."""

from __future__ import annotations

from cagefield.edits.edit import Edit

WHOLE_FROM = 0.5
"""The part from which on a deletion or a paste is there: there is no half of it."""


def partial_edit(edit: Edit, part: float) -> Edit | None:
    """The edit, each of its operations gone through to a part in [0,1]; None where it shows nothing there.

    Raises `EditError` where an operation leads, at that part, to an impossible cage.
    """
    if edit.deleted or edit.source is not None:
        return edit if part >= WHOLE_FROM else None
    if part >= 1.0:
        return edit
    return edit.replace(operations=tuple(operation.part(part) for operation in edit.operations))
