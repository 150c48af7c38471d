"""Temporary folders, removed with their owner, or by the next program after a kill.

A name is cagefield-ROLE-HOST-PROCESS-RANDOM, in the system's folder for temporary files, which
other users can write. Only a folder, no link, of this user is removed, whose process has ended and whose lock
is free.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import tempfile
from pathlib import Path
from types import TracebackType

from cagefield.files.stale_files import host, is_alive

try:
    import fcntl
except ImportError:  # no such locks here
    fcntl = None  # type: ignore[assignment]

_ROLES = ("copy", "export", "open", "splats", "fit", "points", "bench", "cluster")

_MARK = re.compile(rf"cagefield-({'|'.join(_ROLES)})-([0-9a-f]{{6}})-(\d+)-\w+")


class TemporaryFolder:
    """An empty folder that is this user's alone, until `close`, or the process's end and the next program."""

    def __init__(self, role: str, *, tidy: bool = True) -> None:
        """`role` is one of `_ROLES`. Unless `tidy`, others' folders are left, of which each may be gigabytes.

        Raises OSError where there can be no such folder.
        """
        assert role in _ROLES, role
        if tidy:
            remove_abandoned()
        self.path = Path(tempfile.mkdtemp(prefix=f"cagefield-{role}-{host()}-{os.getpid()}-"))
        self._lock = _locked(self.path)

    def close(self) -> None:
        """Remove the folder and its contents; repeated calls do nothing."""
        shutil.rmtree(self.path, ignore_errors=True)
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def __enter__(self) -> Path:
        return self.path

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def remove_abandoned() -> None:
    """Removes the folders of programs that were killed; nothing where the system has no locks."""
    if fcntl is None:
        return
    with contextlib.suppress(OSError):
        for path in Path(tempfile.gettempdir()).glob("cagefield-*"):
            made = _MARK.fullmatch(path.name)
            if made is not None and made[2] == host() and not is_alive(int(made[3])):
                _remove(path)


def _remove(path: Path) -> None:
    """Removes a folder of this user's that nobody holds."""
    handle = _opened(path)
    try:
        if handle >= 0 and os.fstat(handle).st_uid == os.geteuid():
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(path, ignore_errors=True)
    except OSError:  # somebody holds it, or it cannot be locked
        pass
    finally:
        if handle >= 0:
            os.close(handle)


def _locked(folder: Path) -> int:
    """The handle of a folder that this process holds; -1 where there are no locks."""
    if fcntl is None:
        return -1
    handle = _opened(folder)
    if handle >= 0:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return handle


def _opened(folder: Path) -> int:
    """The handle of a folder, no link; -1 for anything else."""
    try:
        return os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return -1
