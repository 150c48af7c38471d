"""Parsing of edit texts from pages, with the slow checks of many edits done outside of the session."""

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
    """Parsed edits, the problem of each (or None), and the edit-file value of each."""

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
    """Parsed and checked edits of a text; milliseconds for each edit."""
    edits = edits_in(text, admitted)
    problems = (problem(edit) if edit.changes_anything else None for edit in edits)
    return ReadEdits(edits, tuple(problems), tuple(file_values(edits)))


def file_values(edits: Sequence[Edit]) -> list[object]:
    """Values of edits in a JSON edit file, one per edit."""
    values: list[object] = json.loads(dump_edits(EditStack(edits), format="json"))["edits"]
    return values
