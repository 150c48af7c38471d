"""Kernel arguments of posed photos and of their pixel patches."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import F32, I32, U8


@dataclass(frozen=True, eq=False)
class PhotoArgs:
    """Kernel arguments of posed photos; see `DevicePhotos`.

    views: [V,4] (first pixel, width, first direction, height). poses: [V,12] rows of c2w. gains: [V,3].
    directions: camera-space pixel directions of each camera model. pixels: RGBA of all photos. valid: 0 for
    masked pixels, one value per pixel where `masked` is 1, else a single 1.
    """

    views: I32
    poses: F32
    gains: F32
    directions: F32
    pixels: U8
    valid: U8
    masked: qd.i32


@dataclass(frozen=True, eq=False)
class PatchArgs:
    """Square patches [P,3] (view, column and row of the first pixel), their number and side in pixels."""

    patches: I32
    count: qd.i32
    size: qd.i32
