"""Whether the binary files of a COLMAP model are whole.

pycolmap (4.2) does not notice the end of a binary file: from one that is cut off it reads zeros as
intrinsics, or loops on a count it never read until memory is full. So each file is walked first, record by
record, without decoding more than its counts. A part of the file is held at a time: one that another program
cuts off meanwhile would end a process that has it mapped.

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

_POSE = 56  # rotation quaternion and translation, float64
_PARAMETERS = tuple(PARAMETERS.values())

_MOST_TEXT = 1 << 30
"""Bytes of a model's file in text; one line is held at a time."""

_PART = 1 << 20
"""Bytes of a binary file that are held at a time."""

_TEXTS = ("cameras.txt", "images.txt", "points3D.txt", "rigs.txt", "frames.txt")


States = dict[str, tuple[int, int]]


def check_whole(folder: Path) -> States:
    """The states that the files of the model in `folder` had before it was looked at, for `check_unchanged`.

    Raises DatasetError, naming the file, where one cannot be read whole: a binary one that ends too early, a
    text with zeros in it or of more than _MOST_TEXT bytes, a device.
    """
    states = _states(folder)
    for name in _TEXTS:
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
    """Raises DatasetError where a file of the model is not what `check_whole` has looked at.

    What was read meanwhile is then of both.
    """
    now = _states(folder)
    for name in sorted({*now, *states}):
        if now.get(name) != states.get(name):
            raise DatasetError(f"{folder / name}: it has changed while it was read; wait until it is whole")


def is_binary(folder: Path) -> bool:
    """Whether the model in `folder` is read from its binary files: where they are there."""
    files = [folder / f"{name}{ending}" for ending in (".bin", ".txt") for name in ("cameras", "images")]
    binary, text = (all(file.is_file() for file in files[at : at + 2]) for at in (0, 2))
    return binary or not (text or files[2].is_file())


@contextlib.contextmanager
def with_points_file(folder: Path) -> Iterator[Path]:
    """The folder of a binary model; where it has no points, another one with the same files and none."""
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
    """When each of the model's files was written, ns, and its bytes; of those that are there."""
    found = {name: file_state(folder / name) for name in (*_TEXTS, *_RECORDS)}
    return {name: state for name, state in found.items() if state is not None}


def _check_text(file: Path) -> None:
    try:
        check_regular(file, _MOST_TEXT)
        with open_regular(file) as stream:
            if 0 in stream.read(1 << 12):  # what a copy that ended left of a text
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
    """The bytes of an open file by their places, of which a part is held."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._begin, self._held = 0, b""

    def unpack(self, form: str, offset: int) -> Any:
        """What stands at a byte. Raises struct.error where the file ends before."""
        at = self._at(offset, struct.calcsize(form))
        return struct.unpack_from(form, self._held, at)

    def find(self, byte: bytes, offset: int) -> int:
        """The place of a byte from `offset` on, -1 where there is none."""
        while True:
            at = self._at(offset, 1)
            found = self._held.find(byte, at)
            if found >= 0:
                return self._begin + found
            if not self._held:
                return -1
            offset = self._begin + len(self._held)

    def _at(self, offset: int, count: int) -> int:
        """Where `count` bytes of the file, or those up to its end, begin in the part that is held."""
        if not self._begin <= offset <= self._begin + len(self._held) - count:
            self._begin = offset
            self._file.seek(offset)
            self._held = self._file.read(max(_PART, count))
        return offset - self._begin


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
    if not 0 <= model < len(_PARAMETERS):
        raise _UnknownRecordError
    return offset + 24 + 8 * _PARAMETERS[model]


def _skip_image(data: _Window, offset: int) -> int:
    end = data.find(b"\0", offset + 4 + _POSE + 4)
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
        offset += 9 + (_POSE if data.unpack("<B", offset + 8)[0] else 0)
    return offset


def _skip_frame(data: _Window, offset: int) -> int:
    (count,) = data.unpack("<I", offset + 8 + _POSE)
    return int(offset + 12 + _POSE + 16 * count)


_RECORDS: dict[str, Callable[[_Window, int], int]] = {
    "cameras.bin": _skip_camera,
    "images.bin": _skip_image,
    "points3D.bin": _skip_point,
    "rigs.bin": _skip_rig,
    "frames.bin": _skip_frame,
}
