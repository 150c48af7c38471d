"""Defaults of a VoxelField's training that depend on the capture, the device and the training time.

The resolution of a bounded scene grows with the photos and with the time. Detail finer than a pixel cannot be
learned, so the longest axis gets at most MAX_VOXELS_PER_PIXEL vertices per pixel of the photos' longer side.
Enough rays must meet every surface voxel, and the number of surface voxels grows with the squared resolution.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.training.voxels.voxel_config import VoxelConfig

MAX_VOXELS_PER_PIXEL = 0.9
"""Maximum number of vertices along the longest axis, per pixel of the photos\' longer side."""

MIN_RAYS_PER_SURFACE_VOXEL = 340.0
"""Minimum number of training rays per squared vertex count of the longest axis."""

RAYS_PER_THREAD_SECOND = 75_000.0
"""Speed of one slow CPU thread, by which a run limited by time chooses its resolution."""

MIN_AUTO_RESOLUTION, MAX_AUTO_RESOLUTION = 64, 512
"""Limits of the defaults resolution; a larger grid may need more than 6 GiB of memory."""

BATCH_RAYS, GPU_BATCH_RAYS = 4096, 32768
"""Rays per batch: in general, and on a GPU in a run limited by time."""

UNBOUNDED_RESOLUTION = 256
"""Vertices along the longest axis for an unbounded capture."""


@dataclass(frozen=True)
class VoxelSettings:
    """Options of a `VoxelConfig` with every default resolved."""

    resolution: int
    sh_degree: int
    lr: tuple[float, float]
    laplacian_reg: float
    view_dependence_reg: float
    distortion_reg: float
    batch_rays: int


def resolve_settings(
    config: VoxelConfig, sizes: NDArray[np.int64], *, unbounded: bool, threads: int | None
) -> VoxelSettings:
    """Resolved options for photos of `sizes` [V,2]; `threads` is the number of CPU threads, None on a GPU."""
    batch = GPU_BATCH_RAYS if threads is None and config.minutes is not None else BATCH_RAYS
    defaults = (
        VoxelSettings(UNBOUNDED_RESOLUTION, 1, (4.0, 0.4), 1e-3, 2e-2, 0.0, batch)
        if unbounded
        else VoxelSettings(
            bounded_resolution(sizes, expected_rays(config, threads)), 2, (8.0, 2.0), 1e-5, 3e-3, 0.3, batch
        )
    )
    defaults = dataclasses.replace(
        defaults, laplacian_reg=defaults.laplacian_reg * (config.batch_rays or batch) / BATCH_RAYS
    )
    given = {field.name: getattr(config, field.name) for field in dataclasses.fields(VoxelSettings)}
    return dataclasses.replace(
        defaults, **{name: value for name, value in given.items() if value is not None}
    )


def expected_rays(config: VoxelConfig, threads: int | None) -> float:
    """Expected number of training rays; infinite on a GPU in a run limited by time."""
    if config.minutes is None:
        return float(config.steps * (config.batch_rays or BATCH_RAYS))
    return math.inf if threads is None else 60.0 * config.minutes * threads * RAYS_PER_THREAD_SECOND


def bounded_resolution(sizes: NDArray[np.int64], rays: float) -> int:
    """Vertices along the longest axis, a multiple of 8, for photos of `sizes` [V,2] and a number of rays."""
    side = float(np.median(sizes.max(axis=1)))
    resolution = min(
        MAX_VOXELS_PER_PIXEL * side, math.sqrt(rays / MIN_RAYS_PER_SURFACE_VOXEL), MAX_AUTO_RESOLUTION
    )
    return int(max(MIN_AUTO_RESOLUTION, 8 * round(resolution / 8)))
