"""Optical depths across a splat, and the splat that has those of a part of it.

Notation: a ray at u standard deviations from the middle of a splat of the opacity a has the optical depth
T(u) = -log(1 - a exp(-u^2 / 2)). Of faint splats that is a normal distribution times a; the more opaque a
splat is, the more its middle stands out.
"""

from __future__ import annotations

import functools

import numpy as np
from scipy.special import spence

from cagefield.typing import Array

LEAST_OPAQUE, MOST_OPAQUE = 1e-5, 0.9999
"""Opacities that have a profile here."""

ENDS = 6.0
"""Standard deviations at which T ends."""


def mass_across(opacity: Array) -> Array:
    """Integral of -log(1 - opacity exp(-u^2 / 2)) over u, by sqrt(2 pi): sum over k of opacity^k / k^1.5."""
    opacities, masses, _ = _profiles()
    return np.asarray(np.interp(opacity, opacities, masses))


@functools.cache
def _profiles() -> tuple[Array, Array, Array]:
    """(opacities, their `mass_across`, the standard deviations of -log(1 - opacity exp(-u^2 / 2)) over u)."""
    opacity = np.concatenate(
        [np.geomspace(LEAST_OPAQUE, 0.1, 100), 1.0 - np.geomspace(0.9, 1.0 - MOST_OPAQUE, 400)[1:]]
    )
    u = np.linspace(0.0, ENDS, 1201)
    depth = -np.log1p(-opacity[:, None] * np.exp(-0.5 * u * u))
    mass = np.trapezoid(depth, u, axis=1)
    width = np.sqrt(np.trapezoid(depth * u * u, u, axis=1) / mass)
    mass *= np.sqrt(2.0 / np.pi)
    return np.append(0.0, opacity), np.append(0.0, mass), np.append(1.0, width)


def part_between(opacity: Array, low: Array, high: Array) -> tuple[Array, Array, Array, Array]:
    """(x, r, opacity, across) [M] of the parts of splats between low [M] and high [M].

    These have opacities [M]. A splat for a part is at x and of the width r along u, `across` in the other
    directions, in standard deviations of the whole. It has the integral, mean and variance of T over u of the
    part, and its integral over a plane.
    """
    nodes, weights = np.polynomial.legendre.leggauss(32)
    half = 0.5 * (high - low)[:, None]
    u = 0.5 * (low + high)[:, None] + half * nodes
    depth = -np.log1p(-opacity[:, None] * np.exp(-0.5 * u * u)) * half * weights
    mass = depth.sum(axis=1)
    x = (depth * u).sum(axis=1) / mass
    width = np.sqrt((depth * (u - x[:, None]) ** 2).sum(axis=1) / mass)
    opacities, masses, widths = _profiles()
    child = np.interp(mass / np.sqrt(2.0 * np.pi) / width, masses / widths, opacities)
    r = width / np.interp(child, opacities, widths)
    plane = (mass_across(opacity[:, None] * np.exp(-0.5 * u * u)) * half * weights).sum(axis=1)
    own = np.sqrt(2.0 * np.pi) * spence(1.0 - child)  # of `mass_across` over u: the dilogarithm
    return x, r, child, plane / (r * own)
