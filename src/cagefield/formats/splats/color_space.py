"""Conversion of splat colors from linear light to sRGB.

Notation: c(d) = 1/2 + sum_k Y_k(d) c_k is a splat's color along direction d, E sRGB's encoding of linear
light.

Source: IEC 61966-2-1 (sRGB); KhronosGroup/glTF, KHR_gaussian_splatting, "Color Space".
"""

from __future__ import annotations

from functools import cache

import numpy as np

from cagefield.fields.sh import sh_basis
from cagefield.typing import AnyArray, Array, Float32

CHUNK_SPLATS = 1 << 13
"""Number of splats converted at a time."""


def encode_srgb(linear: AnyArray) -> Array:
    """sRGB values E of linear light, which may exceed 1; negative values count as 0."""
    linear = np.maximum(np.asarray(linear, np.float64), 0.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)


def convert_harmonics_to_srgb(sh: AnyArray) -> Float32:
    """Harmonics [N,K,3] of E(c(d)), of the same degree, for the harmonics [N,K,3] of linear light c.

    Exact for degree 0. Above it, the least-squares projection over all directions: E(c(d)) has harmonics of
    all degrees, most for splats with a dark side.
    """
    degree = int(np.sqrt(sh.shape[1])) - 1
    basis, weights = _directions(degree)
    converted = np.empty(sh.shape, np.float32)
    for first in range(0, len(sh), CHUNK_SPLATS):
        rows = slice(first, first + CHUNK_SPLATS)
        linear = 0.5 + np.einsum("dk,nkc->ndc", basis, sh[rows].astype(np.float64), optimize=True)
        excess = encode_srgb(linear) - 0.5
        converted[rows] = np.einsum("dk,ndc->nkc", basis * weights[:, None], excess, optimize=True)
    return converted


@cache
def _directions(degree: int) -> tuple[AnyArray, AnyArray]:
    """Quadrature (Y [D,K] at directions, weights [D] of sum 4 pi), exact for products of Y up to a degree."""
    if degree == 0:
        return sh_basis(np.array([[0.0, 0.0, 1.0]]), 0), np.array([4.0 * np.pi])
    heights, shares = np.polynomial.legendre.leggauss(2 * degree + 4)
    turns = np.arange(4 * degree + 8) * (2.0 * np.pi / (4 * degree + 8))
    z, angle = (part.ravel() for part in np.meshgrid(heights, turns, indexing="ij"))
    across = np.sqrt(1.0 - z * z)
    directions = np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
    return sh_basis(directions, degree), np.repeat(shares, len(turns)) * (2.0 * np.pi / len(turns))
