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


OVERHANG = (4.0, 1.0)
"""Weights of squared differences beyond a cut, of faint and of opaque splats. Layers of faint ones add up
there: 1 leaves a fringe on thousands of small splats (3 dB of PSNR to finely split ones). An opaque one is a
layer alone: 4 leaves a seam (1 dB)."""

OPAQUE_POWER = 100.0
"""A splat of the opacity a is opaque by the share a^100: by half from 0.993 on."""

PARTS = np.array(
    [
        (-2.0, -2.2370, 0.1643, 0.0986),
        (-1.8, -2.0563, 0.1776, 0.1453),
        (-1.6, -1.8785, 0.1928, 0.2059),
        (-1.4, -1.7043, 0.2104, 0.2809),
        (-1.2, -1.5301, 0.2312, 0.3717),
        (-1.0, -1.3693, 0.2542, 0.4683),
        (-0.8, -1.2104, 0.2814, 0.5733),
        (-0.6, -1.0585, 0.3129, 0.6788),
        (-0.4, -0.9148, 0.3490, 0.7787),
        (-0.2, -0.7773, 0.3911, 0.8698),
        (0.0, -0.6564, 0.4360, 0.9420),
        (0.2, -0.5434, 0.4867, 0.9994),
        (0.4, -0.4420, 0.5413, 1.0397),
        (0.6, -0.3523, 0.5987, 1.0642),
        (0.8, -0.2726, 0.6591, 1.0756),
        (1.0, -0.2079, 0.7164, 1.0763),
        (1.2, -0.1524, 0.7732, 1.0698),
        (1.4, -0.1072, 0.8263, 1.0587),
        (1.6, -0.0716, 0.8739, 1.0457),
        (1.8, -0.0441, 0.9155, 1.0323),
        (2.0, -0.0256, 0.9469, 1.0211),
    ]
).T
"""Cuts t, and of the splat nearest to exp(-u^2 / 2) on u < t, and to nothing beyond it: place, width and
amplitude. Nearest has the least squared difference, that beyond the cut OVERHANG[0] times."""

OPAQUE_PARTS = np.array(
    [
        (-2.0, -2.2184, 0.2054, 0.0960),
        (-1.8, -2.0360, 0.2216, 0.1414),
        (-1.6, -1.8563, 0.2401, 0.2005),
        (-1.4, -1.6798, 0.2613, 0.2737),
        (-1.2, -1.5029, 0.2862, 0.3623),
        (-1.0, -1.3392, 0.3135, 0.4567),
        (-0.8, -1.1767, 0.3455, 0.5595),
        (-0.6, -1.0208, 0.3821, 0.6626),
        (-0.4, -0.8726, 0.4237, 0.7604),
        (-0.2, -0.7301, 0.4715, 0.8493),
        (0.0, -0.6045, 0.5218, 0.9194),
        (0.2, -0.4870, 0.5774, 0.9746),
        (0.4, -0.3820, 0.6360, 1.0127),
        (0.6, -0.2904, 0.6960, 1.0351),
        (0.8, -0.2109, 0.7567, 1.0449),
        (1.0, -0.1491, 0.8113, 1.0449),
        (1.2, -0.0992, 0.8618, 1.0390),
        (1.4, -0.0621, 0.9049, 1.0303),
        (1.6, -0.0362, 0.9391, 1.0212),
        (1.8, -0.0191, 0.9645, 1.0132),
        (2.0, -0.0096, 0.9806, 1.0076),
    ]
).T
"""PARTS for OVERHANG[1]."""


def part_below(opacity: Array, t: Array) -> tuple[Array, Array, Array, Array]:
    """(x, r, opacity, across) [M] of the parts of splats of the opacities [M] below t [M], -2 to 2.

    A splat for a part is at x and of the width r along u, `across` in the other directions, in standard
    deviations of the whole: alpha is a product, so it stays as wide there.
    """
    share = opacity**OPAQUE_POWER
    x, r, amplitude = (
        (1.0 - share) * np.interp(t, PARTS[0], faint) + share * np.interp(t, OPAQUE_PARTS[0], opaque)
        for faint, opaque in zip(PARTS[1:], OPAQUE_PARTS[1:], strict=True)
    )
    return x, r, np.minimum(amplitude * opacity, MOST_OPAQUE), np.ones(len(t))
