"""Splat rasterizer on Quadrants' device: the host side of `kernels.device_rasterizer`, for GPUs.

The layout of images equals that of `rasterizer` on the CPU. Splats are sorted by depth, then their pairs with
tiles by tile, both stable; see `device_sorting`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.compute.device_buffers import DeviceBuffers, empty_array, to_device
from cagefield.compute.devices import floats, ints
from cagefield.rendering.device_image import DeviceSums, SumBuffers
from cagefield.rendering.splats.device_sorting import passes_of, sort_scratch
from cagefield.rendering.splats.kernels import device_rasterizer as kernels
from cagefield.rendering.splats.kernels import device_splat_args
from cagefield.rendering.splats.kernels.blending import T_MIN
from cagefield.rendering.splats.kernels.projection import AREA, PACKED, TILE_PX
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.rendering.splats.rasterizer import DEPTH, Region, intrinsics, untiled, world_to_camera
from cagefield.typing import Float32

_FARTHEST = 1e9
"""Largest |(x/z, y/z)| that float32 squares."""

_UNUSED: Float32 = np.zeros(1, np.float32)
"""Kernel argument for arrays that are not read."""


class SplatArrays:
    """Splats on the device, kept from image to image; with their normals [N,3] where these were given.

    `buffers` are shared by the splats' projections: one is valid until the next.
    """

    def __init__(self, splats: DeformedSplats, normals: Float32 | None = None) -> None:
        devices.start()
        self.splats = splats
        self.has_normals = normals is not None
        self.buffers, self.sum_buffers = DeviceBuffers(), SumBuffers()
        self.args = device_splat_args.SplatArgs(
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
    """As `rasterizer.Projection`, with its arrays on the device, which may be longer than their contents.

    `boxes` [N,4] are the tiles that each splat touches at most, x1 = 0 for splats that are not drawn.
    """

    packed: Any
    boxes: Any
    ids: Any
    starts: Any
    pairs: int
    width: int
    height: int

    @property
    def across(self) -> int:
        """Tiles in a row of the picture."""
        return -(-self.width // TILE_PX)

    @property
    def tiles(self) -> int:
        """Tiles of the picture."""
        return self.across * -(-self.height // TILE_PX)

    @property
    def ends(self) -> NDArray[np.int64]:
        """End [tiles] of each tile's splats in `ids`."""
        return self.starts.to_numpy()[1 : self.tiles + 1].astype(np.int64)

    def blend(self, channels: int = DEPTH) -> tuple[Float32, NDArray[np.int64]]:
        """The picture [tiles,channels,AREA], and where each tile's splats end; see `Projection.blend`."""
        out = empty_array(self.tiles * channels * AREA)
        kernels.blend(
            self.packed, self.ids, self.starts, self.tiles, self.across, out, float(T_MIN), channels
        )
        return out.to_numpy().reshape(self.tiles, channels, AREA), self.ends

    def picture(self, channels: int = DEPTH) -> Float32:
        """The picture [H,W,channels]."""
        return untiled(self.blend(channels)[0], self.width, self.height)

    def sums(self, buffers: SumBuffers) -> DeviceSums:
        """Sums of the image on the device, in memory of `buffers`."""
        out = buffers.take(self.tiles * DEPTH * AREA)
        sums = DeviceSums(out, self.width, self.height, DEPTH, TILE_PX)
        buffers.lend(sums)
        kernels.blend(self.packed, self.ids, self.starts, self.tiles, self.across, out, float(T_MIN), DEPTH)
        return sums

    def opacity_before(self, pixels: NDArray[Any], distances: NDArray[Any]) -> Float32:
        """Opacity [K] gathered before distances [K] along the rays of pixels [K,2] inside the picture."""
        out = empty_array(len(pixels))
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
    return project_args(arrays.args, arrays.splats.sh.shape[1], camera, near, arrays.buffers, region)


def project_args(
    splats: device_splat_args.SplatArgs,
    terms: int,
    camera: Camera,
    near: float,
    buffers: DeviceBuffers,
    region: Region | None = None,
) -> DeviceProjection:
    """Splats of `terms` harmonics as `camera` sees them; valid until `buffers` are projected to again."""
    x, y, width, height = region or (0, 0, camera.width, camera.height)
    count = splats.count
    packed, depths = buffers.take("packed", count * PACKED), buffers.take("depths", count)
    boxes = buffers.take("boxes", count * 4, np.int32)
    kernels.project(
        splats,
        camera_args(camera, near, (x, y, width, height)),
        device_splat_args.ProjectionArgs(packed, depths, boxes),
        terms,
        intrinsics(camera).model,
    )
    order = buffers.take("order", count, np.int32)
    firsts = buffers.take("firsts", count + 1, np.int32)
    kernels.order_splats(
        depths,
        boxes,
        packed,
        buffers.take("keys", count, np.int32),
        order,
        firsts,
        sort_scratch(count, "splats", buffers, scanned=count + 1),
        count,
        passes_of(kernels.HIDDEN_KEY),
    )
    pairs = int(firsts[count])
    across, down = -(-width // TILE_PX), -(-height // TILE_PX)
    touched, ids = buffers.take("touched", pairs, np.int32), buffers.take("ids", pairs, np.int32)
    starts = buffers.take("starts", across * down + 1, np.int32)
    scratch, passes = sort_scratch(pairs, "pairs", buffers), passes_of(across * down - 1)
    kernels.list_pairs(
        order,
        firsts,
        boxes,
        packed,
        ints((across, down)),
        touched,
        ids,
        starts,
        scratch,
        count,
        pairs,
        passes,
    )
    ids = scratch.other_values if passes % 2 else ids
    return DeviceProjection(packed, boxes, ids, starts, pairs, width, height)


def camera_args(camera: Camera, near: float, region: Region | None = None) -> device_splat_args.CameraArgs:
    """Kernel arguments of a camera and the part (x, y, width, height) of its image."""
    x, y, width, height = region or (0, 0, camera.width, camera.height)
    lens = intrinsics(camera)
    origin = camera.origin.astype(np.float32).astype(np.float64)
    return device_splat_args.CameraArgs(
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
    )
