"""Fields of what is solid and colored on a grid, and how alike two pictures are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.fields.sh import C0
from cagefield.fields.voxel_field import VoxelField


def solid_field(solid: NDArray[np.bool_], rgb: NDArray[np.floating], scale: float = 1.0) -> VoxelField:
    """A field over the cube from -scale to scale: opaque where it is solid [N,N,N], in colors [N,N,N,3].

    As in a trained field, the empty vertices beside a surface have its colors.
    """
    away, nearest = ndimage.distance_transform_edt(~solid, return_indices=True)
    vertices = np.flatnonzero(away < 2.0)
    colors = rgb[tuple(nearest)].reshape(-1, 3)[vertices]
    return VoxelField(
        np.array([[-scale] * 3, [scale] * 3]),
        solid.shape,
        vertices,
        np.where(solid.reshape(-1)[vertices], (len(solid) - 1) / scale, 0.0).astype(np.float32),
        ((colors - 0.5) / C0).astype(np.float32)[:, None],
    )


def db(a: NDArray[np.floating], b: NDArray[np.floating]) -> float:
    """PSNR of two pictures."""
    return float(-10.0 * np.log10(max(float(((a - b) ** 2).mean()), 1e-12)))
