"""Files for pages: a JSON header and deflated arrays, which browsers unpack with DecompressionStream.

    magic [8 bytes], version uint32, header's length uint32, header (JSON, UTF-8), arrays one after the other

Numbers are little-endian. The header's "arrays" lists name, type, shape and bytes of each array in the order
in which they come, so that a page can use the first ones while the others are on their way. Each array is a
zlib stream, whose checksum finds damage.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError

LEVEL = 6
"""Of deflate: 9 is 2% smaller and takes five times as long."""

QUICK_LEVEL = 1
"""Deflate level for files that a user waits for."""

TYPES = {"u1": np.uint8, "u2": np.uint16, "i4": np.int32, "f4": np.float32}
_MOST = 1 << 31


def pack(
    magic: bytes,
    version: int,
    header: Mapping[str, Any],
    arrays: Mapping[str, NDArray[Any]],
    level: int = LEVEL,
) -> bytes:
    """The file with this header and these arrays (uint8, uint16, int32 or float32)."""
    names = {np.dtype(kind): name for name, kind in TYPES.items()}
    blobs, entries = [], []
    for name, array in arrays.items():
        blob = zlib.compress(np.ascontiguousarray(array).tobytes(), level)
        blobs.append(blob)
        entries.append(
            {"name": name, "type": names[array.dtype], "shape": list(array.shape), "bytes": len(blob)}
        )
    text = json.dumps({**header, "arrays": entries}, separators=(",", ":"), allow_nan=False).encode()
    return b"".join([magic, struct.pack("<II", version, len(text)), text, *blobs])


def unpack(data: bytes, magic: bytes, version: int, what: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """(header, arrays by name) of a file. `what` names the kind of file in messages.

    Raises:
        FieldError: another kind of file, another version, a file that is truncated or garbled.
    """
    cure = f"not {what}, or a truncated or garbled one; write it again"
    if len(data) < 16 or data[:8] != magic:
        raise FieldError(cure)
    found, length = struct.unpack("<II", data[8:16])
    if found != version:
        raise FieldError(f"{what} of version {found}, this cagefield reads {version}; update cagefield")
    try:
        header = json.loads(data[16 : 16 + length])
        at, arrays = 16 + length, {}
        for entry in header["arrays"]:
            shape, kind = tuple(int(n) for n in entry["shape"]), np.dtype(TYPES[entry["type"]])
            size, end = int(np.prod(shape, dtype=np.float64)) * kind.itemsize, at + int(entry["bytes"])
            if not 0 <= size < _MOST or min(shape, default=0) < 0 or not at <= end <= len(data):
                raise FieldError(cure)
            stream = zlib.decompressobj()
            raw = stream.decompress(data[at:end], size + 1)
            if len(raw) != size or not stream.eof:
                raise FieldError(cure)
            arrays[str(entry["name"])] = np.frombuffer(raw, kind).reshape(shape)
            at = end
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, zlib.error) as error:
        raise FieldError(cure) from error
    return header, arrays


def byte_planes(halves: NDArray[np.float16]) -> NDArray[np.uint8]:
    """[2, N], the low bytes of float16 numbers and their high ones: alike bytes together deflate better."""
    return np.ascontiguousarray(halves.astype("<f2").reshape(-1, 1).view(np.uint8).T)


def from_byte_planes(planes: NDArray[np.uint8]) -> NDArray[np.float16]:
    """The numbers [N] of `byte_planes`."""
    return np.asarray(np.ascontiguousarray(planes.T).view("<f2").reshape(-1))


def bytes_until(data: bytes, names: str) -> int:
    """How many bytes of a file come before the first array whose name begins so; all where none does."""
    _, length = struct.unpack("<II", data[8:16])
    at = 16 + length
    for entry in json.loads(data[16:at])["arrays"]:
        if entry["name"].startswith(names):
            break
        at += entry["bytes"]
    return at
