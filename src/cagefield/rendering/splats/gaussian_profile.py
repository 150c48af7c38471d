"""Profiles across a splat: its optical depths, and the splat nearest to a part of it.

Notation: a ray at u standard deviations from the middle of a splat of the opacity a has the optical depth
T(u) = -log(1 - a exp(-u^2 / 2)). Of faint splats that is a normal distribution times a; the more opaque a
splat is, the more its middle stands out.
"""

from __future__ import annotations

import functools

import numpy as np

from cagefield.typing import Array

LEAST_OPAQUE, MOST_OPAQUE = 1e-5, 0.9999
"""Opacities that have a profile here."""

ENDS = 6.0
"""Standard deviations at which T ends."""


def mass_across(opacity: Array) -> Array:
    """Integral of -log(1 - opacity exp(-u^2 / 2)) over u, by sqrt(2 pi): sum over k of opacity^k / k^1.5."""
    return np.asarray(np.interp(opacity, *_masses()))


@functools.cache
def _masses() -> tuple[Array, Array]:
    """(opacities, their `mass_across`)."""
    opacity = np.concatenate(
        [np.geomspace(LEAST_OPAQUE, 0.1, 100), 1.0 - np.geomspace(0.9, 1.0 - MOST_OPAQUE, 400)[1:]]
    )
    u = np.linspace(0.0, ENDS, 1201)
    mass = np.trapezoid(-np.log1p(-opacity[:, None] * np.exp(-0.5 * u * u)), u, axis=1)
    return np.append(0.0, opacity), np.append(0.0, mass * np.sqrt(2.0 / np.pi))


PARTS = np.array(
    [
        (-2.0, -2.2345, 0.1718, 0.0980),
        (-1.8, -2.0535, 0.1857, 0.1443),
        (-1.6, -1.8755, 0.2015, 0.2046),
        (-1.4, -1.7009, 0.2197, 0.2792),
        (-1.2, -1.5262, 0.2414, 0.3695),
        (-1.0, -1.3650, 0.2651, 0.4656),
        (-0.8, -1.2054, 0.2933, 0.5700),
        (-0.6, -1.0529, 0.3257, 0.6750),
        (-0.4, -0.9084, 0.3629, 0.7744),
        (-0.2, -0.7699, 0.4062, 0.8651),
        (0.0, -0.6481, 0.4522, 0.9369),
        (0.2, -0.5341, 0.5039, 0.9939),
        (0.4, -0.4318, 0.5594, 1.0338),
        (0.6, -0.3416, 0.6176, 1.0579),
        (0.8, -0.2615, 0.6783, 1.0690),
        (1.0, -0.1970, 0.7355, 1.0695),
        (1.2, -0.1420, 0.7916, 1.0630),
        (1.4, -0.0979, 0.8434, 1.0523),
        (1.6, -0.0637, 0.8889, 1.0399),
        (1.8, -0.0381, 0.9276, 1.0275),
        (2.0, -0.0215, 0.9558, 1.0175),
    ]
).T
"""Cuts t, and of the splat nearest to exp(-u^2 / 2) on u < t, nothing beyond it: place, width, amplitude.
Nearest has the least squared difference, that beyond the cut OVERHANG times."""

OVERHANG = 3.0
"""Weight of squared differences beyond a cut: layers of splats behind each other add up there. 1 leaves a
fringe on thousands of small splats (1 to 3 dB of PSNR to finely split ones), 10 a seam on a few large ones."""


def part_below(opacity: Array, t: Array) -> tuple[Array, Array, Array, Array]:
    """(x, r, opacity, across) [M] of the parts of splats of the opacities [M] below t [M], -2 to 2.

    A splat for a part is at x and of the width r along u, `across` in the other directions, in standard
    deviations of the whole: alpha is a product, so it stays as wide there.
    """
    x, r, amplitude = (np.interp(t, PARTS[0], column) for column in PARTS[1:])
    return x, r, np.minimum(amplitude * opacity, MOST_OPAQUE), np.ones(len(t))
