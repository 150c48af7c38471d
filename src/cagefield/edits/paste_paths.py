"""Where pastes come from: the path of another scene, as an edit names it.

In an edit file it is relative to the folder of that file, in a scene to the scene's own folder, or absolute.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from cagefield.edits.edit import Edit, Paste
from cagefield.files.safe_open import real_path


def resolved(source: str, folder: Path | None) -> Path:
    """The absolute path of a source, of a scene in `folder`; None is the working directory."""
    return Path(os.path.abspath((folder or Path()) / Path(source)))


def rebased(edits: Iterable[Edit], before: Path | None, after: Path) -> list[Edit]:
    """The edits with relative sources rewritten from the folder `before` to the folder `after`."""
    if before is not None and real_path(before) == real_path(after):
        return list(edits)
    return [
        edit.replace(source=relative(resolved(edit.source, before), after))
        if isinstance(edit, Paste) and not Path(edit.source).is_absolute()
        else edit
        for edit in edits
    ]


def relative(path: Path, folder: Path) -> str:
    """A path as seen from a folder, with slashes; absolute where it lies on another drive."""
    try:
        return Path(os.path.relpath(path, real_path(folder))).as_posix()
    except ValueError:
        return str(path)
