# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of the pipe to the process of cagefield; its `cagefield.integrations.frames` states the layout."""

import json
import math
import struct

import numpy as np

MAGIC = b"CGF1"
PREFIX = struct.Struct("<4sI")
MAX_HEADER_BYTES = 1 << 20
MAX_ARRAY_BYTES = 1 << 34
DTYPES = {"float32": np.dtype("<f4"), "float64": np.dtype("<f8"), "int32": np.dtype("<i4")}


class FrameError(Exception):
    """A frame that breaks the protocol; the connection cannot go on."""


def write_frame(stream, header, arrays):
    """Writes a frame of a header and arrays by name, and flushes the stream."""
    arrays = {
        name: np.ascontiguousarray(values, DTYPES[values.dtype.name]) for name, values in arrays.items()
    }
    listed = [[name, values.dtype.name, list(values.shape)] for name, values in arrays.items()]
    text = json.dumps({**header, "arrays": listed}, allow_nan=False).encode()
    stream.write(PREFIX.pack(MAGIC, len(text)) + text)
    for values in arrays.values():
        stream.write(values.reshape(-1).view(np.uint8).data)
    stream.flush()


def read_frame(stream):
    """(header, arrays by name) of the next frame; None at the end of the stream.

    Raises FrameError for a frame that is cut off, or breaks a rule.
    """
    prefix = _read(stream, PREFIX.size, may_end=True)
    if prefix is None:
        return None
    magic, length = PREFIX.unpack(prefix)
    if magic != MAGIC or length > MAX_HEADER_BYTES:
        raise FrameError("the answer is no frame of this version; update the add-on and cagefield together")
    try:
        header = json.loads(bytes(_read(stream, length)))
        listed = header.pop("arrays")
        layouts = {name: (DTYPES[kind], tuple(int(n) for n in shape)) for name, kind, shape in listed}
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise FrameError(f"the header of the answer is damaged ({error!s:.80})") from None
    sizes = {name: dtype.itemsize * math.prod(shape) for name, (dtype, shape) in layouts.items()}
    if min(sizes.values(), default=0) < 0 or sum(sizes.values()) > MAX_ARRAY_BYTES:
        raise FrameError("the answer is too large")
    arrays = {}
    for name, (dtype, shape) in layouts.items():
        arrays[name] = np.frombuffer(_read(stream, sizes[name]), dtype).reshape(shape)
    return header, arrays


def _read(stream, count, may_end=False):
    content = bytearray(count)
    view, done = memoryview(content), 0
    while done < count:
        got = stream.readinto(view[done:])
        if not got:
            if may_end and not done:
                return None
            raise FrameError("the process of cagefield ended within an answer")
        done += got
    return content
