"""Array files (.npy, .npz), possibly damaged: every fault of a file is a ValueError."""

from __future__ import annotations

import math
import sys
import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from cagefield.files.memory import memory_shortage
from cagefield.files.safe_open import open_regular

DEFLATED = 1040
"""How many times as much a deflated file can hold, at most."""


def read_arrays(path: Path, times: int = 1, names: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
    """The arrays of a file that `numpy.savez` wrote; all of them take no more memory than the file.

    With `times` they may take that many times as much (`DEFLATED`: of `numpy.savez_compressed`). With `names`
    only those are read.

    Other archives hold none: a checkpoint of PyTorch's, say.

    Raises ValueError for a damaged file, OSError where it cannot be read.
    """
    try:
        with open_regular(path) as file, zipfile.ZipFile(file) as archive:
            size = path.stat().st_size
            entries = [entry for entry in archive.infolist() if entry.filename.endswith(".npy")]
            if names is not None:
                entries = [entry for entry in entries if entry.filename.removesuffix(".npy") in names]
            unpacked = sum(entry.file_size for entry in entries)
            if unpacked > times * size:
                raise ValueError(f"it says that it unpacks to {unpacked} bytes")
            if (lacking := memory_shortage(unpacked)) is not None:
                raise ValueError(lacking)
            return {entry.filename.removesuffix(".npy"): _array(archive, entry) for entry in entries}
    except OSError:
        raise
    except Exception as error:  # zipfile and numpy raise their own classes, and many others, on damage
        raise ValueError(" ".join(str(error).split()) or type(error).__name__) from error


def array_headers(path: Path) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """(shape, type) of the arrays of a file that `numpy.savez` wrote, without their values.

    Raises ValueError for a damaged file or one without arrays, OSError where it cannot be read.
    """
    try:
        with open_regular(path) as file, zipfile.ZipFile(file) as archive:
            headers = {}
            for entry in archive.infolist():
                if entry.filename.endswith(".npy"):
                    with archive.open(entry) as stream:
                        headers[entry.filename.removesuffix(".npy")] = _header_of(stream)
    except OSError:
        raise
    except Exception as error:  # zipfile and numpy raise their own classes, and many others, on damage
        raise ValueError(" ".join(str(error).split()) or type(error).__name__) from error
    if not headers:
        raise ValueError("it holds no arrays")
    return headers


def read_array(path: Path) -> NDArray[Any]:
    """The array of a file that `numpy.save` wrote; nothing is allocated that is larger than the file.

    Raises ValueError for a damaged file, OSError where it cannot be read.
    """
    try:
        with open_regular(path) as file:
            size = path.stat().st_size
            needed = _bytes_of(file)
            if needed != size - file.tell():
                raise ValueError(f"it says that it is an array of {needed} bytes")
            if (lacking := memory_shortage(needed)) is not None:
                raise ValueError(lacking)
            file.seek(0)
            return _values(file)
    except OSError:
        raise
    except Exception as error:  # odd headers raise what numpy's parsers happen to
        raise ValueError(" ".join(str(error).split()) or type(error).__name__) from error


def _array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[Any]:
    with archive.open(entry) as stream:
        needed = _bytes_of(stream)
        if needed != entry.file_size - stream.tell():
            raise ValueError(f"{entry.filename} says that it is an array of {needed} bytes")
    with archive.open(entry) as stream:
        return _values(stream)


def _values(stream: IO[bytes]) -> NDArray[Any]:
    """The array of a stream; texts of it are texts."""
    array: NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
    if array.dtype.kind == "U" and array.size and array.dtype.itemsize:
        codes = np.ascontiguousarray(array).reshape(-1).view(np.uint32)
        codes = codes if array.dtype.isnative else codes.byteswap()
        if codes.max() > sys.maxunicode:  # numpy makes a SystemError of it, once somebody looks
            raise ValueError("it has a text whose letters are none")
    return array


def _bytes_of(stream: IO[bytes]) -> int:
    """Bytes of the array whose header is read."""
    shape, numbers = _header_of(stream)
    return math.prod(shape) * numbers.itemsize


def _header_of(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """(shape, type) of the array whose header is read."""
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    version = np.lib.format.read_magic(stream)
    if version not in readers:
        raise ValueError(f"an array of version {version}")
    shape, _, numbers = readers[version](stream)
    if numbers.hasobject or numbers.itemsize == 0 or any(length < 0 for length in shape):
        raise ValueError(f"an array of {numbers}, {shape}")
    return shape, numbers
