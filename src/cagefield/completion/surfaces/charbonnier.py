"""Huber's loss, smoothed, of what a fit leaves over: edges of textures are further off than noise.

Source: Charbonnier et al., "Deterministic edge-preserving regularization in computed imaging" (1997).
"""

from __future__ import annotations

import numpy as np

from cagefield.typing import Array

HUBER_DEVIATIONS = 3.0
"""Standard deviations of noise from which on what is left counts by its size, no longer by its square."""


MIN_LOG_DEVIATION = 1e-3
"""Least standard deviation of logs of brightness: a thousandth cannot be seen."""


def estimate_noise(values: Array) -> float:
    """The standard deviation of values [N] but for those far off, by their median; at least LEAST."""
    return max(1.4826 * float(np.median(np.abs(values - np.median(values)))), MIN_LOG_DEVIATION)


def charbonnier_residuals(left: Array) -> Array:
    """What is left over [N], in standard deviations, so that its squares are the loss."""
    return np.asarray(
        np.sign(left)
        * HUBER_DEVIATIONS
        * np.sqrt(2.0 * (np.sqrt(1.0 + (left / HUBER_DEVIATIONS) ** 2) - 1.0))
    )


def charbonnier_loss(left: Array) -> float:
    """The mean loss of what is left over [N]."""
    return float((charbonnier_residuals(left) ** 2).mean())
