"""Where the pixels of a JPEG file end.

libjpeg makes up what is missing before the mark at the end: a file of 900 kB whose header is damaged becomes
50 million grey pixels. Without that mark it says that the file is cut off.

Source: ITU-T T.81 (1992), annex B.
"""

from __future__ import annotations

import re
from typing import BinaryIO

_SINGLE = (0xC0, 0xC1)
"""Marks of frames that are decoded as they are read, if in one scan; others need the mark at the end."""

_FRAMES = (*range(0xC0, 0xC4), *range(0xC5, 0xC8), *range(0xC9, 0xCC), *range(0xCD, 0xD0))
_SCAN, _END = 0xDA, 0xD9
_NO_LENGTH = (0x01, *range(0xD0, 0xD9))

_MARK = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]")
"""What ends the pixels: marks of restarts are among them."""

_PART = 1 << 16


def end_of_pixels(file: BinaryIO) -> int | None:
    """The byte after the pixels of a file that stands at its beginning; None where it has several scans.

    None too for a file that is damaged.
    """
    parts = 0
    file.seek(2)
    while True:
        mark = file.read(2)
        while mark == b"\xff\xff":
            mark = mark[1:] + file.read(1)
        if len(mark) < 2 or mark[0] != 0xFF or mark[1] == _END:
            return None
        if mark[1] in _NO_LENGTH:
            continue
        length = int.from_bytes(file.read(2), "big")
        content = file.read(max(0, length - 2))
        if mark[1] in _FRAMES:
            if mark[1] not in _SINGLE or len(content) < 6:
                return None
            parts = content[5]
        elif mark[1] == _SCAN:
            return _next_mark(file) if content[:1] == bytes([parts]) else None


def _next_mark(file: BinaryIO) -> int | None:
    """The byte at which the next mark begins, None where there is none."""
    begin, held = file.tell(), b""
    while part := file.read(_PART):
        held = held[-1:] + part
        if (found := _MARK.search(held)) is not None:
            return begin + found.start() - (len(held) - len(part))
        begin += len(part)
    return None
