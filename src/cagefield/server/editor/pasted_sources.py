"""Scenes and splat files that pages may paste from: those under the root and those named by edits.

In a session sources are absolute paths. In files they are relative to the scene's folder where they lie under
the root, so that both can be moved together.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from cagefield.edits import Edit, EditStack, Paste
from cagefield.edits.paste_paths import relative, resolved
from cagefield.errors import CagefieldError, SceneError
from cagefield.fields.field_files import read_field_kind
from cagefield.files.safe_open import real_path
from cagefield.scene.scene_files import FIELD, is_scene

SPLATS = (".ply", ".splat", ".ksplat", ".spz", ".sog", ".glb", ".gltf")
"""Suffixes of files of splats."""

DEEP, MOST, LOOKED_AT = 3, 200, 5000
"""Folders below the root that are looked into, sources that are listed, and entries that are looked at."""


def absolute(edits: Iterable[Edit], folder: Path) -> list[Edit]:
    """The edits with absolute sources; relative ones are relative to a folder."""
    return [e.replace(source=str(resolved(e.source, folder))) if isinstance(e, Paste) else e for e in edits]


def written(edits: Iterable[Edit], folder: Path, root: Path) -> EditStack:
    """The edits as a file in a folder has them."""
    return EditStack(
        edit.replace(source=relative(Path(edit.source), folder))
        if isinstance(edit, Paste) and Path(edit.source).is_relative_to(root)
        else edit
        for edit in edits
    )


def admitted(edit: Edit, folder: Path, root: Path) -> Edit:
    """An edit that a page brings, its source absolute. Raises SceneError for a source outside the root."""
    if not isinstance(edit, Paste):
        return edit
    return edit.replace(source=str(source_in(edit.source, folder, root)))


def source_in(source: str, folder: Path, root: Path) -> Path:
    """The absolute path of a source that a page names. Raises SceneError where it lies outside the root."""
    try:
        path = real_path(resolved(source, folder))
    except (OSError, ValueError, RuntimeError) as error:
        raise SceneError(f"{source!r:.200} is no path of a scene ({error}); choose one in the list") from None
    if not path.is_relative_to(root):
        raise SceneError(
            f"{path} lies outside {root}, where pages may read; copy it there, or start the editor with"
            " --root"
        )
    return path


def source_problem(edit: Edit) -> str | None:
    """Why the scene of an edit cannot be had, or None."""
    if not isinstance(edit, Paste) or Path(edit.source).exists():
        return None
    return f"what it pastes is gone: {edit.source}; put it back, or remove the edit"


def sources_under(root: Path, own: Iterable[Path], *, splats: bool) -> list[str]:
    """Sources for pastes into a scene of splats or of voxels: paths relative to a root, with slashes.

    Scene folders and, for splats, files of splats. The scene's `own` folders, hidden folders, and folders
    deeper than DEEP are left out.
    """
    mine, found, seen = {real_path(path) for path in own}, list[str](), 0
    for folder, folders, files in os.walk(root):
        here = Path(folder)
        depth = len(here.relative_to(root).parts)
        seen += 1 + len(files)
        if seen > LOOKED_AT or len(found) >= MOST:
            break
        scenes = [name for name in sorted(folders) if is_scene(here / name)]
        for name in scenes:
            path = here / name
            if real_path(path) not in mine and _holds(path, splats):
                found.append(path.relative_to(root).as_posix())
        if splats:
            found += [
                (here / name).relative_to(root).as_posix()
                for name in sorted(files)
                if name.lower().endswith(SPLATS) and not name.startswith(".")
            ]
        folders[:] = sorted(
            name for name in folders if not name.startswith(".") and name not in scenes and depth + 1 < DEEP
        )
    return sorted(found)[:MOST]


def _holds(scene: Path, splats: bool) -> bool:
    """Whether a scene's field is of splats, or of voxels."""
    try:
        return (read_field_kind(scene / FIELD) == "SplatField") == splats
    except CagefieldError:
        return False
