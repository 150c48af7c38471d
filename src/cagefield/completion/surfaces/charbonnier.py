"""Charbonnier loss of a fit's residuals: quadratic for noise, linear for outliers such as edges of textures.

    rho(r) = 2 h^2 (sqrt(1 + (r / h)^2) - 1),    h = HUBER_DEVIATIONS,

of residuals r in standard deviations.

Source: Charbonnier et al., "Deterministic edge-preserving regularization in computed imaging" (1997).
"""

from __future__ import annotations

import numpy as np

from cagefield.typing import Array

HUBER_DEVIATIONS = 3.0
"""Residual from which on the loss is linear, standard deviations."""


MIN_LOG_DEVIATION = 1e-3
"""Minimum standard deviation of log brightness: a change of a thousandth is invisible."""


def estimate_noise(values: Array) -> float:
    """Robust standard deviation of values [N], by their median absolute deviation; >= MIN_LOG_DEVIATION."""
    return max(1.4826 * float(np.median(np.abs(values - np.median(values)))), MIN_LOG_DEVIATION)


def charbonnier_residuals(residuals: Array) -> Array:
    """Residuals [N] whose squares are the loss rho of `residuals` [N], with their sign, for least squares."""
    return np.asarray(
        np.sign(residuals)
        * HUBER_DEVIATIONS
        * np.sqrt(2.0 * (np.sqrt(1.0 + (residuals / HUBER_DEVIATIONS) ** 2) - 1.0))
    )


def charbonnier_loss(residuals: Array) -> float:
    """Mean loss of residuals [N], in standard deviations."""
    return float((charbonnier_residuals(residuals) ** 2).mean())
