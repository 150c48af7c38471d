"""The edits of a document as they are on the way along its camera path: in its video, and in the preview."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from cagefield.edits import Edit
from cagefield.edits.partial_edit import partial_edit
from cagefield.errors import CagefieldError
from cagefield.server.editor.document import Document
from cagefield.server.editor.validity import problem


def edits_at_time(
    document: Document,
    parts: Mapping[int, float],
    known_problem: Callable[[Edit], str | None] = problem,
) -> tuple[Edit, ...]:
    """The edits that are shown, in the order of application, each gone through to its part.

    A deletion is there from one half on.

    `known_problem` says why a whole edit cannot be shown, as `problem` does.

    Raises CagefieldError where an edit is possible as a whole, but not there.
    """
    found = []
    for entry in document.applied:
        part = parts.get(entry.id, 1.0)
        edit = entry.edit
        if not edit.enabled or known_problem(edit) is not None:
            continue
        edit = edit.without_parent
        there = partial_edit(edit, part)
        if there is None:
            continue
        if there is not edit:
            edit = there
            why = problem(edit)
            if why is not None:
                raise CagefieldError(f'edit "{edit.name}" is not possible at {part:.0%}: {why}')
        if edit.changes_anything:
            found.append(edit)
    return tuple(found)
