"""Errors that a user can act on: each names the value, the allowed range and the cure.

Warnings are shown alike.
"""

from __future__ import annotations

import contextlib
import errno
import sys
import tempfile
import warnings
from collections.abc import Iterator


class CagefieldError(ValueError):
    """Base of every error raised on bad input; the command line prints its message alone and exits with 2."""


class CageError(CagefieldError):
    """A cage whose corners are not a valid hexahedron."""


class EditError(CagefieldError):
    """An edit or an edit stack that cannot be evaluated."""


class EditFileError(EditError):
    """An edit file with an unknown key or an impossible value."""


class CameraError(CagefieldError):
    """A camera with impossible intrinsics or pose."""


class DatasetError(CagefieldError):
    """A data set that cannot be read."""


class FieldError(CagefieldError):
    """A field with arrays that do not fit together, or a field file that cannot be read."""


class SceneError(CagefieldError):
    """A scene folder that cannot be read or written."""


class DeviceError(CagefieldError):
    """A compute device that is not there."""


_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def line_of(error: OSError) -> str:
    """One line for a failed system call: the file names and the reason."""
    names = " -> ".join(str(name) for name in (error.filename, error.filename2) if name is not None)
    if not names and error.errno in _FULL:
        names = f"the folder for temporary files, {tempfile.gettempdir()} ($TMPDIR), or the one of the result"
    return f"{names}: {error.strerror or error}" if names else str(error.strerror or error)


@contextlib.contextmanager
def warnings_in_one_line() -> Iterator[None]:
    """Shows warnings as a line on stderr, without their place in the source."""

    def show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
        if issubclass(category, UserWarning):
            print("cagefield: warning: " + " ".join(str(message).split()), file=sys.stderr)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield
