"""Disk caches of compiled kernels, of Quadrants and of Numba.

Where a cache cannot be used, or fails later, a warning says so, and every process compiles its own kernels.
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

from cagefield.files.user_cache import MAX_UNUSED_SECONDS, cache_root, source_digest

MAX_LOCK_SECONDS = 60.0
"""Age of a lock file that counts as abandoned: writing a few megabytes takes less."""

LOCK_WAIT_SECONDS = 1.0
"""Longest wait for a lock; without the lock Quadrants neither reads nor writes its cache."""

MIN_FREE_BYTES = 16 << 20
"""Free disk space below which kernels are not cached; all kernels take less than 10 megabytes."""


def kernel_cache() -> Path | None:
    """Cache folder of Quadrants for the present source of the package; None, with a warning, if unusable.

    Quadrants finds a kernel again by the source of its functions, without the constants that they name: two
    states of the packages that hold kernels must not share a folder. Folders unused for MAX_UNUSED_SECONDS
    are removed.
    """
    # Quadrants ends the process where it cannot make this folder in its own.
    folder = cache_folder(
        source_digest(b"cagefield.compute.quadrants import qd"), "kernel_compilation_manager"
    )
    if folder is None:
        return None
    lock = folder / "kernel_compilation_manager" / "qdcache.lock"
    with contextlib.suppress(OSError):
        if time.time() - lock.stat().st_mtime > MAX_LOCK_SECONDS:
            lock.unlink()
    if _is_held(lock):
        warnings.warn(
            f"another process holds {lock}, so this one compiles its own kernels; "
            "remove that file if no other cagefield runs",
            stacklevel=3,
        )
        return None
    return folder


@functools.cache
def numba_kernel_folder() -> Path | None:
    """Cache folder of all Numba kernels for the present source; None, with a warning, if unusable."""
    return cache_folder(f"numba-{source_digest(b'cagefield.compute.numba_cache import', parents=True)}")


def cache_folder(name: str, within: str = "") -> Path | None:
    """Cache folder `name` of compiled kernels, created with its subfolder `within`; None, with a warning, if
    unusable.

    Sibling folders unused for MAX_UNUSED_SECONDS are removed.
    """
    place: str | Path = "~/.cache/cagefield/kernels"
    try:
        place = cache_root() / "kernels"
        # Quadrants writes at the end of the process, when a symbolic link may be gone.
        folder = place.resolve() / name
        (folder / within).mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        if not all(map(_is_usable, (folder, *folder.rglob("*")))):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except (OSError, RuntimeError) as error:
        warn_cache_unusable(place, error)
        return None
    _tidy(folder)
    return folder


def tolerate_cache_failures(folder: Path) -> None:
    """Make Quadrants survive a cache folder that can no longer be written, also at the end of the process."""
    from quadrants.lang import impl
    from quadrants.lang._fast_caching.python_side_cache import PythonSideCache

    told: list[OSError] = []

    def keep_none() -> None:
        impl.current_cfg().offline_cache = False

    def look_for_room() -> None:
        with contextlib.suppress(OSError):
            if shutil.disk_usage(folder).free >= MIN_FREE_BYTES:
                return
        keep_none()

    def forgiven(method: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(method)
        def quiet(cache: Any, *args: Any) -> Any:
            try:
                return method(cache, *args)
            except OSError as error:
                if not told:
                    warn_cache_unusable(Path(cache.cache_folder).parent, error)
                    keep_none()
                told.append(error)
                return None

        return quiet

    own_store = PythonSideCache.store

    def store(cache: Any, key: str, value: str) -> None:
        # The compiled kernel follows after this note of it, and says nothing where there is no room for it.
        if shutil.disk_usage(cache.cache_folder).free < MIN_FREE_BYTES:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        own_store(cache, key, value)

    PythonSideCache.store = store
    for name in ("__init__", "store", "try_load"):
        setattr(PythonSideCache, name, forgiven(getattr(PythonSideCache, name)))
    # As a process ends, Quadrants writes what it compiled for CUDA, and aborts where it cannot.
    atexit.register(look_for_room)


def _is_usable(part: Path) -> bool:
    """True where a folder or file of the cache can be read and written, or no longer exists."""
    return os.access(part, os.R_OK | os.W_OK | (os.X_OK if part.is_dir() else 0)) or not part.exists()


def warn_cache_unusable(place: str | Path, error: Exception) -> None:
    """Warn that kernels cannot be cached in a folder."""
    reason = getattr(error, "strerror", None) or error
    warnings.warn(
        f"compiled kernels cannot be kept in {place} ({reason}), so every process compiles its own; "
        "make room there, or set XDG_CACHE_HOME to a folder that can be written",
        stacklevel=3,
    )


def _tidy(folder: Path) -> None:
    """Remove sibling cache folders unused for MAX_UNUSED_SECONDS."""
    with contextlib.suppress(OSError):
        for other in list(folder.parent.iterdir()):
            with contextlib.suppress(OSError):
                if time.time() - other.stat().st_mtime > MAX_UNUSED_SECONDS:
                    shutil.rmtree(other, ignore_errors=True)


def _is_held(lock: Path) -> bool:
    """True where a lock file outlasts LOCK_WAIT_SECONDS."""
    ends = time.monotonic() + LOCK_WAIT_SECONDS
    while lock.exists():
        if time.monotonic() > ends:
            return True
        time.sleep(0.02)
    return False
