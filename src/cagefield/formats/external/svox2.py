"""Plenoxels of svox2, `.npz`, as a VoxelField.

    radius [3], center [3]   the grid's box is center -+ radius, divided into X x Y x Z cells
    links int32 [X,Y,Z]      row of each cell's values, below 0 where it is empty
    density_data [N,1], sh_data [N,3 B]   density per world unit, B coefficients of each channel in turn
    data [N,1+3B]            both, in older files
    basis_type               1: spherical harmonics; 4 and 255: learned bases, which are not read
    background_links, background_data   multi-sphere images around the grid, which are left out

Values sit at the cells' centers; between them sigma = relu(trilinear), rgb = max(0, Y . trilinear + 1/2):
our voxels' function, with two differences: ours clips colors at 1, and is empty in the outer half of the
outermost cells, where svox2 continues the values at their centers.

Source: github.com/sxyu/svox2, svox2/svox2.py (save, load, _volume_render_gradcheck_lerp).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.datasets.nerf_normalization import Similarity
from cagefield.errors import FieldError
from cagefield.fields.voxel_field import VoxelField
from cagefield.files.npz import DEFLATED, read_arrays
from cagefield.formats.external.checkpoint import ExternalCheckpoint

SCENE_SCALE = 2.0 / 3.0
"""svox2's factor of the camera positions of NeRF-synthetic data, where its --scene_scale is left out."""

MAX_CELLS, MAX_CELLS_PER_ROW = 1 << 27, 1000
"""Cells of a grid without minimum occupancy (512^3), and maximum per stored row beyond."""

MAX_INFLATION = 64
"""Maximum ratio of the stored rows' size to the file's; trained values hardly compress."""

_SPHERICAL_HARMONICS = 1
_LEARNED = {4: "a learned texture", 255: "a learned MLP"}
_GRID = ("radius", "center", "links", "basis_type")
_Headers = dict[str, tuple[tuple[int, ...], np.dtype[Any]]]


def is_svox2(headers: _Headers) -> bool:
    """Whether an .npz with these arrays is a grid of svox2."""
    return "links" in headers and ("density_data" in headers or "data" in headers)


def read_svox2(path: Path, headers: _Headers) -> ExternalCheckpoint:
    """Voxels of a grid of svox2, whose arrays have these (shape, type).

    Raises:
        FieldError: arrays that do not fit each other, a learned basis, degrees above 2, sizes beyond the
            file's.
        ValueError: a damaged file. OSError: it cannot be read.
    """
    names = ("data",) if "density_data" not in headers else ("density_data", "sh_data")
    rows = _check_headers(headers, names, path.stat().st_size)
    arrays = read_arrays(path, DEFLATED, {*_GRID, *names})
    _check_basis(arrays, headers)
    density, coefficients = _values(arrays)
    links = arrays["links"]
    flat = links.reshape(-1)
    vertices = np.flatnonzero(flat >= 0)
    taken = flat[vertices]
    if len(vertices) == 0:
        raise FieldError("all links are below 0: the grid is empty")
    if taken.max() >= rows:
        raise FieldError(f"links point to row {int(taken.max())}, the grid has {rows} rows")
    radius, center = _vector(arrays, "radius", 1.0), _vector(arrays, "center", 0.0)
    if not (radius > 0).all():
        raise FieldError(f"radius must be above 0, got {radius.tolist()}")
    half = radius * (1.0 - 1.0 / np.array(links.shape))
    terms = coefficients.shape[1] // 3
    field = VoxelField(
        np.stack([center - half, center + half]),
        links.shape,
        vertices,
        density[taken],
        coefficients[taken].reshape(-1, 3, terms).transpose(0, 2, 1),
    )
    shape = " x ".join(map(str, links.shape))
    return ExternalCheckpoint(
        field,
        f"svox2: {shape} cells, {len(vertices)} stored, SH degree {field.sh_degree}",
        notes=tuple(_notes(headers, links.shape, vertices, density[taken])),
        world=Similarity(np.eye(4), SCENE_SCALE),
        distance=4.0 * SCENE_SCALE * float(radius.max()),
    )


def _check_headers(headers: _Headers, names: tuple[str, ...], file_bytes: int) -> int:
    """Number of rows, after a check of all shapes, before anything is read."""
    shape, kind = headers["links"]
    if len(shape) != 3 or min(shape) < 2 or max(shape) > 2048 or kind.kind != "i":
        raise FieldError(f"links must be integers [X,Y,Z] from 2 to 2048, got {kind} {list(shape)}")
    counts = set()
    for name in names:
        if name not in headers:
            raise FieldError(f"{name} is missing")
        size, kind = headers[name]
        if len(size) != 2 or kind.kind != "f":
            raise FieldError(f"{name} must be floats [N,C], got {kind} {list(size)}")
        counts.add(size[0])
        if math.prod(size) * kind.itemsize > MAX_INFLATION * file_bytes:
            raise FieldError(
                f"{name} says that it holds {list(size)} numbers, the file has {file_bytes} bytes"
            )
    if len(counts) != 1:
        raise FieldError(f"density_data and sh_data have {' and '.join(map(str, sorted(counts)))} rows")
    rows = counts.pop()
    cells = math.prod(shape)
    if cells > max(MAX_CELLS, MAX_CELLS_PER_ROW * rows):
        raise FieldError(
            f"a grid of {' x '.join(map(str, shape))} cells with {rows} rows; resample it coarser"
        )
    for name in ("radius", "center", "basis_type"):
        if name in headers and math.prod(headers[name][0]) > 3:
            raise FieldError(f"{name} must hold up to 3 numbers, got shape {list(headers[name][0])}")
    return rows


def _check_basis(arrays: dict[str, NDArray[Any]], headers: _Headers) -> None:
    basis = _SPHERICAL_HARMONICS
    if "basis_type" in arrays:
        if arrays["basis_type"].size != 1 or arrays["basis_type"].dtype.kind not in "iu":
            raise FieldError("basis_type must be a whole number")
        basis = int(arrays["basis_type"].reshape(())[()])
    if basis == _SPHERICAL_HARMONICS and "basis_data" not in headers:
        return
    found = _LEARNED.get(basis, "a learned texture" if "basis_data" in headers else "an unknown basis")
    raise FieldError(
        f"basis_type is {basis}: colors have {found}, which is not read; train with "
        "spherical harmonics (svox2: --basis_type sh)"
    )


def _values(arrays: dict[str, NDArray[Any]]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(density [N], coefficients [N, 3 B]) of either layout."""
    if "data" in arrays:
        density, coefficients = arrays["data"][:, :1], arrays["data"][:, 1:]
    else:
        density, coefficients = arrays["density_data"], arrays["sh_data"]
    if density.shape[1:] != (1,) or coefficients.shape[1] not in (3, 12, 27):
        raise FieldError(
            "expected density [N,1] and 3, 12 or 27 color coefficients (SH degree 0 to 2), got "
            f"{list(density.shape)} and {list(coefficients.shape)}"
        )
    return density[:, 0].astype(np.float32), coefficients.astype(np.float32)


def _vector(arrays: dict[str, NDArray[Any]], name: str, default: float) -> NDArray[np.float64]:
    if name not in arrays:
        return np.full(3, default)
    values = arrays[name]
    if values.shape != (3,) or values.dtype.kind not in "fi" or not np.isfinite(values).all():
        raise FieldError(f"{name} must be 3 finite numbers, got shape {list(values.shape)}")
    return values.astype(np.float64)


def _notes(
    headers: _Headers, shape: tuple[int, ...], vertices: NDArray[Any], density: NDArray[np.float32]
) -> list[str]:
    notes = []
    if "background_data" in headers:
        layers = headers["background_data"][0][1] if len(headers["background_data"][0]) > 1 else 0
        notes.append(f"left out: the background, {layers} layers of multi-sphere images around the grid")
    places = np.unravel_index(vertices, shape)
    border = np.zeros(len(vertices), bool)
    for place, count in zip(places, shape, strict=True):
        border |= (place == 0) | (place == count - 1)
    dense = int((border & (density > 0)).sum())
    if dense:
        notes.append(f"left out: the outer half of {dense} cells with density on the grid's border")
    notes.append(
        f"cameras: positions times {SCENE_SCALE:.3g}, as svox2 scales NeRF-synthetic data; of another "
        "training give its factor (--data-scale)"
    )
    notes.append("background: white is assumed, the file does not hold it")
    return notes
