"""Files to be read: regular ones, and texts of a length that texts have.

A device has no end, a pipe perhaps none and perhaps no beginning, and a file with holes says any length.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO, TypeAlias, cast

import numpy as np
from numpy.typing import DTypeLike

from cagefield.errors import FieldError
from cagefield.typing import AnyArray

MAX_TEXT_BYTES = 32 << 20
"""Bytes of a text that is read whole: JSON of some 20,000 cameras."""

FileState: TypeAlias = tuple[int, int] | None
"""When a file was written, ns, and its bytes; None where there is none."""

_MIN_READ_BYTES = 1 << 16
"""Bytes that are asked for at a time, if the file says less: a buffer for all of them is taken before."""


class UnreadableError(OSError):
    """Error of a path that is no regular file, or too long; the message has the reason and cure, not the
    name."""

    def __str__(self) -> str:
        return str(self.strerror)


def check_regular(path: str | os.PathLike[str], most: int | None = None) -> int:
    """Size of a regular file, bytes, without opening it.

    Raises UnreadableError for a device, a pipe or a socket, and for more than `most` bytes; OSError for a
    missing path or a folder.
    """
    return _checked(os.stat(path), path, most)


def open_regular(path: str | os.PathLike[str]) -> BinaryIO:
    """A regular file, open to be read. Raises as `check_regular`, and OSError where it may not be read."""
    check_regular(path)  # to open a device may do something
    file = cast(BinaryIO, open(path, "rb", opener=_without_waiting))  # noqa: SIM115 - it is the caller's
    try:
        _checked(os.fstat(file.fileno()), path, None)
    except OSError:
        file.close()
        raise
    return file


def read_bytes(path: str | os.PathLike[str], most: int = MAX_TEXT_BYTES) -> bytes:
    """All bytes of a regular file, at most `most`. Raises as `open_regular`."""
    part, content = max(_MIN_READ_BYTES, check_regular(path, most) + 1), b""
    with open_regular(path) as file:
        while more := file.read(part):
            content += more
            if len(content) > most:  # it grew, or is one of the system's, which say 0
                raise _too_long(len(content), most, path)
    return content


def read_text(path: str | os.PathLike[str], most: int = MAX_TEXT_BYTES) -> str:
    r"""The text of a regular file in UTF-8, at most `most` bytes; its lines end with \n.

    Raises as `open_regular`, and UnicodeDecodeError.
    """
    return read_bytes(path, most).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")


def file_state(path: str | os.PathLike[str]) -> FileState:
    """The state of a file now: another one once it is written again."""
    try:
        state = os.stat(path)
    except OSError:
        return None
    return state.st_mtime_ns, state.st_size


def read_array(path: str | os.PathLike[str], dtype: DTypeLike, count: int, offset: int = 0) -> AnyArray:
    """`count` values of a file from a byte on, which were there when it was opened.

    Raises FieldError where they are not any more: another program has cut the file off.
    """
    values: AnyArray = np.fromfile(path, dtype, count, offset=offset)
    if len(values) != count:
        raise FieldError(f"{path}: it has become shorter while it was read; wait until it is whole")
    return values


def real_path(path: str | os.PathLike[str]) -> Path:
    """The absolute path without symbolic links; links in a circle stay as they are, and nothing is there."""
    return Path(os.path.realpath(path))  # Path.resolve raises RuntimeError of them, up to Python 3.12


def _without_waiting(path: str, flags: int) -> int:
    """Opens a file; a pipe that has taken its place meanwhile is not waited for."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _checked(status: os.stat_result, path: str | os.PathLike[str], most: int | None) -> int:
    mode = status.st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        kind = "a pipe" if stat.S_ISFIFO(mode) else "a socket" if stat.S_ISSOCK(mode) else "a device"
        why = f"it is {kind}, not a file; write what is to be read to a file and give that"
        raise UnreadableError(errno.EINVAL, why, str(path))
    if most is not None and status.st_size > most:
        raise _too_long(status.st_size, most, path)
    return status.st_size


def _too_long(size: int, most: int, path: str | os.PathLike[str]) -> UnreadableError:
    why = f"it has {size} bytes, at most {most} are read; it is damaged or another file"
    return UnreadableError(errno.EINVAL, why, str(Path(path)))
