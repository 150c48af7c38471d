"""How many numbers the tags of a TIFF file hold, before pillow makes Python's of all of them.

Source: Adobe, "TIFF", revision 6.0 (1992), section 2; BigTIFF has 8 bytes for offsets and counts.
"""

from __future__ import annotations

import struct
from typing import BinaryIO

_ALWAYS, _DENSEST = 1 << 18, 64
"""Numbers that any file may have, and bytes of the file for each of them where it has more.

A picture in strips or tiles has two of each, and their pixels; pillow takes 40 bytes for a number.
"""

_WEIGHTS = {3: 1, 4: 1, 5: 8, 6: 1, 8: 1, 9: 1, 10: 8, 11: 1, 12: 1, 13: 1, 16: 1}
"""Of the types whose values become numbers, what each takes; those of 5 and 10 become fractions."""


def check_tags(file: BinaryIO, size: int) -> None:
    """Passes where an open file is no TIFF, or the first picture's tags hold few numbers beside its bytes.

    The file then stands at its beginning. Raises ValueError.
    """
    start = file.read(16)
    order = {b"II": "<", b"MM": ">"}.get(start[:2])
    if order is not None and len(start) == 16 and 42 in start[2:4]:
        _check(file, size, struct.unpack_from(order + "L", start, 4)[0], order, ("H", "HHL4x"))
    elif order is not None and len(start) == 16 and 43 in start[2:4]:
        _check(file, size, struct.unpack_from(order + "Q", start, 8)[0], order, ("Q", "HHQ8x"))
    file.seek(0)


def _check(file: BinaryIO, size: int, begin: int, order: str, forms: tuple[str, str]) -> None:
    """The same of the directory that begins at a byte; `forms` are those of its length and of a tag."""
    length, tag = (struct.Struct(order + form) for form in forms)
    if begin > size - length.size:
        return  # pillow says that it is cut off
    file.seek(begin)
    (count,) = length.unpack(file.read(length.size))
    most, numbers = max(_ALWAYS, size // _DENSEST), 0
    for _ in range(min(count, size // tag.size)):
        entry = file.read(tag.size)
        if len(entry) < tag.size:
            return
        _, kind, values = tag.unpack(entry)
        numbers += _WEIGHTS.get(kind, 0) * values if values <= size else 0  # more than there are: left out
        if numbers > most:
            raise ValueError(f"its tags hold {numbers} numbers in a file of {size} bytes; it is damaged")
