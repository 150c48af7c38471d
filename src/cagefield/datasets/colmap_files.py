"""Whether the binary files of a COLMAP model are whole.

pycolmap (4.2) does not notice the end of a binary file: from one that is cut off it reads zeros as
intrinsics, or loops on a count it never read until memory is full. So each file is walked first, record by
record, without decoding more than its counts.

Source: COLMAP, `src/colmap/scene/reconstruction_io_binary.cc`.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Callable
from pathlib import Path

from cagefield.errors import DatasetError
from cagefield.regular_files import check_regular, open_regular

_POSE = 56  # rotation quaternion and translation, float64
_PARAMETERS = (3, 4, 4, 5, 8, 8)  # of the camera models 0 to 5, those that can be read; see `colmap._camera`

_MOST_TEXT = 1 << 30
"""Bytes of a model's file in text; one line is held at a time."""

_TEXTS = ("cameras.txt", "images.txt", "points3D.txt", "rigs.txt", "frames.txt")


def check_whole(folder: Path) -> None:
    """Raises DatasetError, naming the file, where one of the model in `folder` cannot be read whole.

    A binary one that ends too early, a text with zeros in it or of more than _MOST_TEXT bytes, a device.
    """
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
            with open_regular(file) as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
                _walk(data, size, skip_record)
        except OSError as error:
            raise DatasetError(f"{file}: cannot be read ({error.strerror})") from None
        except (_CutOffError, IndexError, struct.error, ValueError):
            raise DatasetError(
                f"{file}: the file is cut off after {size} bytes; copy or export it again"
            ) from None


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


def _walk(data: mmap.mmap, size: int, skip_record: Callable[[mmap.mmap, int], int]) -> None:
    (count,) = struct.unpack_from("<Q", data, 0)
    offset = 8
    for _ in range(count):
        try:
            offset = skip_record(data, offset)
        except _UnknownRecordError:
            return
        if offset > size:
            raise _CutOffError


def _skip_camera(data: mmap.mmap, offset: int) -> int:
    (model,) = struct.unpack_from("<i", data, offset + 4)
    if not 0 <= model < len(_PARAMETERS):
        raise _UnknownRecordError
    return offset + 24 + 8 * _PARAMETERS[model]


def _skip_image(data: mmap.mmap, offset: int) -> int:
    end = data.find(b"\0", offset + 4 + _POSE + 4)
    if end < 0:
        raise _CutOffError
    (count,) = struct.unpack_from("<Q", data, end + 1)
    return int(end + 9 + 24 * count)


def _skip_point(data: mmap.mmap, offset: int) -> int:
    (count,) = struct.unpack_from("<Q", data, offset + 43)
    return int(offset + 51 + 8 * count)


def _skip_rig(data: mmap.mmap, offset: int) -> int:
    (sensors,) = struct.unpack_from("<I", data, offset + 4)
    offset += 8 + (8 if sensors else 0)
    for _ in range(sensors - 1):
        offset += 9 + (_POSE if data[offset + 8] else 0)
    return offset


def _skip_frame(data: mmap.mmap, offset: int) -> int:
    (count,) = struct.unpack_from("<I", data, offset + 8 + _POSE)
    return int(offset + 12 + _POSE + 16 * count)


_RECORDS: dict[str, Callable[[mmap.mmap, int], int]] = {
    "cameras.bin": _skip_camera,
    "images.bin": _skip_image,
    "points3D.bin": _skip_point,
    "rigs.bin": _skip_rig,
    "frames.bin": _skip_frame,
}
