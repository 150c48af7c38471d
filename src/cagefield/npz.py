"""Files of arrays by name (.npz) as damage may have left them: what does not fit together is ValueError."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of a file that `numpy.savez` wrote; nothing is allocated that is larger than the file.

    Other archives hold none: a checkpoint of PyTorch's, say.

    Raises ValueError for a damaged file, OSError where it cannot be read.
    """
    size = path.stat().st_size
    try:
        with zipfile.ZipFile(path) as archive:
            entries = [entry for entry in archive.infolist() if entry.filename.endswith(".npy")]
            unpacked = sum(entry.file_size for entry in entries)
            if unpacked > size:  # none is packed
                raise ValueError(f"it says that it unpacks to {unpacked} bytes")
            return {entry.filename.removesuffix(".npy"): _array(archive, entry) for entry in entries}
    except OSError:
        raise
    except Exception as error:  # zipfile and numpy raise their own classes, and many others, on damage
        raise ValueError(" ".join(str(error).split()) or type(error).__name__) from error


def _array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[Any]:
    with archive.open(entry) as stream:
        needed = _bytes_of(stream)
        if needed != entry.file_size - stream.tell():
            raise ValueError(f"{entry.filename} says that it is an array of {needed} bytes")
    with archive.open(entry) as stream:
        array: NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
    return array


def _bytes_of(stream: IO[bytes]) -> int:
    """Bytes of the array whose header is read."""
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
    return math.prod(shape) * numbers.itemsize
