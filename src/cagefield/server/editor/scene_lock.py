"""A scene is edited by one program at a time: two would keep one autosave, of one alone.

The lock is a hidden file beside the scene that the system locks for a process: it is free when that ends,
however it ends.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from cagefield.errors import SceneError

try:
    import fcntl
except ImportError:  # no such locks here
    fcntl = None  # type: ignore[assignment]

_held: dict[Path, tuple[int, int]] = {}
"""Of this process: lock file -> (its handle, how many hold it)."""


class SceneLock:
    """Holds the lock of a scene's folder until it is released, or the process ends.

    Held as often as a process wants. Where there can be no file beside the scene there is no lock.
    """

    def __init__(self, scene: Path) -> None:
        """Raises SceneError where another process holds it."""
        self._file: Path | None = scene.with_name(f".{scene.name}.cagefield-lock")
        handle, count = _held.get(self._file, (-1, 0))
        if count == 0:
            handle = _locked(self._file, scene)
        if handle < 0:
            self._file = None
        else:
            _held[self._file] = handle, count + 1

    def release(self) -> None:
        """Lets others edit the scene; once is enough."""
        file, self._file = self._file, None
        if file is None:
            return
        handle, count = _held.pop(file)
        if count > 1:
            _held[file] = handle, count - 1
            return
        with contextlib.suppress(OSError):
            file.unlink()  # while it is locked: nobody else has it
        os.close(handle)


def _locked(file: Path, scene: Path) -> int:
    """The handle of the locked file; -1 where there are no locks."""
    if fcntl is None:
        return -1
    while True:
        try:
            handle = os.open(file, os.O_RDWR | os.O_CREAT, 0o600)
        except OSError:
            return -1
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            said = os.read(handle, 20).strip()
            owner = said.decode("ascii") if said.isdigit() else ""
            os.close(handle)
            raise SceneError(
                f"{scene} is open in another editor{f' (process {owner})' if owner else ''}; use its page, "
                "or end it first"
            ) from None
        except OSError:  # a file system without locks
            os.close(handle)
            return -1
        with contextlib.suppress(OSError):
            if os.path.samestat(os.fstat(handle), os.stat(file)):
                os.ftruncate(handle, 0)
                os.write(handle, b"%d" % os.getpid())
                return handle
        os.close(handle)  # its holder has removed it meanwhile
