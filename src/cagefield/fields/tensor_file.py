"""Reading safetensors files: a header of JSON, and arrays one after another.

The library maps a file into memory: where another program cuts it off meanwhile, the process ends at once
(a bus error). What is read here is an error then.

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

_MOST_HEADER = 1 << 20
"""Bytes of a header: a field has some dozens of tensors."""

_TYPES = {
    "F64": "<f8", "F32": "<f4", "F16": "<f2", "I64": "<i8", "I32": "<i4", "I16": "<i2", "I8": "i1",
    "U64": "<u8", "U32": "<u4", "U16": "<u2", "U8": "u1", "BOOL": "?",
}  # fmt: skip


@dataclass(frozen=True)
class Tensor:
    """An array of a file: its type's name, its shape, and where it begins."""

    kind: str
    shape: tuple[int, ...]
    begin: int

    @property
    def is_number(self) -> bool:
        """Whether its type is one of numpy's that is real."""
        return self.kind in _TYPES

    def read(self, file: BinaryIO) -> AnyArray:
        """Its values. Raises ValueError where the file has become shorter."""
        count = math.prod(self.shape)
        file.seek(self.begin)
        values = np.fromfile(file, _TYPES[self.kind], count)
        if len(values) != count:
            raise ValueError("it has become shorter while it was read")
        return values.reshape(self.shape)


def read_header(file: BinaryIO) -> tuple[dict[str, str], dict[str, Tensor]]:
    """(notes, tensors by name) of a file. Raises ValueError where it is damaged."""
    size = os.fstat(file.fileno()).st_size
    start = file.read(8)
    length = int.from_bytes(start, "little")
    if len(start) < 8 or length > min(size - 8, _MOST_HEADER):
        raise ValueError("its header is cut off")
    document = json_text.loads(file.read(length))
    if not isinstance(document, dict):
        raise ValueError("its header is no object")
    notes = document.pop("__metadata__", None) or {}
    if not (isinstance(notes, dict) and all(isinstance(value, str) for value in notes.values())):
        raise ValueError("its notes are no texts")
    tensors, end = {}, 0
    for name, about in sorted(document.items(), key=lambda item: _places(item[1])):
        begin, end = _checked(about, end)
        tensors[name] = Tensor(about["dtype"], tuple(about["shape"]), 8 + length + begin)
    if 8 + length + end != size:
        raise ValueError(f"it has {size} bytes, its header says {8 + length + end}")
    return notes, tensors


def _places(about: Any) -> list[int]:
    """Where a tensor begins and ends."""
    places = about["data_offsets"] if isinstance(about, dict) and "data_offsets" in about else None
    if not (isinstance(places, list) and len(places) == 2 and all(type(place) is int for place in places)):
        raise ValueError("a tensor has no place")
    return places


def _checked(about: dict[str, Any], before: int) -> tuple[int, int]:
    """A tensor's place, which must begin where the one before ends and be as long as its shape says."""
    begin, end = _places(about)
    kind, shape = about.get("dtype"), about.get("shape")
    if not isinstance(kind, str) or not isinstance(shape, list):
        raise ValueError("a tensor has no shape")
    if not all(type(side) is int and 0 <= side <= 2**62 for side in shape) or len(shape) > 32:
        raise ValueError(f"a tensor's shape is {shape!r:.60}")
    if begin != before or end < begin:
        raise ValueError("its tensors do not follow each other")
    if kind in _TYPES and end - begin != math.prod(shape) * np.dtype(_TYPES[kind]).itemsize:
        raise ValueError(f"a tensor of {shape!r:.60} has {end - begin} bytes")
    return begin, end
