"""Kill points in the middle of what is written: a library that counts writes, loaded before the C library.

Python tells of files that are opened, not of what is written to them. `write_points.c` sees each write() and
its relatives, those of compiled libraries too; not what is written through mapped memory, nor by programs
that were linked with a C library of their own (ffmpeg's).
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

SOURCE = Path(__file__).with_name("write_points.c")


def why_not() -> str | None:
    """Why writes cannot be counted here; None where they can."""
    if not sys.platform.startswith("linux"):
        return "writes are counted on Linux only"
    return None if shutil.which("cc") else "writes are counted by a library, which needs a C compiler (cc)"


@cache
def _library() -> tempfile.TemporaryDirectory[str]:
    folder = tempfile.TemporaryDirectory(prefix="cagefield-writes-")
    command = ["cc", "-shared", "-fPIC", "-O1", "-o", f"{folder.name}/write_points.so", str(SOURCE), "-ldl"]
    subprocess.run(command, check=True, capture_output=True)
    return folder


def preloading() -> dict[str, str]:
    """Variables for the environment of a process whose writes are to be counted."""
    if is_loaded():
        return {}  # its children have it too
    return {"LD_PRELOAD": f"{_library().name}/write_points.so"}


def is_loaded() -> bool:
    """Whether this process's writes can be counted, and those of processes that it forks."""
    return sys.platform.startswith("linux") and hasattr(ctypes.CDLL(None), "write_points_arm")


def arm(folder: Path, at: int) -> None:
    """From now on this process's writes below `folder` are counted; it dies in number `at`, or never (0)."""
    ctypes.CDLL(None).write_points_arm(os.fsencode(folder.resolve()), ctypes.c_long(at))


def count() -> int:
    """Writes since `arm`."""
    function = ctypes.CDLL(None).write_points_count
    function.restype = ctypes.c_long
    return int(function())
