"""Color profiles for tests, written out from ICC.1:2010."""

from __future__ import annotations

import struct

DISPLAY_P3 = ((0.51512, 0.24120, -0.00105), (0.29198, 0.69225, 0.04189), (0.15710, 0.06657, 0.78407))
"""Red, green and blue of Display P3 in XYZ, adapted to D50."""

SRGB = ((0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410))

_D50 = (0.9642, 1.0, 0.8249)
_RGB = (b"r", b"g", b"b")


def matrix_profile(name: str, primaries: tuple[tuple[float, float, float], ...]) -> bytes:
    """A display profile of these primaries (XYZ, D50) with the transfer function of sRGB."""

    def numbers(*values: float) -> bytes:
        return b"".join(struct.pack(">i", round(value * 65536)) for value in values)

    text = name.encode("utf-16-be")
    curve = b"para\0\0\0\0\0\x03\0\0" + numbers(2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
    tags = {
        b"desc": b"mluc\0\0\0\0" + struct.pack(">II4sII", 1, 12, b"enUS", len(text), 28) + text,
        b"wtpt": b"XYZ \0\0\0\0" + numbers(*_D50),
        **{
            c + b"XYZ": b"XYZ \0\0\0\0" + numbers(*xyz)
            for c, xyz in zip((b"r", b"g", b"b"), primaries, strict=True)
        },
        **{c + b"TRC": curve for c in _RGB},
    }
    place, table, content = 128 + 4 + 12 * len(tags), b"", b""
    for tag, value in tags.items():
        table += struct.pack(">4sII", tag, place + len(content), len(value))
        content += value + bytes(-len(value) % 4)
    body = struct.pack(">I", len(tags)) + table + content
    head = struct.pack(">I4sI", 128 + len(body), b"\0\0\0\0", 0x04300000) + b"mntrRGB XYZ "
    head += struct.pack(">6H", 2020, 1, 1, 0, 0, 0) + b"acsp" + bytes(28) + numbers(*_D50) + bytes(48)
    return head + body
