"""Arguments of the splat kernels on CPUs: named tuples of arrays, which Numba unpacks when it compiles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cagefield.typing import Array, Float32


class SplatArgs(NamedTuple):
    """N splats in deformed space, as `DeformedSplats`; rotations [0,3,3] where no splat is rotated."""

    means: Float32
    covariances: Float32
    opacities: Float32
    sh: Float32
    rotations: Float32


class DiscArgs(NamedTuple):
    """N discs in deformed space, as `SplatArgs`; tangents [N,6] a, b in world units."""

    means: Float32
    tangents: Float32
    opacities: Float32
    sh: Float32
    rotations: Float32


class CameraArgs(NamedTuple):
    """Camera of a rectangular region of its image.

    Attributes:
        world_to_camera: [3,3] rotation W into camera axes x right, y down, z forward.
        origin: [3], world units.
        focal: [2], pixels.
        center: [2] principal point, pixels from the region's top left corner.
        size: [2] width and height of the region, pixels.
        limits: [4] x low, x high, y low, y high of n = (x/z, y/z), within which the lens is differentiated.
        model: PINHOLE, OPENCV or FISHEYE.
        coefficients: [6] of the lens.
        radius_limit: largest |n| that the lens maps one-to-one.
        near: least depth z of splats that are drawn, world units.
    """

    world_to_camera: Array
    origin: Array
    focal: Array
    center: Array
    size: NDArray[np.int64]
    limits: Array
    model: int
    coefficients: Array
    radius_limit: float
    near: float


class ProjectedSplats(NamedTuple):
    """Output of a projection: packed [N,PACKED], sorting keys [N] (depth z), tiles [N,4].

    The tiles touched by a splat are x0, x1, y0, y1, ends excluded; x1 = 0 for splats that are not drawn.
    """

    packed: Float32
    keys: Float32
    tiles: NDArray[np.int32]


class MergedSplats(NamedTuple):
    """Output of `splat_lod.merge`: M representatives, their masses [M,2] and distances apart [M]."""

    means: Float32
    covariances: Float32
    sh: Float32
    rotations: Float32
    masses: Float32
    apart: Float32
