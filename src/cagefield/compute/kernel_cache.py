"""The folders in which compiled kernels are kept: those of Quadrants, and those of Numba.

Where one cannot be used, or fails in the middle, a warning says so, and every process compiles its own.
"""

from __future__ import annotations

import atexit
import contextlib
import errno
import functools
import os
import shutil
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cagefield.files.user_cache import KEPT_SECONDS, cache_root, source_digest

LOCKED_SECONDS = 60.0
"""How long a process may hold the lock of a folder of kernels: it writes a few megabytes."""

PATIENCE = 1.0
"""Seconds that a lock is waited for: without it Quadrants neither reads the folder nor writes to it."""

LEAST_BYTES = 16 << 20
"""Room that is needed to keep kernels: all of them take less than 10 megabytes."""


def kernel_cache() -> Path | None:
    """The folder of the compiled kernels of this state of the package's source; None, with a warning, where
    none can be used.

    Quadrants finds a kernel again by the source of its functions, without the constants that they name: two
    states of the packages that hold kernels must not share a folder. Folders that nobody used for long are
    removed.
    """
    # Quadrants ends the process where it cannot make this folder in its own.
    folder = cache_folder(
        source_digest(b"cagefield.compute.quadrants import qd"), "kernel_compilation_manager"
    )
    if folder is None:
        return None
    lock = folder / "kernel_compilation_manager" / "qdcache.lock"
    with contextlib.suppress(OSError):
        if time.time() - lock.stat().st_mtime > LOCKED_SECONDS:
            lock.unlink()
    if _is_held(lock):
        warnings.warn(
            f"another process holds {lock}, so this one compiles its own kernels; "
            "remove that file if no other cagefield runs",
            stacklevel=3,
        )
        return None
    return folder


def cache_folder(name: str, within: str = "") -> Path | None:
    """The folder `name` of compiled kernels, made where it is missing, with the folder `within` in it.

    None, with a warning, where it cannot be used. Folders beside it that nobody used for long are removed.
    """
    place: str | Path = "~/.cache/cagefield/kernels"
    try:
        place = cache_root() / "kernels"
        folder = place / name
        (folder / within).mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        if not all(map(_is_usable, (folder, *folder.rglob("*")))):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except (OSError, RuntimeError) as error:
        tell_that_none_are_kept(place, error)
        return None
    _tidy(folder)
    return folder


def forgive(folder: Path) -> None:
    """Has Quadrants go on where its folder can no longer be written while kernels are compiled, or when the
    process ends."""
    from quadrants.lang import impl
    from quadrants.lang._fast_caching.python_side_cache import PythonSideCache

    told: list[OSError] = []

    def keep_none() -> None:
        impl.current_cfg().offline_cache = False

    def look_for_room() -> None:
        with contextlib.suppress(OSError):
            if shutil.disk_usage(folder).free >= LEAST_BYTES:
                return
        keep_none()

    def forgiven(method: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(method)
        def quiet(cache: Any, *args: Any) -> Any:
            try:
                return method(cache, *args)
            except OSError as error:
                if not told:
                    tell_that_none_are_kept(Path(cache.cache_folder).parent, error)
                    keep_none()
                told.append(error)
                return None

        return quiet

    own_store = PythonSideCache.store

    def store(cache: Any, key: str, value: str) -> None:
        # The compiled kernel follows after this note of it, and says nothing where there is no room for it.
        if shutil.disk_usage(cache.cache_folder).free < LEAST_BYTES:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        own_store(cache, key, value)

    PythonSideCache.store = store
    for name in ("__init__", "store", "try_load"):
        setattr(PythonSideCache, name, forgiven(getattr(PythonSideCache, name)))
    # As a process ends, Quadrants writes what it compiled for CUDA, and aborts where it cannot.
    atexit.register(look_for_room)


def _is_usable(part: Path) -> bool:
    """Whether a folder or file of the cache can be read and written, or has just gone."""
    return os.access(part, os.R_OK | os.W_OK | (os.X_OK if part.is_dir() else 0)) or not part.exists()


def tell_that_none_are_kept(place: str | Path, error: Exception) -> None:
    """Warns that kernels are not kept in a folder."""
    reason = getattr(error, "strerror", None) or error
    warnings.warn(
        f"compiled kernels cannot be kept in {place} ({reason}), so every process compiles its own; "
        "make room there, or set XDG_CACHE_HOME to a folder that can be written",
        stacklevel=3,
    )


def _tidy(folder: Path) -> None:
    """Removes the folders beside one of kernels that nobody needs."""
    with contextlib.suppress(OSError):
        for other in list(folder.parent.iterdir()):
            with contextlib.suppress(OSError):
                if time.time() - other.stat().st_mtime > KEPT_SECONDS:
                    shutil.rmtree(other, ignore_errors=True)


def _is_held(lock: Path) -> bool:
    """Whether somebody holds a lock for longer than PATIENCE."""
    ends = time.monotonic() + PATIENCE
    while lock.exists():
        if time.monotonic() > ends:
            return True
        time.sleep(0.02)
    return False
