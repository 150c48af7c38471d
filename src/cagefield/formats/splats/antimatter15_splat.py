"""antimatter15's .splat: 32 bytes a splat, nothing else.

Position (3 float32), scales (3 float32, not logarithms), colour and opacity (4 uint8: .5 + C0 times the
coefficient of degree 0, in [0, 1]), rotation (4 uint8, w x y z: 128 + 128 q). No harmonics, no header.

Source: antimatter15/splat, convert.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import check_regular, read_array
from cagefield.formats.splats.axes import PLY
from cagefield.formats.splats.detection import is_text
from cagefield.formats.splats.splat_table import BATCH, OnProgress, SplatBatch, SplatSource, SplatTable

_SAMPLE = 4096
_MAX_COORDINATE = 1e12
_LENGTH_ERROR = 0.1
"""Error of a rotation's length: 4 numbers of 8 bits, and 1 that is cut to 127/128."""

_ROW = np.dtype([("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rotation", "u1", 4)])


def open_splat_rows(path: Path) -> SplatSource:
    """The splats of a .splat file.

    Raises:
        FieldError: a size that is no multiple of 32 bytes.
    """
    size = check_regular(path)
    if not size or size % _ROW.itemsize:
        raise FieldError(f"{path}: {size} bytes are no whole number of splats of 32; copy the file again")
    count = size // _ROW.itemsize
    if not _plausible(path, count):
        raise FieldError(
            f"{path}: no .splat, most of its rows of 32 bytes are no splats (scales below 0, rotations that "
            "are not of length 1); it is another kind of file"
        )

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, count, BATCH):
            rows = read_array(path, _ROW, min(BATCH, count - first), offset=first * _ROW.itemsize)
            yield of_rows(rows["mean"], rows["scale"], rows["rgba"], rows["rotation"])

    return SplatSource(path, count, 0, PLY, batches)


def _plausible(path: Path, count: int) -> bool:
    """Whether at least half of some rows are splats, as about one in a hundred of random bytes is.

    Rows from the beginning, the middle and the end: finite means and scales, no scale below 0, a rotation of
    length 1 or 0 to within its 8 bits. Text is none, whatever its numbers.
    """
    taken = min(_SAMPLE, count)
    places = {0, (count - taken) // 2, count - taken}
    rows = np.concatenate([read_array(path, _ROW, taken, offset=at * _ROW.itemsize) for at in places])
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm((rows["rotation"].astype(np.float64) - 128.0) / 128.0, axis=1)
        good = np.isfinite(rows["mean"]).all(axis=1) & (np.abs(rows["mean"]) < _MAX_COORDINATE).all(axis=1)
        good &= ((rows["scale"] >= 0.0) & (rows["scale"] < _MAX_COORDINATE)).all(axis=1)
    good &= (np.abs(length - 1.0) < _LENGTH_ERROR) | (length < _LENGTH_ERROR)
    return bool(2 * good.sum() >= len(rows)) and not is_text(rows.tobytes()[:4096])


def of_rows(mean, scale, rgba, rotation) -> SplatBatch:  # type: ignore[no-untyped-def]
    """Splats of means, linear scales, colours and opacities in 8 bits, and rotations in 8 bits."""
    with np.errstate(divide="ignore", invalid="ignore"):
        log_scales = np.log(scale.astype(np.float64))
    colour = (rgba[:, :3] / 255.0 - 0.5) / spherical_harmonics.C0
    quaternions = (rotation.astype(np.float64) - 128.0) / 128.0
    return SplatBatch(mean, log_scales, quaternions, rgba[:, 3] / 255.0, colour[:, None])


def write_splat_rows(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Writes the splats in their order, complete or not at all; harmonics are left out."""
    with replaced_file(path) as temporary, temporary.open("wb") as out:
        done = 0
        for batch in table.batches():
            rows = np.zeros(len(batch), _ROW)
            rows["mean"], rows["scale"] = batch.means, np.exp(batch.log_scales)
            colour = batch.sh[:, 0].astype(np.float64) * spherical_harmonics.C0 + 0.5
            rgba = np.concatenate([colour, batch.opacities[:, None]], axis=1)
            rows["rgba"] = np.clip(rgba * 255.0 + 0.5, 0, 255)
            rows["rotation"] = np.clip(np.round(batch.quaternions.astype(np.float64) * 128.0 + 128.0), 0, 255)
            out.write(rows.tobytes())
            done += len(batch)
            on_progress(done / table.count)
