"""Numba's compiler as the kernels use it: its options, and where compiled kernels are kept.

Numba sees that a kernel on the disk is stale by the source of its own module alone, although functions and
constants of other modules are compiled into the kernel. So the cache folder has the name of a digest of all
packages with Numba kernels, and of the packages above them, from which kernels take constants; the time of
a module's file, which each installation changes, does not count.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

from cagefield.compute.kernel_cache import numba_kernel_folder, warn_cache_unusable

FAST: dict[str, Any] = {"fastmath": True, "error_model": "numpy", "cache": True}
"""Options of every kernel: without `error_model`, checks for division by zero keep loops from vectorizing."""

_TOLD: list[Exception] = []


def njit(*, cache: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit`; with `cache`, kernels are kept among those of Quadrants (see
    `cagefield.compute.kernel_cache`).

    Where they cannot be kept, a warning says so, and every process compiles its own.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**options)(function)
        # With NUMBA_DISABLE_JIT there is nothing to keep; inlined functions are compiled with their callers.
        if cache and "inline" not in options and hasattr(kernel, "enable_caching"):
            folder = numba_kernel_folder()
            if folder is not None:
                _keep(kernel, folder)
        return kernel

    return decorate


def _keep(kernel: Any, folder: Path) -> None:
    """Has a kernel kept in a folder, and go on where that fails."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        kernel.enable_caching()
    except (OSError, RuntimeError) as error:
        _tell(folder, error)
        return
    finally:
        numba.config.CACHE_DIR = before
    # The folder's name has a digest of the source: a new installation of the same source loads its kernels.
    kernel._cache._cache_file._source_stamp = folder.name
    for name in ("load_overload", "save_overload"):
        setattr(kernel._cache, name, _forgiven(getattr(kernel._cache, name), folder))


def _forgiven(method: Callable[..., Any], folder: Path) -> Callable[..., Any]:
    """The method of Numba's cache, None and a warning where it fails."""

    @functools.wraps(method)
    def forgiving(*args: Any) -> Any:
        try:
            return method(*args)
        except Exception as error:  # a damaged file is pickle's, and raises whatever it says
            _tell(folder, error)
            return None

    return forgiving


def _tell(folder: Path, error: Exception) -> None:
    """Warns for the first kernel that is not kept."""
    if not _TOLD:
        warn_cache_unusable(folder.parent, error)
    _TOLD.append(error)
