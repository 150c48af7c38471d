"""Grain goes on through a hole: colours that come along the lines of a texture from both sides of it.

The structure tensor of the colours around, spanned over the hole by a membrane, has the direction of the
lines there, and how alike they are: 1 for wood's grain or stripes, near 0 for spots and noise. Every column
of the hole is followed along the lines to the hole's rim, both ways, and mixes what is there by nearness.
The more alike lines are, the more that counts against the membrane of the colours themselves.

Source: Bornemann and März, "Fast image inpainting based on coherence transport" (2007), for the idea;
Weickert, "Anisotropic diffusion in image processing" (1998), section 2.2, for the structure tensor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.typing import Array, Mask

COLOR_DEVIATION_COLUMNS = 0.8
"""Standard deviation of the Gaussian that smooths colors, columns."""

TENSOR_DEVIATION_COLUMNS = 3.0
"""Standard deviation of the Gaussian that smooths the structure tensor, columns."""

LINE_STEP_COLUMNS = 0.5
"""Columns from one point of a line to the next."""

RIM_SAMPLE_COLUMNS = 12
"""Columns beyond the rim whose mean is what a line brings along."""

MAX_LINE_HOLE_SIZES = 3.0
"""Lines that go on for longer than so many times the hole's size lead nowhere."""


@dataclass(frozen=True, eq=False)
class TextureOrientation:
    """Unit directions [U,V,2] of the lines of a texture, and how alike these are [U,V]: 0 to 1."""

    along: Array
    alike: Array


def estimate_orientation(
    values: Array, given: Mask, span: Callable[[Mask, Array], Array]
) -> TextureOrientation:
    """The grain of values [U,V] where they are given [U,V], and beyond, by a membrane `span`."""
    smooth = smooth_columns(values[..., None], given)[..., 0]
    slope = np.stack([np.gradient(smooth, axis=axis) for axis in (0, 1)], axis=-1)
    whole = ndimage.binary_erosion(given, np.ones((3, 3), bool))
    tensor = np.einsum("uvi,uvj->uvij", slope, slope)[..., (0, 0, 1), (0, 1, 1)] * whole[..., None]
    share = ndimage.gaussian_filter(whole.astype(np.float64), TENSOR_DEVIATION_COLUMNS)
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
    apart = (a - c) ** 2 + 4.0 * b**2
    alike = apart / np.maximum((a + c) ** 2, 1e-30)
    return TextureOrientation(np.stack([np.cos(angle), np.sin(angle)], axis=-1), np.clip(alike, 0.0, 1.0))


def smooth_columns(values: Array, given: Mask) -> Array:
    """Values [U,V,C] of columns, each a mean of those nearby that are given [U,V]."""
    share = ndimage.gaussian_filter(given.astype(np.float64), COLOR_DEVIATION_COLUMNS)[..., None]
    own = np.where(given[..., None], values, 0.0)
    return np.asarray(
        ndimage.gaussian_filter(own, (COLOR_DEVIATION_COLUMNS, COLOR_DEVIATION_COLUMNS, 0.0))
        / np.maximum(share, 1e-6)
    )


def transport_colors(
    unknown: Mask, given: Mask, table: Array, grain: TextureOrientation
) -> tuple[Array, Array]:
    """(rows [M,C] for the unknown columns, how much they count [M]: 0 where a line has no two ends).

    unknown, given [U,V]; table [U*V,C].
    """
    start = np.argwhere(unknown)
    longest = MAX_LINE_HOLE_SIZES * (np.sqrt(len(start)) + 1.0)
    lines = [_trace_lines(start, sign, given, grain, longest) for sign in (1.0, -1.0)]
    ended = np.flatnonzero(np.isfinite(lines[0].length) & np.isfinite(lines[1].length))
    rows, total = np.zeros((len(start), table.shape[1])), np.zeros(len(start))
    for line in lines:
        weight = 1.0 / np.maximum(line.length[ended], 0.5)
        rows[ended] += weight[:, None] * _rim_means(line, ended, given, table)
        total[ended] += weight
    rows[ended] /= total[ended][:, None]
    return rows, np.where(total > 0.0, grain.alike[unknown], 0.0)


@dataclass(frozen=True, eq=False)
class _Lines:
    """Where lines end [M,2], their lengths [M], inf of those that lead nowhere, and headings [M,2] there."""

    end: Array
    length: Array
    heading: Array


def _trace_lines(
    start: NDArray[np.int64], sign: float, given: Mask, grain: TextureOrientation, longest: float
) -> _Lines:
    """Lines from columns [M,2] to what is given [U,V]."""
    at, heading = start.astype(np.float64), sign * grain.along[tuple(start.T)]
    length, going = np.full(len(start), np.inf), np.arange(len(start))
    for number in range(int(longest / LINE_STEP_COLUMNS)):
        cell = np.round(at[going]).astype(np.int64)
        inside = ((cell >= 0) & (cell < given.shape)).all(axis=1)
        going, cell = going[inside], cell[inside]
        along = grain.along[tuple(cell.T)]
        along = along * np.where((along * heading[going]).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
        heading[going] = along
        there = given[tuple(cell.T)]
        length[going[there]] = LINE_STEP_COLUMNS * number
        going = going[~there]
        if not len(going):
            break
        at[going] += LINE_STEP_COLUMNS * heading[going]
    return _Lines(at, length, heading)


def _rim_means(lines: _Lines, which: NDArray[np.int64], given: Mask, table: Array) -> Array:
    """Means [N,C] of what is given from the ends of some lines [N] on, straight along their headings."""
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
