"""Splat rasterizer on Quadrants' device: the host side of `kernels.device_rasterizer`, for GPUs.

The layout of images equals that of `rasterizer` on the CPU. Sorting is done on the host: depths, then
the tiles that each splat touches, both stable.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.compute.devices import floats, ints
from cagefield.rendering.splats.kernels import device_rasterizer as kernels
from cagefield.rendering.splats.kernels.projection import AREA, PACKED, TILE_PX
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.rendering.splats.rasterizer import DEPTH, Region, intrinsics, untiled, world_to_camera
from cagefield.rendering.voxels.device_grid import to_device
from cagefield.typing import Float32

_FARTHEST = 1e9
"""Largest |(x/z, y/z)| that float32 squares."""

_UNUSED: Float32 = np.zeros(1, np.float32)
"""Kernel argument for arrays that are not read."""


class SplatArrays:
    """Splats on the device, kept from image to image; with their normals [N,3] where these were given."""

    def __init__(self, splats: DeformedSplats, normals: Float32 | None = None) -> None:
        devices.start()
        self.splats = splats
        self.has_normals = normals is not None
        self.args = kernels.SplatArgs(
            means=to_device(splats.means),
            covariances=to_device(splats.covariances),
            opacities=to_device(splats.opacities),
            sh=to_device(splats.sh),
            rotations=to_device(_UNUSED if splats.rotations is None else splats.rotations),
            normals=to_device(_UNUSED if normals is None else normals),
            count=len(splats),
            antialiased=int(splats.antialiased),
            turned=int(splats.rotations is not None),
            with_normals=int(self.has_normals),
        )


@dataclass(frozen=True, eq=False)
class DeviceProjection:
    """As `rasterizer.Projection`, with packed splats, `ids` and `starts` on the device."""

    packed: Any
    ids: Any
    starts: Any
    ends: NDArray[np.int64]
    width: int
    height: int

    @property
    def across(self) -> int:
        """Tiles in a row of the picture."""
        return -(-self.width // TILE_PX)

    @property
    def tiles(self) -> int:
        """Tiles of the picture."""
        return len(self.ends)

    def blend(self, channels: int = DEPTH) -> tuple[Float32, NDArray[np.int64]]:
        """The picture [tiles,channels,AREA], and where each tile's splats end; see `Projection.blend`."""
        out = _empty(self.tiles * channels * AREA)
        kernels.blend(self.packed, self.ids, self.starts, self.tiles, self.across, out, channels)
        return out.to_numpy().reshape(self.tiles, channels, AREA), self.ends

    def picture(self, channels: int = DEPTH) -> Float32:
        """The picture [H,W,channels]."""
        return untiled(self.blend(channels)[0], self.width, self.height)

    def opacity_before(self, pixels: NDArray[Any], distances: NDArray[Any]) -> Float32:
        """Opacity [K] gathered before distances [K] along the rays of pixels [K,2] inside the picture."""
        out = _empty(len(pixels))
        kernels.opacity_before(
            self.packed,
            self.ids,
            self.starts,
            self.across,
            to_device(np.asarray(pixels, np.float32)),
            to_device(np.asarray(distances, np.float32)),
            out,
            len(pixels),
        )
        return out.to_numpy()[: len(pixels)]


def project(
    arrays: SplatArrays, camera: Camera, *, near: float, region: Region | None = None
) -> DeviceProjection:
    """The splats as `camera` sees them; see `rasterizer.project`."""
    x, y, width, height = region or (0, 0, camera.width, camera.height)
    lens = intrinsics(camera)
    count = len(arrays.splats)
    packed, keys = _empty(count * PACKED), _empty(count)
    boxes = to_device(np.zeros(max(1, count) * 4, np.int32))
    origin = camera.origin.astype(np.float32).astype(np.float64)
    across, down = -(-width // TILE_PX), -(-height // TILE_PX)
    kernels.project(
        arrays.args,
        kernels.CameraArgs(
            floats(world_to_camera(camera)),
            floats(origin),
            floats(camera.origin - origin),
            floats(lens.focal),
            floats(lens.center - (x, y)),
            ints((width, height)),
            floats(lens.limits),
            floats(lens.coefficients),
            min(lens.radius_limit, _FARTHEST),
            near,
        ),
        kernels.ProjectionArgs(packed, keys, boxes),
        arrays.splats.sh.shape[1],
        lens.model,
    )
    box = boxes.to_numpy().reshape(-1, 4)
    shown = np.flatnonzero(box[:, 1] > box[:, 0])
    order = shown[np.argsort(keys.to_numpy()[shown], kind="stable")]
    on_device = to_device(order.astype(np.int32))
    counts = to_device(np.zeros(max(1, len(order)), np.int32))
    kernels.count_tiles(on_device, boxes, packed, counts, len(order))
    firsts = np.concatenate([[0], np.cumsum(counts.to_numpy()[: len(order)], dtype=np.int64)])
    touched = to_device(np.zeros(max(1, int(firsts[-1])), np.int32))
    kernels.list_tiles(
        on_device, to_device(firsts.astype(np.int32)), boxes, packed, across, touched, len(order)
    )
    tile_of = touched.to_numpy()[: int(firsts[-1])]
    by_tile = np.argsort(tile_of, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(tile_of, minlength=across * down), dtype=np.int64)])
    ids = np.repeat(order, np.diff(firsts))[by_tile].astype(np.int32)
    return DeviceProjection(
        packed, to_device(ids), to_device(starts.astype(np.int32)), starts[1:], width, height
    )


def _empty(size: int) -> Any:
    """An uninitialised float32 array on the device."""
    from cagefield.compute.quadrants import qd

    return qd.ndarray(dtype=qd.f32, shape=(max(1, size),))
