"""Import of Quadrants without PyTorch, which Quadrants would load where it is installed.

PyTorch costs every process over a second and 150 megabytes, for tensors that only networks hand to kernels.
A PyTorch that is already loaded stays in use, and one loaded later can be used: see `take_tensors`.

Quadrants 1.3 keeps the arguments of launches by the identity of the objects that were passed, as long as the
arrays in them live. A new frozen dataclass at the address of one that is gone would launch with the fields of
the old one, another camera or photo; so no launch is kept.

For each kernel that is defined, Quadrants looks through all loaded modules for a class around it, which takes
a third of the time that kernel modules take to import. No kernel here is a method.

CUDA frees memory only in threads that have its context, and ends the program in others. Python collects
garbage in whichever thread asks for memory; so an array that is collected elsewhere waits until the thread
that made the first one makes or frees another.
"""

from __future__ import annotations

import sys
import threading
from typing import Any, cast

_HIDDEN = "torch" not in sys.modules
if _HIDDEN:
    # A name without a module cannot be imported.
    sys.modules["torch"] = cast(Any, None)
try:
    import quadrants as qd
    from quadrants.lang import impl, kernel_impl
    from quadrants.lang._fast_caching import args_hasher
    from quadrants.lang._ndarray import Ndarray
    from quadrants.lang.kernel import LaunchContextBufferCache
finally:
    if _HIDDEN:
        del sys.modules["torch"]

__all__ = ["qd", "take_tensors"]


def _keep_no_launch(*_: object) -> None:
    """Stands for `LaunchContextBufferCache.cache`; see above."""


LaunchContextBufferCache.cache = _keep_no_launch  # type: ignore[method-assign, unused-ignore]


def _is_no_method(level_of_class_stackframe: int) -> bool:
    """Stands for `kernel_impl._inside_class`; see above."""
    return False


kernel_impl._inside_class = _is_no_method

_owner: int | None = None
"""Thread that made the first device array."""
_collected: list[tuple[Any, Any]] = []
"""Runtimes and arrays that other threads collected."""
_construct = Ndarray.__init__


def _own(array: Any) -> None:
    """Stands for `Ndarray.__init__`; see above."""
    global _owner
    if _owner is None:
        _owner = threading.get_ident()
    _construct(array)
    _free_collected()


def _free(array: Any) -> None:
    """Stands for `Ndarray.__del__`; see above."""
    # At the interpreter's end modules lose their names first.
    is_over = impl is None or impl.get_runtime is None or impl.get_runtime() is None
    program = None if is_over else impl.get_runtime()._prog
    if program is None or getattr(array, "arr", None) is None:
        return
    _collected.append((program, array.arr))
    _free_collected()


def _free_collected() -> None:
    if threading.get_ident() != _owner:
        return
    while _collected:
        program, memory = _collected.pop()
        if program is impl.get_runtime()._prog:
            program.delete_ndarray(memory)


Ndarray.__init__ = _own
Ndarray.__del__ = _free


def take_tensors(tensor: type) -> None:
    """Has Quadrants find the kernels that were compiled for a type of tensors again, as for arrays."""
    args_hasher.torch_type = tensor
