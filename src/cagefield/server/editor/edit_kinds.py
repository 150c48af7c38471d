"""The four kinds of an edit as an editor names them, and the effect of changed options on an edit.

An option that the new kind of an edit cannot have is kept in the entry's `Spare`, for the way back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal, TypeAlias

from cagefield.edits import Continuous, Copy, Delete, Edit, Flow, Grade, Move, Paste, shell_kind
from cagefield.edits.shells import SMOOTH_FLOW, problem_of_unused_falloff
from cagefield.errors import EditError
from cagefield.geometry.cage import Cage
from cagefield.server.editor.cage_placement import OUTER_CAGE_MARGIN_SHARE, outer_cage_around
from cagefield.server.editor.document import Entry, Spare

Kind: TypeAlias = Literal["continuous", "move", "copy", "delete"]


def kind_of(edit: Edit) -> Kind:
    """Kind of an edit; "copy" of a paste."""
    if isinstance(edit, Continuous):
        return "continuous"
    if isinstance(edit, Delete):
        return "delete"
    return "move" if isinstance(edit, Move) else "copy"


def with_kind(entry: Entry, kind: Kind) -> Entry:
    """The entry with its edit of another kind. Raises `EditError` for a paste."""
    edit = entry.edit
    if kind == kind_of(edit):
        return entry
    if isinstance(edit, Paste):
        raise EditError(f'edit "{edit.name}" is pasted, and stays a copy; remove it to take it away')
    settings, flow = edit.shell_settings, _flow(edit)
    grading = entry.spare.grading if isinstance(edit, Delete) else edit.grading
    spare = Spare(edit.operations or entry.spare.operations, flow or entry.spare.flow, grading)
    shared = edit.shared_options
    if kind == "continuous":
        outer = outer_cage_around(edit, _margin(edit)) if settings.outer is None else settings.outer
        shell = spare.flow if isinstance(settings.shell, Flow) else settings.shell
        changed: Edit = Continuous(
            edit.inner,
            outer,
            operations=spare.operations,
            shell=shell,
            lattice=settings.lattice,
            allow_folding=settings.allow_folding,
            grading=grading,
            **shared,
        )
    else:
        unused = replace(settings, shell=shell_kind(settings.shell.name))
        if kind == "delete":
            changed = Delete(edit.inner, unused_shell=unused, **shared)
        else:
            discrete = Copy if kind == "copy" else Move
            changed = discrete(
                edit.inner, operations=spare.operations, unused_shell=unused, grading=grading, **shared
            )
    return replace(entry, edit=changed, spare=spare)


def with_shell(entry: Entry, name: str) -> Entry:
    """The entry with another shell kind; only a continuous flow shell has a falloff and a width."""
    edit, settings, flow = entry.edit, entry.edit.shell_settings, _flow(entry.edit)
    if name == settings.shell.name:
        return entry
    shell = entry.spare.flow if name == "flow" and isinstance(edit, Continuous) else shell_kind(name)
    spare = entry.spare if flow is None else replace(entry.spare, flow=flow)
    return replace(entry, edit=edit.with_shell_settings(replace(settings, shell=shell)), spare=spare)


def with_outer(edit: Edit, outer: Cage) -> Edit:
    """The edit with another outer cage; a discrete edit keeps it for when it becomes continuous."""
    return edit.with_shell_settings(replace(edit.shell_settings, outer=outer))


def with_options(edit: Edit, options: Mapping[str, Any]) -> Edit:
    """The edit with options that a page names changed: falloff, width, lattice, allow_folding, grade, fields.

    Raises `EditError` for a falloff or a width of an edit without a flow shell.
    """
    fields, settings = dict(options), edit.shell_settings
    if "grade" in fields:
        fields["grading"] = Grade(**fields.pop("grade"))
    falloff = {name: fields.pop(name) for name in ("falloff", "width") if name in fields}
    shell = {name: fields.pop(name) for name in ("lattice", "allow_folding") if name in fields}
    if falloff:
        flow = replace(_flow(edit) or SMOOTH_FLOW, **falloff)
        owner = f"{settings.shell.name} shell" if isinstance(edit, Continuous) else "discrete edit"
        problem = None if _flow(edit) else problem_of_unused_falloff(flow, owner)
        if problem is not None:
            raise edit.error(problem)
        settings = replace(settings, shell=flow if _flow(edit) else settings.shell)
    edit = edit.with_shell_settings(replace(settings, **shell))
    return edit.replace(**fields)


def _flow(edit: Edit) -> Flow | None:
    """Flow shell of a continuous edit; None of any other."""
    return edit.shell if isinstance(edit, Continuous) and isinstance(edit.shell, Flow) else None


def _margin(edit: Edit) -> float:
    low, high = edit.inner.aabb
    return OUTER_CAGE_MARGIN_SHARE * float((high - low).max())
