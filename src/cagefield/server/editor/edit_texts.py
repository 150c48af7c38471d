"""Edits of texts that pages send, with what is slow to find out about many of them; needs no session."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from cagefield.cameras.keyframe_files import is_path
from cagefield.edits import Edit, EditStack, dump_edits, parse_edits
from cagefield.errors import CameraError
from cagefield.server.editor.validity import problem


@dataclass(frozen=True)
class ReadEdits:
    """Edits, why each cannot be shown (or None), and what an edit file has of each."""

    edits: tuple[Edit, ...]
    problems: tuple[str | None, ...]
    values: tuple[object, ...]


def edits_in(text: str, admitted: Callable[[Edit], Edit] = lambda edit: edit) -> tuple[Edit, ...]:
    """The edits of a text, YAML or JSON.

    `admitted` gives each the form that it has here, and raises where a page may not bring it. Raises
    EditFileError for a text that holds no edits, CameraError for a camera path's.
    """
    if is_path(text):
        raise CameraError(
            "this is a camera path, and no edits; save it as camera_path.json in the scene's folder, "
            "then start the editor again"
        )
    form = "json" if text.lstrip().startswith("{") else "yaml"
    return tuple(admitted(e) for e in parse_edits(text, format=form, source="the text", check=False))


def read_edits(text: str, admitted: Callable[[Edit], Edit]) -> ReadEdits:
    """The same with all that is asked of them next: milliseconds for each edit."""
    edits = edits_in(text, admitted)
    problems = (problem(edit) if edit.changes_anything else None for edit in edits)
    return ReadEdits(edits, tuple(problems), tuple(file_values(edits)))


def file_values(edits: Sequence[Edit]) -> list[object]:
    """What an edit file in JSON has of each edit."""
    values: list[object] = json.loads(dump_edits(EditStack(edits), format="json"))["edits"]
    return values
