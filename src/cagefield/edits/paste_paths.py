"""Where pastes come from: the path of another scene, as an edit names it.

In an edit file it is relative to the folder of that file, in a scene to the scene's own folder, or absolute.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Protocol, TypeVar

from cagefield.edits.edit_names import problem_of_text
from cagefield.files.safe_open import real_path


class Sourced(Protocol):
    """What is asked of an edit."""

    @property
    def source(self) -> str | None: ...

    def replace(self, **changes: Any) -> Any: ...


AnyEdit = TypeVar("AnyEdit", bound=Sourced)

MOST_CHARACTERS = 4096
"""Length of a path; as Linux has it."""


def problem_of_source(source: object, *, is_copy: bool) -> str | None:
    """Why an edit cannot have a source, and the cure; None where it can, or has none."""
    if source is None:
        return None
    if not isinstance(source, str) or not source.strip():
        return f"source must be the path of a scene folder or a file of splats, got {source!r:.60}"
    if len(source) > MOST_CHARACTERS:
        return f"source has {len(source)} characters, a path has at most {MOST_CHARACTERS}"
    problem = problem_of_text(source)
    if problem is not None:
        return f"source {problem}"
    if not is_copy:
        return (
            "source is for copies: a paste is discrete and keeps its source; leave out adjustment,"
            " keep_source and delete, or use Edit.paste"
        )
    return None


def resolved(source: str, folder: Path | None) -> Path:
    """The absolute path of a source, of a scene in `folder`; None is the working directory."""
    return Path(os.path.abspath((folder or Path()) / Path(source)))


def rebased(edits: Iterable[AnyEdit], before: Path | None, after: Path) -> list[AnyEdit]:
    """The edits with relative sources that mean in the folder `after` what they mean in `before`."""
    if before is not None and real_path(before) == real_path(after):
        return list(edits)
    return [
        edit
        if edit.source is None or Path(edit.source).is_absolute()
        else edit.replace(source=relative(resolved(edit.source, before), after))
        for edit in edits
    ]


def relative(path: Path, folder: Path) -> str:
    """A path as seen from a folder, with slashes; absolute where it lies on another drive."""
    try:
        return Path(os.path.relpath(path, real_path(folder))).as_posix()
    except ValueError:
        return str(path)
