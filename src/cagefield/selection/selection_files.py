"""Selections as values of JSON files."""

from __future__ import annotations

import base64
import binascii
import zlib
from typing import Any

import numpy as np

from cagefield.errors import CagefieldError
from cagefield.selection.element_selection import Selection

MAX_ELEMENTS = 1 << 31
"""Elements of a selection that is read, at most."""


def dump_selection(selection: Selection) -> dict[str, Any]:
    """JSON value of a selection: its total, its count, and its mask, packed, compressed, in base64."""
    return {
        "total": selection.total,
        "count": selection.count,
        "mask": base64.b64encode(selection.bits).decode("ascii"),
    }


def parse_selection(value: Any, total: int | None = None) -> Selection:
    """Selection of a JSON value, see `dump_selection`; of `total` elements, where that is given.

    Raises CagefieldError for anything else.
    """
    if not isinstance(value, dict) or not {"total", "count", "mask"} <= value.keys():
        raise CagefieldError("a selection has total, count and mask")
    size, count, text = value["total"], value["count"], value["mask"]
    if not all(isinstance(n, int) and not isinstance(n, bool) for n in (size, count)):
        raise CagefieldError("a selection's total and count must be whole numbers")
    if not 0 <= count <= size <= MAX_ELEMENTS or not isinstance(text, str):
        raise CagefieldError(f"a selection of {count} of {size} elements is not possible")
    if total is not None and size != total:
        raise CagefieldError(f"the selection is of a field of {size} elements, this one has {total}")
    length = -(-size // 8)
    try:
        stream = zlib.decompressobj()
        packed = stream.decompress(base64.b64decode(text, validate=True), length + 1)
    except (binascii.Error, ValueError, zlib.error) as error:
        raise CagefieldError(f"a selection's mask cannot be read ({error})") from None
    if len(packed) != length:
        raise CagefieldError(f"a selection's mask has {len(packed)} bytes, {length} are needed")
    found = Selection.from_mask(np.unpackbits(np.frombuffer(packed, np.uint8), count=size).astype(bool))
    if found.count != count:
        raise CagefieldError(f"a selection's mask has {found.count} elements, its count is {count}")
    return found
