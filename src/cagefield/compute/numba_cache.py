"""Numba's compiler as the kernels use it: its options, and where compiled kernels are kept.

Numba sees that a kernel on the disk is stale by the source of its own module alone, although functions and
constants of other modules are compiled into it. So kernels are kept in folders that are named by a digest of
their module and of all modules of this package that it imports.
"""

from __future__ import annotations

import ast
import functools
import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba

from cagefield.compute.kernel_cache import cache_folder, warn_cache_unusable

FAST: dict[str, Any] = {"fastmath": True, "error_model": "numpy", "cache": True}
"""Options of every kernel: without `error_model`, checks for division by zero keep loops from vectorising."""

_PACKAGE = Path(__file__).parents[1]
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
            folder = _folder_of(function.__code__.co_filename)
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


@functools.cache
def _folder_of(file: str) -> Path | None:
    """Where the kernels of a module are kept."""
    try:
        sources = {path: path.read_bytes() for path in _with_imports(Path(file))}
    except (OSError, SyntaxError):
        return None
    digest = hashlib.sha256()
    for path in sorted(sources):
        digest.update(sources[path])
    return cache_folder(f"numba-{digest.hexdigest()[:16]}")


def _with_imports(file: Path) -> set[Path]:
    """A module's file, and those of this package that it imports, and that these import."""
    found, waiting = {file}, [file]
    while waiting:
        new = set(_imports(waiting.pop())) - found
        found |= new
        waiting.extend(new)
    return found


def _imports(file: Path) -> Iterator[Path]:
    """The files of this package's modules that a module imports from."""
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == _PACKAGE.name:
            for name in (str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)):
                path = _PACKAGE.parent.joinpath(*name.split(".")).with_suffix(".py")
                if path.is_file():
                    yield path
