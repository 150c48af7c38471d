"""Coherence transport: colors carried into a hole along the lines of a texture, from both sides.

The structure tensor of the colors around the hole, extended over the hole by a membrane, gives the
orientation of the lines there and their coherence: 1 for wood grain or stripes, near 0 for spots and noise.
Each column of the hole is traced along the lines to the hole's rim, both ways; the colors at both ends are
averaged with inverse lengths as weights. Coherence weights the result against the membrane of the colors.

Source: Bornemann and März, "Fast image inpainting based on coherence transport" (2007), for the idea;
Weickert, "Anisotropic diffusion in image processing" (1998), section 2.2, for the structure tensor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.compute.cancellation import check_cancelled
from cagefield.typing import Array, Mask

COLOR_DEVIATION_COLUMNS = 0.8
"""Standard deviation of the Gaussian that smooths colors, columns."""

TENSOR_DEVIATION_COLUMNS = 3.0
"""Standard deviation of the Gaussian that smooths the structure tensor, columns."""

LINE_STEP_COLUMNS = 0.5
"""Step of a traced line, columns."""

RIM_SAMPLE_COLUMNS = 12
"""Columns beyond the rim over which the color at the end of a line is averaged."""

MAX_LINE_HOLE_SIZES = 3.0
"""Maximum length of a line, in sizes of the hole."""


@dataclass(frozen=True, eq=False)
class TextureOrientation:
    """Unit directions [U,V,2] of the lines of a texture, and their coherence [U,V], 0 to 1."""

    direction: Array
    coherence: Array


def estimate_orientation(
    values: Array, given: Mask, span: Callable[[Mask, Array], Array]
) -> TextureOrientation:
    """Orientation of the texture of values [U,V] given on a mask [U,V], extended by a membrane `span`."""
    check_cancelled()
    smooth = smooth_columns(values[..., None], given)[..., 0]
    slope = np.stack([np.gradient(smooth, axis=axis) for axis in (0, 1)], axis=-1)
    interior = ndimage.binary_erosion(given, np.ones((3, 3), bool))
    tensor = np.einsum("uvi,uvj->uvij", slope, slope)[..., (0, 0, 1), (0, 1, 1)] * interior[..., None]
    share = ndimage.gaussian_filter(interior.astype(np.float64), TENSOR_DEVIATION_COLUMNS)
    tensor = (
        ndimage.gaussian_filter(tensor, (TENSOR_DEVIATION_COLUMNS, TENSOR_DEVIATION_COLUMNS, 0.0))
        / np.maximum(share, 1e-6)[..., None]
    )
    known = given & (share > 0.05)
    if not known.any():
        return TextureOrientation(np.zeros((*given.shape, 2)), np.zeros(given.shape))
    a, b, c = np.moveaxis(span(known, tensor.reshape(-1, 3)).reshape(*given.shape, 3), -1, 0)
    # The larger eigenvector is across the lines.
    angle = 0.5 * np.arctan2(2.0 * b, a - c) + 0.5 * np.pi
    anisotropy = (a - c) ** 2 + 4.0 * b**2
    coherence = anisotropy / np.maximum((a + c) ** 2, 1e-30)
    return TextureOrientation(np.stack([np.cos(angle), np.sin(angle)], axis=-1), np.clip(coherence, 0.0, 1.0))


def smooth_columns(values: Array, given: Mask) -> Array:
    """Gaussian average [U,V,C] of the values of given columns [U,V]."""
    share = ndimage.gaussian_filter(given.astype(np.float64), COLOR_DEVIATION_COLUMNS)[..., None]
    given_values = np.where(given[..., None], values, 0.0)
    return np.asarray(
        ndimage.gaussian_filter(given_values, (COLOR_DEVIATION_COLUMNS, COLOR_DEVIATION_COLUMNS, 0.0))
        / np.maximum(share, 1e-6)
    )


def transport_colors(
    unknown: Mask, given: Mask, table: Array, orientation: TextureOrientation
) -> tuple[Array, Array]:
    """(rows [M,C] of the unknown columns, their weights [M]: coherence, or 0 for a line without two ends).

    unknown, given: masks [U,V]; table [U*V,C]: values.
    """
    check_cancelled()
    start = np.argwhere(unknown)
    max_length = MAX_LINE_HOLE_SIZES * (np.sqrt(len(start)) + 1.0)
    lines = [_trace_lines(start, sign, given, orientation, max_length) for sign in (1.0, -1.0)]
    complete = np.flatnonzero(np.isfinite(lines[0].length) & np.isfinite(lines[1].length))
    rows, total = np.zeros((len(start), table.shape[1])), np.zeros(len(start))
    for line in lines:
        weight = 1.0 / np.maximum(line.length[complete], 0.5)
        rows[complete] += weight[:, None] * _rim_means(line, complete, given, table)
        total[complete] += weight
    rows[complete] /= total[complete][:, None]
    return rows, np.where(total > 0.0, orientation.coherence[unknown], 0.0)


@dataclass(frozen=True, eq=False)
class _Lines:
    """Ends [M,2] of lines, lengths [M] (inf for a line without an end), and headings [M,2] at the ends."""

    end: Array
    length: Array
    heading: Array


def _trace_lines(
    start: NDArray[np.int64], sign: float, given: Mask, orientation: TextureOrientation, max_length: float
) -> _Lines:
    """Lines from columns [M,2] along a sign of the orientation to the given columns [U,V]."""
    check_cancelled()
    positions, heading = start.astype(np.float64), sign * orientation.direction[tuple(start.T)]
    length, active = np.full(len(start), np.inf), np.arange(len(start))
    for number in range(int(max_length / LINE_STEP_COLUMNS)):
        cell = np.round(positions[active]).astype(np.int64)
        inside = ((cell >= 0) & (cell < given.shape)).all(axis=1)
        active, cell = active[inside], cell[inside]
        direction = orientation.direction[tuple(cell.T)]
        direction = direction * np.where((direction * heading[active]).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
        heading[active] = direction
        has_ended = given[tuple(cell.T)]
        length[active[has_ended]] = LINE_STEP_COLUMNS * number
        active = active[~has_ended]
        if not len(active):
            break
        positions[active] += LINE_STEP_COLUMNS * heading[active]
    return _Lines(positions, length, heading)


def _rim_means(lines: _Lines, which: NDArray[np.int64], given: Mask, table: Array) -> Array:
    """Mean values [N,C] of the given columns straight beyond the ends of some lines [N]."""
    total, count = np.zeros((len(which), table.shape[1])), np.zeros(len(which))
    for step in range(RIM_SAMPLE_COLUMNS):
        cell = np.round(lines.end[which] + step * lines.heading[which]).astype(np.int64)
        inside = ((cell >= 0) & (cell < given.shape)).all(axis=1)
        cell[~inside] = 0
        row = np.ravel_multi_index(tuple(cell.T), given.shape)
        inside &= given.reshape(-1)[row]
        total[inside] += table[row[inside]]
        count[inside] += 1.0
    return np.asarray(total / np.maximum(count, 1.0)[:, None])
