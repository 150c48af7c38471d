"""Frames: messages of a JSON header and raw arrays, over a pair of pipes.

A frame is, without gaps:

    4 bytes      "CGF1"
    4 bytes      length H of the header, little-endian
    H bytes      header, a JSON object in UTF-8; "arrays" in it lists [name, dtype, shape] of each array
    the rest     the arrays in the order of the list, little-endian, C order

dtype is one of "float32", "float64", "int32". Nothing in a frame is executed. A frame that breaks a rule
cannot be passed over, as its end is unknown: the connection ends.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from cagefield.errors import CagefieldError
from cagefield.files import json_text
from cagefield.files.memory import memory_shortage
from cagefield.typing import AnyArray

FRAME_MAGIC = b"CGF1"
PREFIX = struct.Struct("<4sI")
MAX_HEADER_BYTES = 1 << 20
MAX_ARRAYS = 32
MAX_ARRAY_BYTES = 1 << 34
"""Bytes of all arrays of a frame: 70 million splats with harmonics of degree 3."""

DTYPES: dict[str, np.dtype[Any]] = {
    "float32": np.dtype("<f4"),
    "float64": np.dtype("<f8"),
    "int32": np.dtype("<i4"),
}
MAX_DIMENSIONS = 3


class FrameError(CagefieldError):
    """A frame that breaks a rule of the protocol; the connection cannot go on."""


@dataclass(frozen=True)
class Frame:
    """A message: a header without its list of arrays, and the arrays by name."""

    header: Mapping[str, Any]
    arrays: Mapping[str, AnyArray] = field(default_factory=dict)


def write_frame(stream: BinaryIO, frame: Frame) -> None:
    """Writes a frame and flushes the stream. Raises FrameError for one that no reader would accept."""
    arrays = {name: _portable(name, values) for name, values in frame.arrays.items()}
    listed = [[name, values.dtype.name, list(values.shape)] for name, values in arrays.items()]
    text = json.dumps({**frame.header, "arrays": listed}, allow_nan=False).encode()
    if len(text) > MAX_HEADER_BYTES or len(arrays) > MAX_ARRAYS:
        raise FrameError(
            f"a frame has a header of at most {MAX_HEADER_BYTES} bytes and {MAX_ARRAYS} arrays, got"
            f" {len(text)} and {len(arrays)}"
        )
    stream.write(PREFIX.pack(FRAME_MAGIC, len(text)) + text)
    for values in arrays.values():
        stream.write(values.reshape(-1).view(np.uint8).data)
    stream.flush()


def read_frame(stream: BinaryIO) -> Frame | None:
    """The next frame of a stream, its arrays writable; None at the end of the stream.

    Raises:
        FrameError: a frame that is cut off, or breaks a rule; arrays that exceed the free memory.
    """
    prefix = _read(stream, PREFIX.size, "prefix", may_end=True)
    if prefix is None:
        return None
    magic, length = PREFIX.unpack(prefix)
    if magic != FRAME_MAGIC:
        raise FrameError(
            f"a frame begins with {FRAME_MAGIC!r}, got {magic!r}; use the same version on both sides"
        )
    if length > MAX_HEADER_BYTES:
        raise FrameError(f"a header has at most {MAX_HEADER_BYTES} bytes, got {length}")
    text = _read(stream, length, "header")
    try:
        header = json_text.loads(bytes(text or b""))
    except ValueError as error:
        raise FrameError(f"the header is no JSON ({error!s:.100})") from None
    if not isinstance(header, dict):
        raise FrameError(f"the header is a JSON object, got {type(header).__name__}")
    layouts = _layouts(header.pop("arrays", []))
    total = sum(dtype.itemsize * math.prod(shape) for dtype, shape in layouts.values())
    if total > MAX_ARRAY_BYTES:
        raise FrameError(f"a frame's arrays have at most {MAX_ARRAY_BYTES} bytes, got {total}")
    if (lacking := memory_shortage(total)) is not None:
        raise FrameError(f"the frame's arrays are too large: {lacking}")
    arrays = {}
    for name, (dtype, shape) in layouts.items():
        content = _read(stream, dtype.itemsize * math.prod(shape), f'array "{name}"')
        arrays[name] = np.frombuffer(content or b"", dtype).reshape(shape)
    return Frame(header, arrays)


def _portable(name: str, values: AnyArray) -> AnyArray:
    dtype = DTYPES.get(values.dtype.name)
    if dtype is None or values.ndim > MAX_DIMENSIONS:
        raise FrameError(f'array "{name}" is {values.dtype}[{values.ndim} axes]; send {", ".join(DTYPES)}')
    return np.ascontiguousarray(values, dtype)


def _layouts(listed: Any) -> dict[str, tuple[np.dtype[Any], tuple[int, ...]]]:
    """dtype and shape of each array by name, as the header lists them."""
    if not isinstance(listed, list) or len(listed) > MAX_ARRAYS:
        raise FrameError(f'"arrays" is a list of at most {MAX_ARRAYS} arrays, got {listed!r:.80}')
    layouts: dict[str, tuple[np.dtype[Any], tuple[int, ...]]] = {}
    for item in listed:
        if not isinstance(item, list) or len(item) != 3 or not isinstance(item[0], str):
            raise FrameError(f"an array is listed as [name, dtype, shape], got {item!r:.80}")
        name, kind, shape = item
        if name in layouts:
            raise FrameError(f'array "{name:.40}" is listed twice')
        if not isinstance(kind, str) or kind not in DTYPES:
            raise FrameError(f'array "{name:.40}" is of {kind!r:.40}; send {", ".join(DTYPES)}')
        if (
            not isinstance(shape, list)
            or not 1 <= len(shape) <= MAX_DIMENSIONS
            or not all(type(size) is int and 0 <= size < 1 << 31 for size in shape)
        ):
            raise FrameError(
                f'array "{name:.40}" has a shape of 1 to {MAX_DIMENSIONS} whole numbers, got {shape!r:.80}'
            )
        layouts[name] = (DTYPES[kind], tuple(shape))
    return layouts


def _read(stream: BinaryIO, count: int, part: str, *, may_end: bool = False) -> bytearray | None:
    """Exactly `count` bytes. Raises FrameError where the stream ends before; None at its end if it may."""
    content = bytearray(count)
    view, done = memoryview(content), 0
    while done < count:
        got = stream.readinto(view[done:])  # type: ignore[attr-defined]
        if not got:
            if may_end and not done:
                return None
            raise FrameError(f"the stream ended within a frame's {part}, after {done} of {count} bytes")
        done += got
    return content
