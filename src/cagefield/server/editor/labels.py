"""Labels of edits and of history entries in the editor's lists."""

from __future__ import annotations

from cagefield.edits.edit_names import MAX_NAME_CHARACTERS
from cagefield.edits.operations import Operation
from cagefield.server.editor.document import Document, Entry
from cagefield.server.editor.drag_solver import Target

_TARGETS: dict[Target, str] = {"field": "", "inner": " inner cage", "outer": " outer cage", "both": " cages"}
_OPTIONS = {"relight": "shadows", "grade": "color"}
_WORDS = {"translation": "Move", "rotation": "Rotate", "scaling": "Scale", "shear": "Shear"}


def edit_label(operation: Operation, target: Target, entry: Entry) -> str:
    """An operation as the history lists it."""
    return f"{_WORDS.get(operation.noun, operation.noun.capitalize())}{_TARGETS[target]}{suffix_for(entry)}"


def option_word(name: str) -> str:
    """An option of edits, named as in `Edit`, as the history lists it."""
    return _OPTIONS.get(name, name)


def suffix_for(entry: Entry) -> str:
    """ " of NAME", or of the edit's number where it has no name."""
    return f" of {entry.edit.name}" if entry.edit.name else f" of edit {entry.id}"


def fresh_name(document: Document, stem: str) -> str:
    """A name that no edit has: the stem, or it with the lowest free number from 2 ("edit": from 1)."""
    taken = {entry.edit.name for entry in document.entries}
    head, _, tail = stem.rpartition(" ")
    stem = head if head and tail.isdigit() else stem
    if stem not in taken and stem != "edit":
        return stem
    number = 1 if stem == "edit" else 2
    stem = stem[: MAX_NAME_CHARACTERS - 8]
    while f"{stem} {number}" in taken:
        number += 1
    return f"{stem} {number}"
