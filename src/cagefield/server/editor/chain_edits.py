"""Parents of edits in the editor: chosen, followed through renames and removals; carried cages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cagefield.edits import Edit, EditStack
from cagefield.edits.chains import ancestors, parent_numbers
from cagefield.errors import EditError
from cagefield.server.editor.document import Document, Entry
from cagefield.typing import Array

MAX_CARRIER_CONDITION = 1e4
"""Condition of a carrier from which its inverse, which drags go through, is no use."""


def with_parent(document: Document, number: int, parent: int | None) -> Entry:
    """The entry of an edit carried by the edit of number `parent`; by none for None.

    Raises `EditError` for a parent without a name of its own, a paste, and parents in a circle.
    """
    entry = document.entry(number)
    name = "" if parent is None else document.entry(parent).edit.name
    if parent is not None and not name:
        raise entry.edit.error("its parent has no name; double-click it in the list to name it")
    changed = replace(entry, edit=entry.edit.replace(parent=name))
    parent_numbers([each.edit for each in document.put(changed).entries])
    return changed


def renamed(document: Document, before: Entry, after: Entry) -> Document:
    """The document with an entry replaced; where that renames the edit, its children name it anew.

    Raises `EditError` where an edit with children would lose its name.
    """
    old, new = before.edit.name, after.edit.name
    carried = children(document, before) if old != new else ()
    if carried and not new:
        raise after.edit.error(f'"{old}" carries other edits, which name it; give it another name')
    document = document.put(after)
    for child in carried:
        document = document.put(replace(child, edit=child.edit.replace(parent=new)))
    return document


def without(document: Document, number: int) -> Document:
    """The document without an edit; the edit's children go to its own parent, if it has one."""
    entry = document.entry(number)
    for child in children(document, entry):
        document = document.put(replace(child, edit=child.edit.replace(parent=entry.edit.parent)))
    return document.without(number)


def children(document: Document, parent: Entry) -> tuple[Entry, ...]:
    """The entries that an entry's edit carries."""
    name = parent.edit.name
    return tuple(entry for entry in document.entries if name and entry.edit.parent == name)


def descendants(document: Document, parent: Entry) -> tuple[Entry, ...]:
    """The entries that an entry's edit carries, and those that they carry, and so on."""
    found = [parent]
    for entry in found:
        found += children(document, entry)
    return tuple(found[1:])


def with_own_names(edits: Sequence[Edit], document: Document) -> tuple[Edit, ...]:
    """Edits that join a document, chains among them under names that no edit of the document has.

    Names stay where neither an edit of the document nor one of `edits` goes by them as a parent.
    """
    taken = {entry.edit.name for entry in document.entries}
    parents = {entry.edit.parent for entry in document.entries} | {edit.parent for edit in edits}
    used = taken | {edit.name for edit in edits}
    anew: dict[str, str] = {}
    for edit in edits:
        if edit.name in taken & parents - {""} and edit.name not in anew:
            number = 2
            while f"{edit.name} {number}" in used:
                number += 1
            anew[edit.name] = f"{edit.name} {number}"
            used.add(anew[edit.name])
    if not anew:
        return tuple(edits)
    return tuple(
        edit.replace(name=anew.get(edit.name, edit.name), parent=anew.get(edit.parent, edit.parent))
        for edit in edits
    )


class Carriers:
    """Affine maps [3,4] by which parents carry cages, remembered while the edits are the same."""

    def __init__(
        self, problem: Callable[[Edit], str | None], resolved: Callable[[Edit], Edit] = lambda edit: edit
    ) -> None:
        """`problem` says why an edit is not shown, or None; `resolved` gives it its detours, where known."""
        self._problem, self._resolved = problem, resolved
        self._known: dict[int, tuple[tuple[Edit, ...], Array | None]] = {}

    def carrier(self, document: Document, entry: Entry) -> Array | None:
        """The affine map of a child's cages at rest to where its parents carry them; None without any.

        The least-squares fit to the carried corners of the inner cage, before and after its operations:
        exact where one affine map carries all of them.
        """
        if not entry.edit.parent:
            return None
        edits = [each.edit for each in document.entries]
        chain = tuple(edits[n] for n in ancestors(edits, document.place(entry.id)))
        shown = tuple(
            self._resolved(edit.without_parent)
            for edit in chain
            if edit.enabled and edit.changes_anything and self._problem(edit) is None
        )
        key = (entry.edit, *chain, *shown)
        known = self._known.get(entry.id)
        if known is not None and len(known[0]) == len(key) and all(map(_is, known[0], key)):
            return known[1]
        carrier = _carrier(entry.edit, shown)
        self._known[entry.id] = key, carrier
        return carrier


def _is(one: Edit, other: Edit) -> bool:
    return one is other


def _carrier(child: Edit, parents: Sequence[Edit]) -> Array | None:
    if not parents:
        return None
    points = np.concatenate([child.inner.corners, child.deformed.corners])
    try:
        there = EditStack(parents).to_deformed(points)
    except EditError:
        return None
    kept = ~there.hidden
    if kept.sum() < 4 or np.allclose(there.points, points, rtol=0.0, atol=1e-12):
        return None
    ones = np.ones((int(kept.sum()), 1))
    solution, _, rank, _ = np.linalg.lstsq(np.hstack([points[kept], ones]), there.points[kept], rcond=None)
    carrier = np.asarray(solution.T)
    linear = carrier[:, :3]
    if rank < 4 or np.linalg.det(linear) <= 0.0 or np.linalg.cond(linear) > MAX_CARRIER_CONDITION:
        return None
    return carrier
