"""How splats become more: those with the most error are split, those that show nothing are taken out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.geometry.quaternions import rotation_matrices
from cagefield.training.splats.splat_state import SplatState

SPLIT_OFFSET = 0.6
"""Each half of a split splat goes this many sigmas along its longest axis."""

NEEDLE = 300.0
"""Most of a splat's length in its width, of a flat one its larger width."""

SPLIT_SCALE = 0.7
"""The halves' sigma along that axis, in sigmas of the whole."""


def fading(state: SplatState, prune: float, largest: float) -> NDArray[np.bool_]:
    """True [N] where a splat shows nothing any more, or is larger than a scene of that size has use for."""
    opacity = 1.0 / (1.0 + np.exp(-state.logits))
    vast = np.exp(state.log_scales.max(axis=1)) > largest
    return np.asarray((opacity < prune) | vast | needles(state.log_scales))


def needles(log_scales: NDArray[np.float32]) -> NDArray[np.bool_]:
    """True [N] where a splat is a line without width: hardly seen as it is, a streak once it is edited."""
    ordered = np.sort(log_scales, axis=1)
    return np.asarray(ordered[:, 2] - ordered[:, 1] > np.log(NEEDLE))


def split(state: SplatState, rows: NDArray[np.int64]) -> None:
    """Splits splats in two along their longest axes, with opacities that let the pair show as much."""
    if not len(rows):
        return
    count = len(state)
    axis = np.argmax(state.log_scales[rows], axis=1)
    directions = rotation_matrices(state.quaternions[rows].astype(np.float64))[np.arange(len(rows)), :, axis]
    sigma = np.exp(state.log_scales[rows, axis])[:, None]
    state.take(np.concatenate([np.arange(count), rows]))
    halves = np.arange(count, count + len(rows))
    offset = (SPLIT_OFFSET * sigma * directions).astype(np.float32)
    state.means[rows] += offset
    state.means[halves] -= offset
    for part in (rows, halves):
        state.log_scales[part, axis] += np.float32(np.log(SPLIT_SCALE))
        opacity = 1.0 / (1.0 + np.exp(-state.logits[part]))
        opacity = np.clip((1.0 - np.sqrt(1.0 - opacity)) / 0.72, 1e-4, 0.95)
        state.logits[part] = np.log(opacity / (1.0 - opacity))
        state.momentum[part] = 0.0
        state.running[part] *= 0.5
