"""Files and folders that appear whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
import uuid
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replaced_file(path: Path, *, parents: bool = True) -> Iterator[Path]:
    """A temporary file beside `path`, same suffix: becomes `path` on success, is removed on failure.

    The folder is made where it is missing and `parents` is True.
    """
    if parents:
        path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def replaced_folder(target: Path, own: Collection[str]) -> Iterator[Path]:
    """An empty folder beside `target` to be filled: takes its place on success, is removed on failure.

    What `target` held under the names in `own` goes once the new folder is in place; other entries move over
    to it. After a failure `target` is what it was.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    draft, retired = (
        target.with_name(f".{target.name}.{role}-{uuid.uuid4().hex[:8]}") for role in ("new", "old")
    )
    draft.mkdir()
    try:
        yield draft
        if target.exists():
            target.rename(retired)
        draft.rename(target)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        if retired.exists() and not target.exists():
            retired.rename(target)
        raise
    if retired.exists():
        for entry in retired.iterdir():
            if entry.name not in own:
                entry.rename(target / entry.name)
        shutil.rmtree(retired, ignore_errors=True)
