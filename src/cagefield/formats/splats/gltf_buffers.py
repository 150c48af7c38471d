"""JSON, buffers and accessors of a glTF 2.0 asset: .glb, or .gltf with external or embedded buffers.

Buffers are read in parts from their files; data URIs are decoded in memory. External files must lie in the
asset's folder or below it.

Source: KhronosGroup/glTF, specification 2.0, "GLB File Format", "Buffers and Buffer Views", "Accessors".
"""

from __future__ import annotations

import base64
import binascii
import struct
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np

from cagefield.files import json_text
from cagefield.files.memory import memory_shortage
from cagefield.files.safe_open import (
    MAX_TEXT_BYTES,
    check_regular,
    open_regular,
    read_array,
    read_bytes,
    real_path,
)
from cagefield.typing import AnyArray

MAGIC, JSON_CHUNK, BIN_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
MAX_EMBEDDED_BYTES = 1 << 30
"""Maximum size of a .gltf, whose buffers may be embedded as base64."""

_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_INDEX_TYPES = (5121, 5123, 5125)


@dataclass(frozen=True, eq=False)
class Buffer:
    """Buffer of `size` bytes, in a file from `begin` on, or in memory."""

    path: Path
    begin: int
    size: int
    content: bytes | None = None

    def read(self, offset: int, size: int) -> bytes:
        """Bytes of the buffer. Raises ValueError beyond the buffer, FieldError as `read_array`."""
        if offset < 0 or size < 0 or offset + size > self.size:
            raise ValueError(f"{size} bytes from {offset} on end after a buffer of {self.size}")
        if self.content is not None:
            return self.content[offset : offset + size]
        return read_array(self.path, np.uint8, size, offset=self.begin + offset).tobytes()


class GltfAsset:
    """Open asset: its JSON, and its buffers, which are opened on demand."""

    def __init__(self, path: Path) -> None:
        """Open an asset. Raises ValueError, TypeError, KeyError or struct.error for an invalid one."""
        self.path = path
        with open_regular(path) as file:
            is_binary = file.read(4) == b"glTF"
        self.json, self._binary = _chunks(path) if is_binary else (_text(path), None)
        version = _mapping(self.json.get("asset", {})).get("version", "2.0")
        if not str(version).startswith("2."):
            raise ValueError(f"it is glTF {version!s:.10}, 2.0 is read")
        self._buffers: dict[int, Buffer] = {}

    def items(self, name: str) -> list[dict[str, Any]]:
        """List of objects at the JSON's top level; empty without."""
        found = self.json.get(name, [])
        if not isinstance(found, list) or not all(isinstance(item, dict) for item in found):
            raise ValueError(f"its {name} are no list of objects")
        return found

    def item(self, name: str, number: Any) -> dict[str, Any]:
        """Object of such a list. Raises ValueError for an index out of range."""
        found = self.items(name)
        if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < len(found):
            raise ValueError(f"{name} {number!r:.20} is not there, it has {len(found)}")
        return found[number]

    def buffer(self, number: Any) -> Buffer:
        """Buffer by index; an external file is opened on demand."""
        description = self.item("buffers", number)
        if number not in self._buffers:
            self._buffers[number] = self._open_buffer(number, description)
        return self._buffers[number]

    def view(self, number: Any) -> tuple[Buffer, int, int, int | None]:
        """(buffer, first byte, size in bytes, stride or None) of a bufferView.

        Raises ValueError for a compressed one.
        """
        view = self.item("bufferViews", number)
        for name in _mapping(view.get("extensions", {})):
            raise ValueError(f"its values are compressed with {name:.60}, which is not read")
        begin, size = int(view.get("byteOffset", 0)), int(view["byteLength"])
        buffer = self.buffer(view.get("buffer", 0))
        if begin < 0 or size < 0 or begin + size > buffer.size:
            raise ValueError(f"bufferView {number} ends after its buffer of {buffer.size} bytes")
        stride = view.get("byteStride")
        return buffer, begin, size, None if stride is None else int(stride)

    def accessor(self, number: Any, width: int | tuple[int, ...]) -> Accessor:
        """Accessor by index, whose elements have `width` components, one of several widths."""
        description = self.item("accessors", number)
        found = _WIDTHS.get(description["type"], 0)
        if found not in (width if isinstance(width, tuple) else (width,)):
            raise ValueError(f"an attribute is {description['type']!s:.20}")
        return Accessor(self, description, found)

    @property
    def end(self) -> int:
        """Offset of the first unread byte of the asset's own file."""
        return check_regular(self.path) if self._binary is None else sum(self._binary)

    def external_files(self) -> tuple[Path, ...]:
        """External files of the buffers."""
        description = [buffer.get("uri") for buffer in self.items("buffers")]
        return tuple(
            self._external(uri) for uri in description if isinstance(uri, str) and uri[:5] != "data:"
        )

    def _open_buffer(self, number: int, description: dict[str, Any]) -> Buffer:
        uri = description.get("uri")
        if uri is None:
            if self._binary is None or number:
                raise ValueError(f"buffer {number} has no content")
            begin, size = self._binary
            return Buffer(self.path, begin, size)
        if not isinstance(uri, str):
            raise ValueError(f"buffer {number} has no uri that is text")
        if uri[:5] == "data:":
            head, _, text = uri.partition(",")
            if not head.endswith(";base64"):
                raise ValueError(f"buffer {number} is embedded, but not as base64")
            try:
                content = base64.b64decode(text, validate=True)
            except (binascii.Error, ValueError):
                raise ValueError(f"buffer {number} is no base64 that can be decoded") from None
            return Buffer(self.path, 0, len(content), content)
        path = self._external(uri)
        try:
            return Buffer(path, 0, check_regular(path))
        except OSError as error:
            raise ValueError(f"it lacks {path.name:.80} ({error.strerror}), put it beside") from None

    def _external(self, uri: str) -> Path:
        parts = urlsplit(uri)
        folder = real_path(self.path.parent)
        path = real_path(folder / unquote(parts.path).replace("\\", "/"))
        if parts.scheme or parts.netloc or not path.is_relative_to(folder):
            raise ValueError(f"a buffer lies outside of its folder ({uri:.80}), put it beside")
        return path


class Accessor:
    """Values [count,width] of a buffer, with the replacements of a sparse accessor."""

    def __init__(self, asset: GltfAsset, description: dict[str, Any], width: int) -> None:
        base = np.dtype(_TYPES[description["componentType"]])
        self.count, self.width, self._base = int(description["count"]), width, base
        self.is_normalized = bool(description.get("normalized", False)) and base.kind != "f"
        self.is_integer = base.kind != "f" and not self.is_normalized
        self._itemsize = base.itemsize * width
        self._sparse = None
        if "sparse" in description:
            self._sparse = _sparse(asset, description["sparse"], base, width, self.count)
        self._buffer: Buffer | None = None
        if self.count < 1:
            raise ValueError(f"an attribute has {self.count} values")
        if "bufferView" not in description:
            if self._sparse is None:
                raise ValueError("an attribute has no values")
            return
        self._buffer, begin, size, stride = asset.view(description["bufferView"])
        offset = int(description.get("byteOffset", 0))
        self._stride = self._itemsize if stride is None else stride
        self._begin = begin + offset
        end = offset + self._stride * (self.count - 1) + self._itemsize
        if offset < 0 or self._stride < self._itemsize or end > size:
            raise ValueError("an attribute ends after the file")

    @property
    def is_stored(self) -> bool:
        """False where only sparse values exist; `count` then has no counterpart in the file."""
        return self._buffer is not None

    def rows(self, first: int, last: int) -> AnyArray:
        """Values [last-first, width] float64; normalized integers as shares in [0, 1] or [-1, 1]."""
        if self._buffer is None:
            values = np.zeros((last - first, self.width), self._base)
        else:
            size = (last - first - 1) * self._stride + self._itemsize
            raw = np.frombuffer(self._buffer.read(self._begin + first * self._stride, size), np.uint8)
            raw = np.concatenate([raw, np.zeros(self._stride - self._itemsize, np.uint8)])
            raw = raw.reshape(last - first, self._stride)[:, : self._itemsize]
            values = np.ascontiguousarray(raw).view(self._base)
        if self._sparse is not None:
            places, put = self._sparse
            here = (places >= first) & (places < last)
            values[places[here] - first] = put[here]
        return self.normalize(values) if self.is_normalized else values.astype(np.float64)

    def normalize(self, values: AnyArray) -> AnyArray:
        """Integers as shares of their type's largest value; floats unchanged."""
        if self._base.kind == "f":
            return values
        return np.maximum(values / float(np.iinfo(self._base).max), -1.0)

    @cached_property
    def min_value(self) -> float:
        """Minimum of all finite values."""
        part = 1 << 18
        found = [self.rows(first, min(first + part, self.count)) for first in range(0, self.count, part)]
        return min(float(np.min(rows, where=np.isfinite(rows), initial=np.inf)) for rows in found)


def _sparse(
    asset: GltfAsset, description: dict[str, Any], base: np.dtype[Any], width: int, total: int
) -> tuple[AnyArray, AnyArray]:
    """(indices [n], values [n,width]) of a sparse accessor."""
    count, indices, values = int(description["count"]), description["indices"], description["values"]
    if indices["componentType"] not in _INDEX_TYPES or not 0 <= count <= total:
        raise ValueError(f"a sparse attribute has {count} of {total} values")

    def content(part: dict[str, Any], dtype: np.dtype[Any], numbers: int) -> AnyArray:
        buffer, begin, size, _ = asset.view(part["bufferView"])
        offset = int(part.get("byteOffset", 0))
        if offset < 0 or offset + numbers * dtype.itemsize > size:
            raise ValueError("a sparse attribute ends after the file")
        return np.frombuffer(buffer.read(begin + offset, numbers * dtype.itemsize), dtype)

    places = content(indices, np.dtype(_TYPES[indices["componentType"]]), count).astype(np.int64)
    if count and places.max() >= total:
        raise ValueError("a sparse attribute has a place after its end")
    return places, content(values, base, count * width).reshape(count, width)


def _text(path: Path) -> dict[str, Any]:
    size = check_regular(path, MAX_EMBEDDED_BYTES)
    if (lacking := memory_shortage(4 * size)) is not None:
        raise ValueError(f"its text of {size} bytes is too long: {lacking}")
    return _mapping(json_text.loads(read_bytes(path, MAX_EMBEDDED_BYTES).decode("utf-8-sig")))


def _chunks(path: Path) -> tuple[dict[str, Any], tuple[int, int] | None]:
    """(JSON of a .glb, (first byte, size) of its binary chunk or None)."""
    size = check_regular(path)
    with open_regular(path) as file:
        magic, version, _ = struct.unpack("<III", file.read(12))
        if magic != MAGIC or version != 2:
            raise ValueError("it does not begin as GLB 2 does")
        length, kind = struct.unpack("<II", file.read(8))
        if kind != JSON_CHUNK or 20 + length > size:
            raise ValueError("its JSON is cut off")
        if length > MAX_TEXT_BYTES:
            raise ValueError(f"its JSON has {length} bytes, at most {MAX_TEXT_BYTES} are read")
        gltf = _mapping(json_text.loads(file.read(length)))
        head = file.read(8)
        if not head:
            return gltf, None
        length, kind = struct.unpack("<II", head)
        if kind != BIN_CHUNK or file.tell() + length > size:
            raise ValueError("its binary part is cut off")
        return gltf, (file.tell(), length)


def _mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError("its JSON is no object")
    return value
