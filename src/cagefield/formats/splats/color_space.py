"""Colours of splats that are linear light, as the sRGB values that all other splats have.

Notation: c(d) = 1/2 + sum_k Y_k(d) c_k a splat's colour seen along d, E sRGB's encoding of linear light.

Source: IEC 61966-2-1 (sRGB); KhronosGroup/glTF, KHR_gaussian_splatting, "Color Space".
"""

from __future__ import annotations

from functools import cache

import numpy as np

from cagefield.fields.sh import sh_basis
from cagefield.typing import AnyArray, Array, Float32

CHUNK = 1 << 13
"""Splats that are converted at a time."""


def srgb_encoded(linear: AnyArray) -> Array:
    """E: sRGB values of linear light, which may exceed 1; of what is below 0 those of 0."""
    linear = np.maximum(np.asarray(linear, np.float64), 0.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)


def srgb_harmonics(sh: AnyArray) -> Float32:
    """Harmonics [N,K,3], of the same degree, of E(c(d)) for the harmonics [N,K,3] of linear light c.

    Exact for degree 0. Above it the nearest in least squares over all directions: E(c(d)) has harmonics of
    all degrees, the more the darker a splat is on one side.
    """
    degree = int(np.sqrt(sh.shape[1])) - 1
    basis, weights = _directions(degree)
    found = np.empty(sh.shape, np.float32)
    for first in range(0, len(sh), CHUNK):
        here = slice(first, first + CHUNK)
        linear = 0.5 + np.einsum("dk,nkc->ndc", basis, sh[here].astype(np.float64), optimize=True)
        excess = srgb_encoded(linear) - 0.5
        found[here] = np.einsum("dk,ndc->nkc", basis * weights[:, None], excess, optimize=True)
    return found


@cache
def _directions(degree: int) -> tuple[AnyArray, AnyArray]:
    """(Y [D,K] at directions, weights [D] whose sum is 4 pi): products of Y up to this degree are exact."""
    if degree == 0:
        return sh_basis(np.array([[0.0, 0.0, 1.0]]), 0), np.array([4.0 * np.pi])
    heights, shares = np.polynomial.legendre.leggauss(2 * degree + 4)
    turns = np.arange(4 * degree + 8) * (2.0 * np.pi / (4 * degree + 8))
    z, angle = (part.ravel() for part in np.meshgrid(heights, turns, indexing="ij"))
    across = np.sqrt(1.0 - z * z)
    directions = np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
    return sh_basis(directions, degree), np.repeat(shares, len(turns)) * (2.0 * np.pi / len(turns))
