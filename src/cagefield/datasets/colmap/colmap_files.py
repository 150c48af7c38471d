"""Completeness checks of the binary files of a COLMAP model.

pycolmap (4.2) does not notice the end of a binary file: from a truncated file it reads zeros as intrinsics,
or loops on a count that it never read until memory is full. So each file is walked first, record by record,
without decoding more than its counts. A window of the file is read at a time, not memory-mapped: if another
program truncates a mapped file, the process is killed.

Source: COLMAP, `src/colmap/scene/reconstruction_io_binary.cc`.
"""

from __future__ import annotations

import contextlib
import shutil
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from cagefield.datasets.colmap.colmap_lenses import PARAMETERS
from cagefield.errors import DatasetError
from cagefield.files.safe_open import check_regular, file_state, open_regular
from cagefield.files.temporary_folders import TemporaryFolder

_POSE_BYTES = 56  # rotation quaternion and translation, float64
_PARAMETER_COUNTS = tuple(PARAMETERS.values())

_MAX_TEXT_BYTES = 1 << 30
"""Maximum bytes of a model's text file; one line is in memory at a time."""

_WINDOW_BYTES = 1 << 20
"""Bytes of a binary file that are in memory at a time."""

_TEXT_FILES = ("cameras.txt", "images.txt", "points3D.txt", "rigs.txt", "frames.txt")


States = dict[str, tuple[int, int]]


def check_complete(folder: Path) -> States:
    """States of the files of the model in `folder` before the check, for `check_unchanged`.

    Raises DatasetError, naming the file, where a file cannot be read whole: a truncated binary file, a text
    file with zeros in it or of more than _MAX_TEXT_BYTES bytes, a device.
    """
    states = _states(folder)
    for name in _TEXT_FILES:
        _check_text(folder / name)
    for name, skip_record in _RECORDS.items():
        file = folder / name
        if not file.exists():
            continue
        try:
            size = check_regular(file)
            if not size:
                raise _CutOffError
            with open_regular(file) as stream:
                _walk(_Window(stream), size, skip_record)
        except OSError as error:
            raise DatasetError(f"{file}: cannot be read ({error.strerror})") from None
        except (_CutOffError, struct.error):
            raise DatasetError(
                f"{file}: the file is cut off after {size} bytes; copy or export it again"
            ) from None
    return states


def check_unchanged(folder: Path, states: States) -> None:
    """Raise DatasetError where a file of the model has changed since `check_complete` returned `states`.

    The data read in between is then a mixture of both versions.
    """
    now = _states(folder)
    for name in sorted({*now, *states}):
        if now.get(name) != states.get(name):
            raise DatasetError(f"{folder / name}: it has changed while it was read; wait until it is whole")


def is_binary(folder: Path) -> bool:
    """Whether the model in `folder` is read from its binary files, which are preferred to text."""
    files = [folder / f"{name}{ending}" for ending in (".bin", ".txt") for name in ("cameras", "images")]
    binary, text = (all(file.is_file() for file in files[start : start + 2]) for start in (0, 2))
    return binary or not (text or files[2].is_file())


@contextlib.contextmanager
def add_points_file(folder: Path) -> Iterator[Path]:
    """Folder of a binary model; a temporary copy with an empty points file where the model has none."""
    if (folder / "points3D.bin").is_file() or not (folder / "images.bin").is_file():
        yield folder
        return
    with TemporaryFolder("points") as complete:
        for name in _RECORDS:
            if (folder / name).is_file():
                shutil.copyfile(folder / name, complete / name)
        (complete / "points3D.bin").write_bytes(bytes(8))
        yield complete


def _states(folder: Path) -> States:
    """(time of writing in ns, bytes) of each of the model's files that exists."""
    states = {name: file_state(folder / name) for name in (*_TEXT_FILES, *_RECORDS)}
    return {name: state for name, state in states.items() if state is not None}


def _check_text(file: Path) -> None:
    try:
        check_regular(file, _MAX_TEXT_BYTES)
        with open_regular(file) as stream:
            if 0 in stream.read(1 << 12):  # the rest of an interrupted copy
                raise DatasetError(f"{file}: it is no text; copy or export it again")
    except FileNotFoundError:
        return
    except OSError as error:
        raise DatasetError(f"{file}: cannot be read ({error.strerror})") from None


class _CutOffError(Exception):
    pass


class _UnknownRecordError(Exception):
    pass


class _Window:
    """Random access to the bytes of an open file, of which one window is in memory."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._start, self._bytes = 0, b""

    def unpack(self, form: str, offset: int) -> Any:
        """Values of the format `form` at a byte. Raises struct.error where the file ends before."""
        index = self._seek(offset, struct.calcsize(form))
        return struct.unpack_from(form, self._bytes, index)

    def find(self, byte: bytes, offset: int) -> int:
        """Offset of the first `byte` from `offset` on, -1 where there is none."""
        while True:
            start = self._seek(offset, 1)
            index = self._bytes.find(byte, start)
            if index >= 0:
                return self._start + index
            if not self._bytes:
                return -1
            offset = self._start + len(self._bytes)

    def _seek(self, offset: int, count: int) -> int:
        """Index in the window of the byte `offset`; the window is moved where it lacks `count` bytes from
        there.
        """
        if not self._start <= offset <= self._start + len(self._bytes) - count:
            self._start = offset
            self._file.seek(offset)
            self._bytes = self._file.read(max(_WINDOW_BYTES, count))
        return offset - self._start


def _walk(data: _Window, size: int, skip_record: Callable[[_Window, int], int]) -> None:
    (count,) = data.unpack("<Q", 0)
    offset = 8
    for _ in range(count):
        try:
            offset = skip_record(data, offset)
        except _UnknownRecordError:
            return
        if offset > size:
            raise _CutOffError


def _skip_camera(data: _Window, offset: int) -> int:
    (model,) = data.unpack("<i", offset + 4)
    if not 0 <= model < len(_PARAMETER_COUNTS):
        raise _UnknownRecordError
    return offset + 24 + 8 * _PARAMETER_COUNTS[model]


def _skip_image(data: _Window, offset: int) -> int:
    end = data.find(b"\0", offset + 4 + _POSE_BYTES + 4)
    if end < 0:
        raise _CutOffError
    (count,) = data.unpack("<Q", end + 1)
    return int(end + 9 + 24 * count)


def _skip_point(data: _Window, offset: int) -> int:
    (count,) = data.unpack("<Q", offset + 43)
    return int(offset + 51 + 8 * count)


def _skip_rig(data: _Window, offset: int) -> int:
    (sensors,) = data.unpack("<I", offset + 4)
    offset += 8 + (8 if sensors else 0)
    for _ in range(sensors - 1):
        offset += 9 + (_POSE_BYTES if data.unpack("<B", offset + 8)[0] else 0)
    return offset


def _skip_frame(data: _Window, offset: int) -> int:
    (count,) = data.unpack("<I", offset + 8 + _POSE_BYTES)
    return int(offset + 12 + _POSE_BYTES + 16 * count)


_RECORDS: dict[str, Callable[[_Window, int], int]] = {
    "cameras.bin": _skip_camera,
    "images.bin": _skip_image,
    "points3D.bin": _skip_point,
    "rigs.bin": _skip_rig,
    "frames.bin": _skip_frame,
}
