"""Discs of 2DGS on the CPU: projected, sorted by depth, met by rays in tiles; the host side of the kernels.

Discs have no clusters and no representatives: each frame goes through all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.errors import CagefieldError
from cagefield.rendering.splats.kernels import discs
from cagefield.rendering.splats.kernels.projection import AREA, PACKED, TILE_PX
from cagefield.rendering.splats.kernels.splat_args import DiscArgs, ProjectedSplats
from cagefield.rendering.splats.raster_splats import NO_ROTATIONS, DeformedSplats
from cagefield.rendering.splats.rasterizer import (
    DEPTH,
    Buffers,
    Region,
    camera_args,
    pairs_of_tiles,
    untiled,
)
from cagefield.typing import Float32

_NO_NORMALS: Float32 = np.empty((0, 3), np.float32)


@dataclass(frozen=True, eq=False)
class DiscProjection:
    """The pairs (tile, disc) of one picture, near to far within each tile; see `rasterizer.pairs_of_tiles`.

    `camera` sees the picture, of which `region` is projected.
    """

    packed: Float32
    starts: NDArray[np.int64]
    ids: NDArray[np.int32]
    camera: Camera
    region: Region
    near: float

    def picture(self, channels: int = DEPTH) -> Float32:
        """The picture [H,W,channels] (T, color, depth along the ray x weight, normals)."""
        x, y, width, height = self.region
        out = np.empty((len(self.starts) - 1, channels, AREA), np.float32)
        discs.blend(
            self.packed,
            self.ids,
            self.starts,
            -(-width // TILE_PX),
            np.float32(self.near),
            channels,
            out,
        )
        picture = untiled(out, width, height)
        if channels >= DEPTH:
            at = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2) + 0.5
            picture[..., 4] *= self._lengths(at + np.array((x, y))).reshape(height, width)
        return picture

    def opacity_before(self, pixels: NDArray[Any], distances: NDArray[Any]) -> Float32:
        """Opacity [K] gathered before distances [K] along the rays of pixels [K,2] inside the picture."""
        out = np.zeros(len(pixels), np.float32)
        depths = np.asarray(distances) / self._lengths(np.asarray(pixels) + np.array(self.region[:2]))
        discs.opacity_before(
            self.packed,
            self.ids,
            self.starts,
            -(-self.region[2] // TILE_PX),
            np.float32(self.near),
            np.ascontiguousarray(pixels, np.float32),
            np.ascontiguousarray(depths, np.float32),
            out,
        )
        return out

    def _lengths(self, pixels: NDArray[Any]) -> NDArray[Any]:
        """Distance along the ray over the depth z, at pixels of the whole picture; 1 behind the camera."""
        camera = self.camera
        there = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
        forwards = lenses.unproject(there, camera.model, camera.distortion)[0][:, 2]
        return np.where(forwards > 1e-6, 1.0 / np.maximum(forwards, 1e-6), 1.0)


def project_discs(
    splats: DeformedSplats,
    camera: Camera,
    *,
    near: float,
    region: Region | None = None,
    normals: Float32 | None = None,
    buffers: Buffers | None = None,
) -> DiscProjection:
    """The discs as `camera` sees them; as `rasterizer.project`.

    Raises:
        CagefieldError: splats without tangents.
    """
    if splats.tangents is None:
        raise CagefieldError("these splats are no discs: they have no tangents")
    buffers = buffers or Buffers()
    region = region or (0, 0, camera.width, camera.height)
    width, height = region[2:]
    count = len(splats)
    packed = buffers.take("packed", (count, PACKED), np.float32)
    keys = buffers.take("keys", (count,), np.float32)
    tiles = buffers.take("tiles", (count, 4), np.int32)
    discs.project(
        DiscArgs(
            splats.means,
            splats.tangents,
            splats.opacities,
            splats.sh,
            NO_ROTATIONS if splats.rotations is None else splats.rotations,
        ),
        _NO_NORMALS if normals is None else np.ascontiguousarray(normals),
        camera_args(camera, near, region),
        ProjectedSplats(packed, keys, tiles),
    )
    shown = np.flatnonzero(tiles[:, 1] > tiles[:, 0])
    _, starts, ids, *_ = pairs_of_tiles(shown, keys, tiles, packed, True, width, height, buffers)
    return DiscProjection(packed, starts, ids, camera, region, near)
