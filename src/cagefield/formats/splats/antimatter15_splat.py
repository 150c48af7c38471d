"""Splat files of antimatter15 (.splat): 32 bytes per splat, without a header.

Position (3 float32), linear scales (3 float32), color and opacity (4 uint8: .5 + C0 times the coefficient of
degree 0, in [0, 1]), rotation (4 uint8, w x y z: 128 + 128 q). No harmonics.

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
from cagefield.formats.splats.axes import PLY_AXES
from cagefield.formats.splats.detection import is_text
from cagefield.formats.splats.splat_table import BATCH_SPLATS, OnProgress, SplatBatch, SplatSource, SplatTable

_SAMPLE_SPLATS = 4096
_MAX_COORDINATE = 1e12
_MAX_LENGTH_ERROR = 0.1
"""Maximum error of a quaternion's length: 4 components of 8 bits, with 1 clipped to 127/128."""

_ROW = np.dtype([("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rotation", "u1", 4)])


def open_splat_rows(path: Path) -> SplatSource:
    """Open .splat file.

    Raises:
        FieldError: a size that is no multiple of 32 bytes, or rows that are no splats.
    """
    size = check_regular(path)
    if not size or size % _ROW.itemsize:
        raise FieldError(f"{path}: {size} bytes are no whole number of splats of 32; copy the file again")
    count = size // _ROW.itemsize
    if not _is_plausible(path, count):
        raise FieldError(
            f"{path}: no .splat, most of its rows of 32 bytes are no splats (scales below 0, rotations that "
            "are not of length 1); it is another kind of file"
        )

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, count, BATCH_SPLATS):
            rows = read_array(path, _ROW, min(BATCH_SPLATS, count - first), offset=first * _ROW.itemsize)
            yield decode_rows(rows["mean"], rows["scale"], rows["rgba"], rows["rotation"])

    return SplatSource(path, count, 0, PLY_AXES, batches)


def _is_plausible(path: Path, count: int) -> bool:
    """Whether at least half of the sampled rows are splats; about one in a hundred of random bytes is.

    Rows from the beginning, the middle and the end need finite means and scales, scales >= 0, and a
    quaternion of length 1 or 0 within its 8 bits. Text is never plausible.
    """
    sample_count = min(_SAMPLE_SPLATS, count)
    starts = {0, (count - sample_count) // 2, count - sample_count}
    rows = np.concatenate([read_array(path, _ROW, sample_count, offset=at * _ROW.itemsize) for at in starts])
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm((rows["rotation"].astype(np.float64) - 128.0) / 128.0, axis=1)
        is_splat = np.isfinite(rows["mean"]).all(axis=1) & (np.abs(rows["mean"]) < _MAX_COORDINATE).all(
            axis=1
        )
        is_splat &= ((rows["scale"] >= 0.0) & (rows["scale"] < _MAX_COORDINATE)).all(axis=1)
    is_splat &= (np.abs(length - 1.0) < _MAX_LENGTH_ERROR) | (length < _MAX_LENGTH_ERROR)
    return bool(2 * is_splat.sum() >= len(rows)) and not is_text(rows.tobytes()[:4096])


def decode_rows(mean, scale, rgba, rotation) -> SplatBatch:  # type: ignore[no-untyped-def]
    """Splats of means, linear scales, colors and opacities in 8 bits, and rotations in 8 bits."""
    with np.errstate(divide="ignore", invalid="ignore"):
        log_scales = np.log(scale.astype(np.float64))
    color = (rgba[:, :3] / 255.0 - 0.5) / spherical_harmonics.C0
    quaternions = (rotation.astype(np.float64) - 128.0) / 128.0
    return SplatBatch(mean, log_scales, quaternions, rgba[:, 3] / 255.0, color[:, None])


def write_splat_rows(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Write the splats in their order, complete or not at all, without harmonics."""
    with replaced_file(path) as temporary, temporary.open("wb") as out:
        done = 0
        for batch in table.batches():
            rows = np.zeros(len(batch), _ROW)
            rows["mean"], rows["scale"] = batch.means, np.exp(batch.log_scales)
            color = batch.sh[:, 0].astype(np.float64) * spherical_harmonics.C0 + 0.5
            rgba = np.concatenate([color, batch.opacities[:, None]], axis=1)
            rows["rgba"] = np.clip(rgba * 255.0 + 0.5, 0, 255)
            rows["rotation"] = np.clip(np.round(batch.quaternions.astype(np.float64) * 128.0 + 128.0), 0, 255)
            out.write(rows.tobytes())
            done += len(batch)
            on_progress(done / table.count)
