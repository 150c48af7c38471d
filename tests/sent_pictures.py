"""Pictures as they are sent to pages, taken apart again."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from PIL import Image


def pixels_of(content: bytes, form: str, width: int, height: int) -> np.ndarray[Any, Any]:
    """RGB pixels [height,width,3] uint8 of a picture in one of the protocol's formats."""
    if form == "rgb":
        return np.frombuffer(content, np.uint8).reshape(height, width, 3)
    pixels = np.asarray(Image.open(io.BytesIO(content)))
    assert pixels.shape == (height, width, 3)
    return pixels
