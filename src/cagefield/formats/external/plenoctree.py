"""PlenOctrees, `.npz`, as sxyu/svox saves them.

    child int32 [M,2,2,2], data float16 [M,2,2,2,K], offset [3], invradius3 [3] or invradius,
    data_dim K, data_format "SH9" (or "RGBA"), n_internal, parent_depth, ...

Octrees with quantized colors (quant_colors, quant_map) and other bases (SG, ASG) are not read. No file of the
authors' was at hand: the layout is that of their source.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.plenoctree import PlenOctreeField
from cagefield.files.npz import DEFLATED, read_arrays
from cagefield.formats.external.checkpoint import ExternalCheckpoint

MAX_LEAVES_INFLATION = 200
"""Maximum ratio of an array's size to the file's: leaves of empty space compress well."""

_Headers = dict[str, tuple[tuple[int, ...], np.dtype[Any]]]


def is_plenoctree(headers: _Headers) -> bool:
    """Whether an .npz with these arrays is a PlenOctree."""
    return "child" in headers and "parent_depth" in headers


def read_plenoctree(path: Path, headers: _Headers) -> ExternalCheckpoint:
    """Field of a PlenOctree, whose arrays have these (shape, type).

    Raises:
        FieldError: arrays that do not fit each other, other bases, sizes beyond the file's.
        ValueError: a damaged file. OSError: it cannot be read.
    """
    if "data" not in headers:
        compressed = " (its colors are quantized)" if "quant_colors" in headers else ""
        raise FieldError(f"data is missing{compressed}; give the octree as svox saves it, uncompressed")
    file_bytes = path.stat().st_size
    for name in ("child", "data"):
        shape, kind = headers[name]
        size = math.prod(shape) * kind.itemsize
        if kind.kind != {"child": "i", "data": "f"}[name] or size > MAX_LEAVES_INFLATION * file_bytes:
            raise FieldError(f"{name} says that it is {kind} {list(shape)}; the file has {file_bytes} bytes")
    scale_name = "invradius3" if "invradius3" in headers else "invradius"
    names = {"child", "data", "offset", scale_name, "data_format"}
    for name in names & headers.keys() - {"child", "data"}:
        if math.prod(headers[name][0]) > 3 or headers[name][1].itemsize > 256:
            raise FieldError(f"{name} must hold up to 3 values, got {list(headers[name][0])}")
    arrays = read_arrays(path, DEFLATED, names)
    scale = _vector(arrays, scale_name)
    field = PlenOctreeField(
        arrays["child"],
        arrays["data"],
        scale,
        _vector(arrays, "offset"),
        _terms(arrays, headers["data"][0]),
    )
    return ExternalCheckpoint(
        field,
        field.describe(),
        notes=("background: white is assumed, the file does not hold it",),
    )


def _terms(arrays: dict[str, NDArray[Any]], shape: tuple[int, ...]) -> int:
    """Number of spherical harmonics in the format's name, 0 for RGBA."""
    width = shape[-1] if shape else 0
    if "data_format" not in arrays:
        return 0 if width == 4 else (width - 1) // 3
    text = str(arrays["data_format"].reshape(-1)[0]) if arrays["data_format"].size else ""
    if text == "RGBA":
        return 0
    match = re.fullmatch(r"SH(\d{1,2})", text)
    if match is None:
        raise FieldError(
            f"data_format is {text!r:.40}; only RGBA and SH1 to SH25 are read, extract such an octree"
        )
    return int(match.group(1))


def _vector(arrays: dict[str, NDArray[Any]], name: str) -> NDArray[np.float64]:
    if name not in arrays or arrays[name].dtype.kind not in "fi" or arrays[name].size not in (1, 3):
        raise FieldError(f"{name} must be 3 numbers")
    return np.broadcast_to(arrays[name].astype(np.float64).reshape(-1), (3,)).copy()
