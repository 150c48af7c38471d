"""Two upright slabs beside each other, as voxels and as splats: matter for connected control points."""

from __future__ import annotations

import numpy as np

from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array
from solid_fields import solid_field

SIDE = 49
TIP = (-0.25, 0.0, 0.4)
"""On the left slab, close to its top."""


def slabs(joined: bool = False) -> VoxelField:
    """Two upright slabs at x = -.25 and .25, 8 voxels apart, in the cube [-1, 1]^3; `joined` at the foot."""
    solid = np.zeros((SIDE,) * 3, bool)
    solid[16:21, 16:33, 8:36] = True
    solid[28:33, 16:33, 8:36] = True
    if joined:
        solid[16:33, 16:33, 4:8] = True
    return solid_field(solid, np.full((*solid.shape, 3), 0.5))


def slabs_of_splats() -> SplatField:
    """The two slabs as splats, one for each voxel."""
    x, y, z = np.meshgrid(np.arange(5), np.arange(17), np.arange(28), indexing="ij")
    left = np.stack([x + 16, y + 16, z + 8], axis=-1).reshape(-1, 3)
    means = np.concatenate([left, left + np.array([12, 0, 0])]) / 24.0 - 1.0
    count = len(means)
    return SplatField(
        means, np.full((count, 3), np.log(0.02)), np.tile([1.0, 0, 0, 0], (count, 1)), np.full(count, 0.9),
        np.zeros((count, 1, 3)),
    )  # fmt: skip


def on_slab(x: float, count: int = 400) -> Array:
    """Random points [N,3] of the slab in the middle of which x is."""
    return np.random.default_rng(0).uniform((x - 0.08, -0.3, -0.5), (x + 0.08, 0.3, 0.45), (count, 3))
