"""Why cages cannot be where they are put, for who sees the editor: no numbers, and a cure that it has."""

from __future__ import annotations

from cagefield.edits import Continuous, Edit, Trilinear

OUTSIDE_MESSAGE = "the inner cage must stay inside the outer cage; enlarge the outer cage (Set mode)"
FOLDED = "the space between the cages would fold; enlarge the outer cage (Set mode), or choose the flow shell"
CLOSE = "the inner cage is too close to the outer cage or bent too far; enlarge the outer cage (Set mode)"
INSIDE_OUT = "the cage would turn inside out; keep its corners apart"


def problem(edit: Edit) -> str | None:
    """Why an edit cannot be shown, in a sentence with its cure, or None."""
    if edit.is_possible:
        return None
    if not isinstance(edit, Continuous):
        return None
    outer = edit.outer
    if not outer.contains([*edit.inner.handles, *edit.deformed.handles]).all():
        return OUTSIDE_MESSAGE
    return FOLDED if isinstance(edit.shell, Trilinear) else CLOSE


def check_has_corners(edit: Edit) -> None:
    """Raise `EditError` for an edit whose inner cage is not placed by 8 corners."""
    if not edit.inner.is_hexahedron:
        raise edit.error(f"{edit.inner.plural_noun} are not placed by corners; move them with the gizmo")


def cause(reason: str) -> str:
    """A reason without its cure."""
    return reason.split(";")[0]
