"""The digger's traffic cone as the editor's tests see it: where it is, how large and how it leans.

It is the only thing of its orange-red in the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

EDITS = """\
version: 1
edits:
  - name: cone
    inner: {center: [0.65, 0.5, -0.215], size: [0.34, 0.32, 0.36]}
    outer: {margin: 0.35}
    lattice: 32
    relight: none
"""
"""The cone stands on the ground at z = -.4; its tip is at z = -.05."""


@dataclass
class Cone:
    """Orange-red pixels of a picture: their number, middle (column, row) and lean in degrees."""

    area: int
    at: NDArray[np.float64]
    lean: float


def cone(picture: NDArray[np.float64]) -> Cone:
    """The cone in a picture [H,W,3] in [0,1]."""
    red, green, blue = np.moveaxis(picture, -1, 0)
    rows, columns = np.nonzero((red > 0.7) & (green < 0.5 * red) & (blue < 0.45 * red))
    if len(rows) < 5:
        return Cone(len(rows), np.full(2, np.nan), np.nan)
    points = np.stack([columns, rows], axis=1).astype(np.float64)
    values, vectors = np.linalg.eigh(np.cov(points.T))
    long = vectors[:, np.argmax(values)]
    return Cone(len(rows), points.mean(axis=0), float(np.degrees(np.arctan2(long[0], long[1])) % 180.0))


def moved(before: Any, after: Any) -> NDArray[np.float64]:
    """By how much each corner [8,3] has moved."""
    return np.asarray(after) - np.asarray(before)


def difference(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Largest difference of two pictures."""
    return float(np.abs(a - b).max())


def enlarged(picture: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """A picture [H,W,3] in [0,1] as one of fewer pixels shows it, through whose middles its rays go."""
    down, across = picture.shape[:2]
    rows = ((np.arange(height) + 0.5) * down / height).astype(int)
    columns = ((np.arange(width) + 0.5) * across / width).astype(int)
    small = Image.fromarray(np.uint8(np.rint(255.0 * picture[rows][:, columns])))
    return np.asarray(small.resize((across, down), Image.Resampling.BILINEAR), dtype=np.float64) / 255.0
