"""MessagePack of untrusted files: maps, lists, text, numbers, and binaries as views of the bytes.

Lengths beyond the rest of the bytes, deep nesting and too many values are refused before anything is
allocated. Extension types are binaries without their type.

Source: github.com/msgpack/msgpack, spec.md.
"""

from __future__ import annotations

import struct
from typing import Any

MAX_MSGPACK_NESTING = 32
MAX_MSGPACK_VALUES = 4_000_000
"""Number of values of a file: seconds to be read."""

_NUMBERS = {
    0xCA: ">f", 0xCB: ">d", 0xCC: ">B", 0xCD: ">H", 0xCE: ">I", 0xCF: ">Q",
    0xD0: ">b", 0xD1: ">h", 0xD2: ">i", 0xD3: ">q",
}  # fmt: skip
_CONSTANTS = {0xC0: None, 0xC2: False, 0xC3: True}
_LENGTHS = {
    0xC4: ("bytes", ">B"), 0xC5: ("bytes", ">H"), 0xC6: ("bytes", ">I"),
    0xC7: ("ext", ">B"), 0xC8: ("ext", ">H"), 0xC9: ("ext", ">I"),
    0xD9: ("text", ">B"), 0xDA: ("text", ">H"), 0xDB: ("text", ">I"),
    0xDC: ("list", ">H"), 0xDD: ("list", ">I"), 0xDE: ("map", ">H"), 0xDF: ("map", ">I"),
}  # fmt: skip
_FIXED_EXTENSIONS = {0xD4: 1, 0xD5: 2, 0xD6: 4, 0xD7: 8, 0xD8: 16}


def loads(content: bytes) -> Any:
    """The value of MessagePack bytes; binaries are memoryviews of `content`.

    Raises:
        ValueError: truncated bytes, bytes after the value, nesting or a number of values beyond the limits,
            text that is not UTF-8, keys that are no text.
    """
    reader = _Reader(content)
    value = reader.value(0)
    if reader.at != len(content):
        raise ValueError(f"{len(content) - reader.at} bytes follow its end")
    return value


class _Reader:
    """Position in the bytes, and the number of values so far."""

    def __init__(self, content: bytes) -> None:
        self.content, self.at, self.count = memoryview(content), 0, 0

    def take(self, length: int) -> memoryview:
        if length > len(self.content) - self.at:
            raise ValueError(f"it ends at byte {len(self.content)}, amid a value")
        part = self.content[self.at : self.at + length]
        self.at += length
        return part

    def number(self, form: str) -> Any:
        return struct.unpack(form, self.take(struct.calcsize(form)))[0]

    def value(self, depth: int) -> Any:
        self.count += 1
        if self.count > MAX_MSGPACK_VALUES:
            raise ValueError(f"it has more than {MAX_MSGPACK_VALUES} values")
        if depth > MAX_MSGPACK_NESTING:
            raise ValueError("it is nested too deeply")
        first = self.take(1)[0]
        if first <= 0x7F or first >= 0xE0:
            return first if first <= 0x7F else first - 256
        if first in _CONSTANTS:
            return _CONSTANTS[first]
        if first in _NUMBERS:
            return self.number(_NUMBERS[first])
        if first in _FIXED_EXTENSIONS:
            self.take(1)
            return self.take(_FIXED_EXTENSIONS[first])
        if first <= 0xBF:
            kind = "map" if first <= 0x8F else "list" if first <= 0x9F else "text"
            return self.sized(kind, first & (0x1F if kind == "text" else 0x0F), depth)
        if first not in _LENGTHS:
            raise ValueError(f"byte {self.at - 1} is 0x{first:02x}, which begins no value")
        kind, form = _LENGTHS[first]
        return self.sized(kind, self.number(form), depth)

    def sized(self, kind: str, length: int, depth: int) -> Any:
        """Value of a kind with its length: bytes, or items."""
        if kind == "bytes":
            return self.take(length)
        if kind == "ext":
            self.take(1)
            return self.take(length)
        if kind == "text":
            return str(self.take(length), "utf-8")
        if length > len(self.content) - self.at:  # every item has a byte at least
            raise ValueError(f"it ends at byte {len(self.content)}, amid a {kind}")
        if kind == "list":
            return [self.value(depth + 1) for _ in range(length)]
        found = {}
        for _ in range(length):
            key = self.value(depth + 1)
            if not isinstance(key, str):
                raise ValueError(f"a key is a {type(key).__name__}, expected text")
            found[key] = self.value(depth + 1)
        return found
