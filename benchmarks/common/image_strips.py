"""Rows of pictures with a line of text below each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from benchmarks.common.figures import floats
from cagefield.errors import CagefieldError
from cagefield.typing import UInt8

Panel = tuple[str, NDArray[Any]]
"""A caption and a picture [H,W,3], uint8 or floats in [0,1]."""

_GAP, _LINE, _FINE = 8, 20, 2
_INK = (52, 52, 56)


def strip(rows: Sequence[Sequence[Panel]]) -> UInt8:
    """The picture [H,W,3] of rows of panels of one size, captions below them; lines of a caption end in \\n.

    Raises:
        CagefieldError: no panel, or panels of different sizes.
    """
    panels = [panel for row in rows for panel in row]
    shapes = {picture.shape for _, picture in panels}
    if len(shapes) != 1:
        raise CagefieldError(f"panels must be of one size, not {sorted(shapes)}")
    height, width = shapes.pop()[:2]
    lines = max(caption.count("\n") + 1 for caption, _ in panels)
    foot = _LINE * lines + 6
    across = max(len(row) for row in rows)
    size = (across * (width + _GAP) - _GAP, len(rows) * (height + foot + _GAP) - _GAP)
    canvas = Image.new("RGB", (size[0] * _FINE, size[1] * _FINE), (255, 255, 255))
    draw = ImageDraw.Draw(canvas)
    font = ImageFont.load_default(_font_size(panels, width) * _FINE)
    for i, row in enumerate(rows):
        for j, (caption, picture) in enumerate(row):
            x, y = j * (width + _GAP), i * (height + foot + _GAP)
            pixels = Image.fromarray((255.0 * floats(picture) + 0.5).astype(np.uint8))
            larger = pixels.resize((width * _FINE, height * _FINE), Image.Resampling.NEAREST)
            canvas.paste(larger, (x * _FINE, y * _FINE))
            for number, line in enumerate(caption.split("\n")):
                at = ((x + width / 2) * _FINE, (y + height + 4 + (number + 0.5) * _LINE) * _FINE)
                draw.text(at, line, fill=_INK, font=font, anchor="mm")
    return np.asarray(canvas.resize(size, Image.Resampling.BOX))


def _font_size(panels: Sequence[Panel], width: int) -> int:
    """Largest size up to 15 at which every line fits its panel."""
    longest = [line for caption, _ in panels for line in caption.split("\n")]
    for size in range(15, 6, -1):
        if max(ImageFont.load_default(size).getlength(line) for line in longest) <= width:
            return size
    return 6


def difference(first: NDArray[Any], second: NDArray[Any], times: float) -> NDArray[np.float32]:
    """Picture [H,W,3]: white where two pictures agree, darker the more, so many times over, they differ."""
    apart = np.abs(floats(first) - floats(second)).max(axis=-1, keepdims=True)
    return np.repeat(1.0 - np.minimum(times * apart, 1.0), 3, axis=-1).astype(np.float32)
