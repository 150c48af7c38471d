"""Fields and scenes for tests of the page's renderer: lumps of random density and color."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cagefield.cameras.camera import turntable
from cagefield.edits import Edit, EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene

SIZE = 64
"""Pixels of a side of the scene's pictures: Chromium draws them in software, at a cost per pixel."""

MOVE = Edit.move(Cage.box((0.6, 0.5, 0.3), (1.0, 0.9, 0.9))).translate((0.0, -0.5, 0.8))


def lumps(
    degree: int, contracted: bool, resolution: tuple[int, int, int] = (41, 36, 33), seed: int = 0
) -> VoxelField:
    """A field of random lumps with smooth surfaces and colors; a contracted one also far from its box."""
    rng = np.random.default_rng(degree + 10 * contracted + seed)
    K = (degree + 1) ** 2
    noise = ndimage.gaussian_filter(rng.standard_normal(resolution), 2.5)
    density = 60.0 * noise / noise.std() - 40.0
    axes = np.meshgrid(*[np.linspace(-1, 1, n) for n in resolution], indexing="ij")
    density[np.max(np.abs(axes), axis=0) > 0.9] = -10.0
    stored = density > -30.0
    sh = ndimage.gaussian_filter(rng.standard_normal((*resolution, K, 3)), (1.5, 1.5, 1.5, 0, 0))
    sh *= np.r_[0.8, np.full(K - 1, 0.3)][:, None] / sh.std()
    return VoxelField(
        bounds=np.array([[-1.0, -0.9, -0.8], [1.1, 0.9, 0.8]]),
        resolution=resolution,
        vertices=np.flatnonzero(stored),
        density=density[stored].astype(np.float32),
        sh=sh[stored].astype(np.float32),
        contracted=contracted,
    )


def lumps_scene() -> Scene:
    """Lumps with one moved, gray behind them."""
    cameras = turntable((0, 0, 0), 3.2, 3, elevation=0.4, width=SIZE, height=SIZE, fov_x=0.8)
    return Scene(
        lumps(1, False),
        EditStack([MOVE]),
        {"train": cameras[1:], "test": cameras[1:2]},
        background=(0.5, 0.5, 0.5),
    )
