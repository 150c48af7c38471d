"""How the motion of a flow shell fades between the cages."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cagefield.typing import Array

FALLOFFS: tuple[str, ...] = ("smooth", "linear")

LEAST_SLOPE, MOST_SLOPE = 0.5, 0.95
"""Slope of the smooth profile at the outer cage, where no gap changes and where one changes without end."""

CHANGE = 0.8
"""Change of a gap's logarithm that takes the slope 63% of the way from the one to the other."""


@dataclass(frozen=True)
class Falloff:
    """How the motion fades from the inner cage (all of it) to the outer (none).

    With r = d_o / (d_i + d_o) and g = (r - 1 + width) / width cut to [0,1],

        w = g (a + b g (3 - 2 g)) + (1 - a - b) max(2 g - 1, 0)^9.

    profile "linear": a = 1, b = 0, so w = g. "smooth": b = 1 - 17 a / 18, so w has no kink at the inner
    cage, where it would cost the integration two orders; its slope is a at the outer cage, and steepest in
    the middle, about 1.5 - 5 a / 12. width in (0,1] from "only near the inner cage" to "the whole shell".

    A gap between the cages that grows or shrinks by a factor k is stretched or squeezed by k to the power of
    the profile's steepest slope; a linear profile spreads that evenly. Around a cage that turns, one that
    fades slowly towards the outer cage stretches less. So a rises from 0.5, where all gaps along the outer
    cage's axes end as they began, to 0.95, the more one of them changes.
    """

    profile: str = "smooth"
    width: float = 1.0

    def weight(self, q: Array, coefficients: tuple[float, float]) -> tuple[Array, Array]:
        """(w [N], dw/dq [N]) at ratios q = d_i / d_o >= 0 of the distances, with coefficients (a, b)."""
        a, b = coefficients
        r = 1.0 / (1.0 + q)
        g = (r - 1.0) / self.width + 1.0
        slope = np.where(g > 0.0, -r * r / self.width, 0.0)
        g = g.clip(0.0, 1.0)
        u = (2.0 * g - 1.0).clip(0.0)
        w = g * (a + b * g * (3.0 - 2.0 * g)) + (1.0 - a - b) * u**9
        return w, slope * (a + 6.0 * b * g * (1.0 - g) + 18.0 * (1.0 - a - b) * u**8)

    def coefficients(self, change: float) -> tuple[float, float]:
        """(a, b) where the logarithm of a gap between the cages changes by `change` at most."""
        if self.profile == "linear":
            return 1.0, 0.0
        a = MOST_SLOPE - (MOST_SLOPE - LEAST_SLOPE) * math.exp(-change / CHANGE)
        return a, 1.0 - a * 17.0 / 18.0
