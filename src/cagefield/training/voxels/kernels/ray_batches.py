"""Photos, and patches of them, as kernels take them."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import F32, I32, U8


@dataclass(frozen=True, eq=False)
class PhotoArgs:
    """Posed photos as kernels take them; see `Photos`.

    views: [V,4] (first pixel, width, first direction, height). poses: [V,12] rows of c2w. gains: [V,3].
    directions: camera-space, of the pixels of each kind of camera. pixels: RGBA of all photos. valid: 0 for
    pixels that are left out, one value for each where `masked` is 1, else a single 1.
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
