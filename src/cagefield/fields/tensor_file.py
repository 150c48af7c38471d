"""Reader of safetensors files: a JSON header, and concatenated arrays.

The safetensors library maps files into memory: a file truncated by another program then kills the process
with a bus error. This reader raises an exception instead.

Source: the README of huggingface/safetensors, "Format".
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from cagefield.files import json_text
from cagefield.typing import AnyArray

_MAX_HEADER_BYTES = 1 << 20
"""Maximum size of a header; a field has some dozens of tensors."""

_TYPES = {
    "F64": "<f8", "F32": "<f4", "F16": "<f2", "I64": "<i8", "I32": "<i4", "I16": "<i2", "I8": "i1",
    "U64": "<u8", "U32": "<u4", "U16": "<u2", "U8": "u1", "BOOL": "?",
}  # fmt: skip


@dataclass(frozen=True)
class Tensor:
    """Array of a file: name of its type, shape, and offset of its first byte."""

    kind: str
    shape: tuple[int, ...]
    begin: int

    @property
    def is_number(self) -> bool:
        """Whether the type is a real NumPy type."""
        return self.kind in _TYPES

    def read(self, file: BinaryIO) -> AnyArray:
        """Values of the tensor. Raises ValueError where the file has been truncated."""
        count = math.prod(self.shape)
        file.seek(self.begin)
        values = np.fromfile(file, _TYPES[self.kind], count)
        if len(values) != count:
            raise ValueError("it has become shorter while it was read")
        return values.reshape(self.shape)


def read_header(file: BinaryIO) -> tuple[dict[str, str], dict[str, Tensor]]:
    """(metadata, tensors by name) of a file. Raises ValueError for a damaged one."""
    size = os.fstat(file.fileno()).st_size
    start = file.read(8)
    length = int.from_bytes(start, "little")
    if len(start) < 8 or length > min(size - 8, _MAX_HEADER_BYTES):
        raise ValueError("its header is cut off")
    document = json_text.loads(file.read(length))
    if not isinstance(document, dict):
        raise ValueError("its header is no object")
    notes = document.pop("__metadata__", None) or {}
    if not (isinstance(notes, dict) and all(isinstance(value, str) for value in notes.values())):
        raise ValueError("its notes are no texts")
    tensors, end = {}, 0
    for name, entry in sorted(document.items(), key=lambda item: _offsets(item[1])):
        begin, end = _check_tensor(entry, end)
        tensors[name] = Tensor(entry["dtype"], tuple(entry["shape"]), 8 + length + begin)
    if 8 + length + end != size:
        raise ValueError(f"it has {size} bytes, its header says {8 + length + end}")
    return notes, tensors


def _offsets(entry: Any) -> list[int]:
    """(begin, end) offsets of a tensor."""
    offsets = entry["data_offsets"] if isinstance(entry, dict) and "data_offsets" in entry else None
    if not (
        isinstance(offsets, list) and len(offsets) == 2 and all(type(offset) is int for offset in offsets)
    ):
        raise ValueError("a tensor has no offset")
    return offsets


def _check_tensor(entry: dict[str, Any], before: int) -> tuple[int, int]:
    """(begin, end) offsets of a tensor, checked against the previous end and the shape."""
    begin, end = _offsets(entry)
    kind, shape = entry.get("dtype"), entry.get("shape")
    if not isinstance(kind, str) or not isinstance(shape, list):
        raise ValueError("a tensor has no shape")
    if not all(type(side) is int and 0 <= side <= 2**62 for side in shape) or len(shape) > 32:
        raise ValueError(f"a tensor's shape is {shape!r:.60}")
    if begin != before or end < begin:
        raise ValueError("its tensors do not follow each other")
    if kind in _TYPES and end - begin != math.prod(shape) * np.dtype(_TYPES[kind]).itemsize:
        raise ValueError(f"a tensor of {shape!r:.60} has {end - begin} bytes")
    return begin, end
