"""Edit at a share of its operations, as camera paths show it on the way."""

from __future__ import annotations

from dataclasses import replace

from cagefield.edits.edit import Delete, Edit, Paste
from cagefield.edits.mirror import mirrored_axes
from cagefield.geometry.cage import Cage

MIN_SHOWN_SHARE = 0.5
"""Share from which a delete or a paste is shown: neither has an intermediate state."""


def partial_edit(edit: Edit, share: float) -> Edit | None:
    """The edit with its operations and its grade done to a share in [0,1]; None where it shows nothing there.

    A mirrored copy is mirrored at every share but 0.
    Raises `EditError` where an operation leads, at that share, to an impossible cage.
    """
    if isinstance(edit, Delete | Paste):
        return edit if share >= MIN_SHOWN_SHARE else None
    if share <= 0.0 and mirrored_axes(edit.operations):
        return None
    if share >= 1.0:
        return edit
    there = edit.replace(
        operations=tuple(operation.part(share) for operation in edit.operations),
        grading=edit.grading.part(share),
    )
    outer = edit.shell_settings.outer
    if outer is None or not outer.follows_edit:
        return there
    # One outer cage for the whole way: pages interpolate between lattices of one place.
    return there.with_shell_settings(replace(there.shell_settings, outer=Cage(outer.corners)))
