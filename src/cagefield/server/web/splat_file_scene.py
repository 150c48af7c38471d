"""Files of splats opened without an import: their scenes lie in the user's cache until Save as is used.

The cached scene has its content's digest in its name: a file that is opened again finds its autosave,
wherever it lies. Nothing is written beside the file.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from cagefield.errors import FieldError
from cagefield.files.safe_open import check_regular, open_regular
from cagefield.files.user_cache import cache_root
from cagefield.scene.scene_files import is_scene
from cagefield.server.editor.persistence import stem_of

if TYPE_CHECKING:
    from cagefield.formats.splats.splat_table import SplatSource

KEPT_DAYS = 30
"""Cached scenes that were not opened for longer are removed, but those with an autosave."""

LEFT_OUT = "left-out.txt"
"""File in the scene's folder with one line, shown on pages, that lists contents of the source file that the
scene lacks."""

_LONGEST = 100
"""Bytes of a file's name in its scene's: names have 255 at most, with the suffixes of autosaves and
drafts."""

_BLOCK = 1 << 22

_LARGE = 1 << 28
"""Bytes of a file that is opened before its digest is made."""

_MOST_OF_ONE = 1 << 14
"""Bytes of a splat, with whatever else is known of it, in a file that is _LARGE."""


def open_mask_folder() -> Path:
    """The folder of opened files' scenes in the user's cache."""
    return cache_root() / "opened"


def scene_of_file(file: Path) -> Path:
    """The scene's folder, in the cache, of a splat file or .sog's folder; read where it is not there yet.

    Raises CagefieldError for a file that holds no splats.
    """
    from cagefield.formats.splats.splat_files import open_within_memory, read_source
    from cagefield.scene.import_splats import import_splats
    from cagefield.scene.scene import Scene

    stem = stem_of(file).encode(errors="replace")[:_LONGEST].decode(errors="ignore")
    # A file beyond the memory is refused before minutes go into its digest.
    with _recorded_warnings() as lines:
        source = open_within_memory(file) if file.is_file() and check_regular(file) > _LARGE else None
    end = None if source is None else _end(source)
    folder = open_mask_folder() / f"{stem}-{_digest(file, end)}"
    if is_scene(folder):
        os.utime(folder)
    else:
        with _recorded_warnings() as more:
            found = import_splats(read_source(source or open_within_memory(file)))
        lines += more
        folder.parent.mkdir(parents=True, exist_ok=True)
        _tidy(folder.parent)
        Scene(found.field, cameras=found.cameras, background=found.background).save(
            folder, beside={LEFT_OUT: "; ".join(lines).replace(f"{file.parent}{os.sep}", "")} if lines else {}
        )
    return folder


@contextmanager
def _recorded_warnings() -> Iterator[list[str]]:
    """The lines of the context's warnings, in the list once it has ended; they are given all the same."""
    lines = list[str]()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", UserWarning)
        yield lines
    lines += [str(warning.message) for warning in said if issubclass(warning.category, UserWarning)]
    for line in lines:
        warnings.warn(line, stacklevel=4)


def _end(source: SplatSource) -> int:
    """Bytes of a file that is _LARGE up to the last that is read of it.

    Raises FieldError where it does not say, and has far more than its splats can take.
    """
    if source.end is not None:
        return source.end
    size, most = check_regular(source.path), _LARGE + _MOST_OF_ONE * source.count
    if size > most:
        raise FieldError(
            f"{source.path}: it has {size} bytes for {source.count} splats; it is damaged, copy it again"
        )
    return size


def _digest(file: Path, end: int | None) -> str:
    """A name for the content of a file, up to its byte `end`, and of those that it is read with."""
    from cagefield.formats.splats.open_splats import source_files

    content = hashlib.blake2b(digest_size=8)
    for part in source_files(file):
        last = end if part == file else None
        with open_regular(part) as stream:
            while block := stream.read(_BLOCK if last is None else min(_BLOCK, last - stream.tell())):
                content.update(block)
    return content.hexdigest()


def _tidy(folder: Path) -> None:
    """Removes scenes that nobody opened for long."""
    before = time.time() - 86400.0 * KEPT_DAYS
    for scene in folder.iterdir():
        kept = folder / f".{scene.name}.cagefield-autosave.json"
        if scene.is_dir() and scene.stat().st_mtime < before and not kept.exists() and is_scene(scene):
            shutil.rmtree(scene, ignore_errors=True)
