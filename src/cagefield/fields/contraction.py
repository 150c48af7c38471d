"""Contraction of unbounded space into a cube, and its inverse.

Notation: q = (p - center) / half_size are normalized positions, m = max|q_i|. The box of interest is m <= 1.

    contract(q) = q                        m <= 1
                  (2 - 1/m) q / m          m > 1

maps all of space into the open cube (-2, 2)^3 and leaves the box of interest unchanged.

Source: Barron et al., "Mip-NeRF 360", equation 10, with the L-infinity norm in place of L2, so that a
voxel grid over the cube wastes no corners.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def contract(normalized: Array) -> Array:
    """Contracted positions [N,3] of normalized positions [N,3]; the exact identity where max|q_i| <= 1.

    Oracle of `rendering.voxels.kernels.grid.contract`.
    """
    m = np.maximum(np.abs(normalized).max(axis=-1, keepdims=True), 1.0)
    return np.where(m <= 1.0, normalized, (2.0 - 1.0 / m) / m * normalized)


def uncontract(contracted: Array) -> Array:
    """Normalized positions [N,3] of contracted positions [N,3] in (-2, 2)^3; the inverse of `contract`.

    Positions on or outside the cube's surface, which represents infinity, are moved 1e-6 inside.
    """
    m = np.clip(np.abs(contracted).max(axis=-1, keepdims=True), 1.0, 2.0 - 1e-6)
    scale = np.minimum(1.0, (2.0 - 1e-6) / np.maximum(np.abs(contracted).max(axis=-1, keepdims=True), 1e-12))
    return np.where(m <= 1.0, contracted, contracted * scale / (m * (2.0 - m)))
