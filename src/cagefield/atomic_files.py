"""Files and folders that appear whole or not at all."""

from __future__ import annotations

import errno
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

    The folder is made where it is missing and `parents` is True. An OSError about the temporary file, or
    about none (a full disk), names `path`.
    """
    if parents:
        path.parent.mkdir(parents=True, exist_ok=True)
    with _naming(path, path.parent):
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        with _naming(path, temporary):
            yield temporary
            umask = os.umask(0)
            os.umask(umask)
            temporary.chmod(0o666 & ~umask)
            temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def _naming(path: Path, hidden: Path) -> Iterator[None]:
    """An OSError that names nothing, or `hidden` or what lies in it, names `path` instead."""
    try:
        yield
    except OSError as error:
        name = error.filename
        if name is None or (isinstance(name, (str, Path)) and Path(name).is_relative_to(hidden)):
            error.filename, error.filename2 = str(path), None
            if error.errno is None:  # pillow's, which has words alone
                error.errno, error.strerror = errno.EIO, str(error.args[0]) if error.args else "failed"
        raise


@contextmanager
def merged_folder(target: Path) -> Iterator[Path]:
    """A folder to be filled with files that come into `target` together.

    Where `target` holds something already, that is a hidden folder in it: on success its files take their
    places, on failure they are removed, and `target` is what it was. Else it is `target` itself, not
    made yet or empty, and what has been written stays.
    """
    if not target.exists() or not any(target.iterdir()):
        yield target
        return
    with _naming(target, target):
        draft = Path(tempfile.mkdtemp(prefix=".new-", dir=target))
    try:
        with _naming(target, draft):
            yield draft
            for entry in sorted(draft.iterdir()):
                entry.replace(target / entry.name)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


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
