"""Sparse points from PLY files, as nerfstudio writes them beside transforms.json."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cagefield.datasets.views import SparsePoints
from cagefield.errors import DatasetError, FieldError
from cagefield.files.ply import read_ply

_GRAY_VALUE = 128


def read_points(path: Path) -> SparsePoints:
    """Vertices of a PLY file: x, y, z, and red, green, blue (0 to 255), gray where it has no colors.

    Rows that are not finite are left out.

    Raises DatasetError where the file is missing or damaged, or has no positions.
    """
    try:
        vertex = read_ply(path).elements.get("vertex", {})
    except FieldError as error:
        raise DatasetError(str(error).replace("; give a .ply of splats", "")) from None
    if any(name not in vertex for name in "xyz"):
        raise DatasetError(f"{path}: its vertices have no x, y, z; export the points again")
    positions = np.stack([vertex[name].astype(np.float64) for name in "xyz"], axis=1)
    names = ("red", "green", "blue")
    if all(name in vertex for name in names):
        rgb = np.stack([vertex[name].clip(0, 255).astype(np.uint8) for name in names], axis=1)
    else:
        rgb = np.full(positions.shape, _GRAY_VALUE, dtype=np.uint8)
    finite = np.isfinite(positions).all(axis=1)
    return SparsePoints(positions[finite], rgb[finite])
