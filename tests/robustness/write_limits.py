"""Limits of what is written below a folder, as quotas have them: a library loaded before the C library.

`write_limits.c` refuses write() and its relatives, and calls that make names, of compiled libraries too, in a
process whose environment has `preloading()` and in all that it starts; not what is written through mapped
memory, nor by programs that were linked with a C library of their own (ffmpeg's).
"""

from __future__ import annotations

import errno
import mmap
import os
import struct
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from write_points import why_not

SOURCE = Path(__file__).with_name("write_limits.c")
ENVIRONMENT = "CAGEFIELD_WRITE_LIMITS"
MANY = 1 << 40
"""Bytes, or names, that nobody uses up."""

_NUMBERS = struct.Struct("5q")
_SIZE = _NUMBERS.size + 4096

__all__ = ["MANY", "arm", "disarm", "is_loaded", "left", "preloading", "refused", "why_not"]


@cache
def _library() -> tempfile.TemporaryDirectory[str]:
    folder = tempfile.TemporaryDirectory(prefix="cagefield-limits-")
    command = ["cc", "-shared", "-fPIC", "-O1", "-o", f"{folder.name}/write_limits.so", str(SOURCE), "-ldl"]
    subprocess.run(command, check=True, capture_output=True)
    Path(folder.name, "limits").write_bytes(bytes(_SIZE))
    return folder


def preloading() -> dict[str, str]:
    """Variables for the environment of a process whose writes, and its children's, are to be limited."""
    name = _library().name
    return {"LD_PRELOAD": f"{name}/write_limits.so", ENVIRONMENT: f"{name}/limits"}


def is_loaded() -> bool:
    """Whether what this process writes can be limited."""
    return ENVIRONMENT in os.environ


@cache
def _limits() -> mmap.mmap:
    with open(os.environ[ENVIRONMENT], "r+b") as file:
        return mmap.mmap(file.fileno(), _SIZE)


def arm(
    folder: Path, *, size: int = MANY, names: int = MANY, error: int = errno.EDQUOT, late: bool = False
) -> None:
    """From now on so many bytes and names may be written below `folder`; more is refused with an error.

    With `late` the bytes are missed when a file is closed, or is to be safe; half of it is gone then.
    """
    disarm()
    _limits()[: _NUMBERS.size] = _NUMBERS.pack(size, names, 0, error, late)
    root = os.fsencode(folder.resolve()) + b"/"
    _limits()[_NUMBERS.size : _NUMBERS.size + len(root) + 1] = root + b"\0"


def disarm() -> None:
    """Nothing is refused any more."""
    _limits()[_NUMBERS.size :] = bytes(_SIZE - _NUMBERS.size)


def left() -> tuple[int, int]:
    """(bytes, names) that may still be written since `arm`."""
    size, names, *_ = _NUMBERS.unpack(_limits()[: _NUMBERS.size])
    return size, names


def refused() -> int:
    """Calls that were refused since `arm`."""
    return int(_NUMBERS.unpack(_limits()[: _NUMBERS.size])[2])
