"""Densification and pruning of splats during a training."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.geometry.quaternions import rotation_matrices
from cagefield.training.splats.splat_state import SplatState

SPLIT_OFFSET_SIGMAS = 0.6
"""Offset of each half of a split splat along its longest axis, in its sigmas."""

MAX_ASPECT_RATIO = 300.0
"""Maximum ratio of a splat's largest sigma to its second largest."""

SPLIT_SIGMA_RATIO = 0.7
"""Sigma of the halves along the split axis, relative to the sigma of the whole."""


def prune_mask(state: SplatState, prune: float, largest: float) -> NDArray[np.bool_]:
    """Mask [N] of splats to remove: opacity below `prune`, a sigma above `largest`, or a needle."""
    opacity = 1.0 / (1.0 + np.exp(-state.logits))
    vast = np.exp(state.log_scales.max(axis=1)) > largest
    return np.asarray((opacity < prune) | vast | needle_mask(state.log_scales))


def needle_mask(log_scales: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Mask [N] of needles: splats without width, nearly invisible until an edit turns them into streaks."""
    ordered = np.sort(log_scales, axis=1)
    return np.asarray(ordered[:, 2] - ordered[:, 1] > np.log(MAX_ASPECT_RATIO))


def split_splats(state: SplatState, rows: NDArray[np.int64]) -> None:
    """Split the splats `rows` in two along their longest axes; opacities preserve each pair's alpha."""
    if not len(rows):
        return
    count = len(state)
    axis = np.argmax(state.log_scales[rows], axis=1)
    directions = rotation_matrices(state.quaternions[rows].astype(np.float64))[np.arange(len(rows)), :, axis]
    sigma = np.exp(state.log_scales[rows, axis])[:, None]
    state.take(np.concatenate([np.arange(count), rows]))
    halves = np.arange(count, count + len(rows))
    offset = (SPLIT_OFFSET_SIGMAS * sigma * directions).astype(np.float32)
    state.means[rows] += offset
    state.means[halves] -= offset
    for part in (rows, halves):
        state.log_scales[part, axis] += np.float32(np.log(SPLIT_SIGMA_RATIO))
        opacity = 1.0 / (1.0 + np.exp(-state.logits[part]))
        opacity = np.clip((1.0 - np.sqrt(1.0 - opacity)) / 0.72, 1e-4, 0.95)
        state.logits[part] = np.log(opacity / (1.0 - opacity))
        state.momentum[part] = 0.0
        state.running[part] *= 0.5
