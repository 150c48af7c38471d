"""The four kinds of an edit as an editor names them, and what changing the options of an edit does to it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, TypeAlias

from cagefield.edits import Edit
from cagefield.errors import EditError
from cagefield.server.editor.cage_placement import OUTER_CAGE_MARGIN_SHARE, outer_cage_around
from cagefield.server.editor.document import Entry, Spare

Kind: TypeAlias = Literal["continuous", "move", "copy", "delete"]


def kind_of(edit: Edit) -> Kind:
    """What an edit does: "continuous", or discrete "move", "copy" or "delete"."""
    if edit.adjustment == "continuous":
        return "continuous"
    if edit.deleted:
        return "delete"
    return "copy" if edit.keep_source else "move"


def with_kind(entry: Entry, kind: Kind) -> Entry:
    """The entry with its edit of another kind; what that kind cannot have waits in `spare`."""
    edit, spare = entry.edit, entry.spare
    if kind == kind_of(edit):
        return entry
    if edit.source is not None:
        raise EditError(f'edit "{edit.name}" is pasted, and stays a copy; remove it to take it away')
    kept = Spare(
        edit.operations or spare.operations,
        edit.falloff if _fades(edit) else spare.falloff,
        edit.width if _fades(edit) else spare.width,
    )
    changes: dict[str, Any] = {
        "adjustment": "continuous" if kind == "continuous" else "discrete",
        "keep_source": kind == "copy",
        "deleted": kind == "delete",
        "operations": () if kind == "delete" else kept.operations,
        "falloff": "smooth",
        "width": 1.0,
    }
    if kind == "continuous":
        if edit.shell == "flow":
            changes |= {"falloff": kept.falloff, "width": kept.width}
        if edit.outer is None:
            changes["outer"] = outer_cage_around(edit, _margin(edit))
    return replace(entry, edit=edit.replace(**changes), spare=kept)


def with_shell(entry: Entry, shell: str) -> Entry:
    """The entry with another shell map; only a continuous flow shell has a falloff and a width."""
    edit, spare = entry.edit, entry.spare
    if shell == edit.shell:
        return entry
    changes: dict[str, Any] = {"shell": shell, "falloff": "smooth", "width": 1.0}
    if _fades(edit):
        spare = replace(spare, falloff=edit.falloff, width=edit.width)
    elif shell == "flow" and edit.adjustment == "continuous":
        changes |= {"falloff": spare.falloff, "width": spare.width}
    return replace(entry, edit=edit.replace(**changes), spare=spare)


def _fades(edit: Edit) -> bool:
    return edit.adjustment == "continuous" and edit.shell == "flow"


def _margin(edit: Edit) -> float:
    low, high = edit.inner.aabb
    return OUTER_CAGE_MARGIN_SHARE * float((high - low).max())
