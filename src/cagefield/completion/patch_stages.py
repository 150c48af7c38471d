"""Stages of patches, and whether an edit needs one: something to inpaint, to relight or to feather."""

from __future__ import annotations

from enum import IntEnum

from cagefield.edits import Continuous, Delete, Discrete, Edit


class PatchStage(IntEnum):
    """Stages of the patches of a stack, each with all of those before.

    CACHED: patches in the cache alone, none is computed. INPAINTED: holes are inpainted, without the light at
    the destination of a discrete edit and that of a continuous one, so that no patch depends on where an
    edit takes its content. LIT: light, feathered seams.
    """

    CACHED = 0
    INPAINTED = 1
    LIT = 2


def needs_patch(edit: Edit, moving: bool = False, *, feathers: bool = True) -> bool:
    """Whether an enabled discrete edit leaves something to inpaint, to relight or to feather.

    `feathers`: whether the field's kind has seams to feather; splats have none.
    """
    if not isinstance(edit, Discrete) or not (edit.enabled and edit.changes_geometry):
        return False
    seam = feathers and edit.feather > 0.0
    if not edit.uncovers:
        return not moving and (edit.relight != "none" or seam)
    return edit.fill != "none" or edit.relight != "none" or (seam and not isinstance(edit, Delete))


def needs_relighting(edit: Edit) -> bool:
    """Whether an edit is an enabled, possible continuous one that relights."""
    return (
        isinstance(edit, Continuous)
        and edit.enabled
        and edit.changes_geometry
        and edit.relight != "none"
        and edit.is_possible
    )
