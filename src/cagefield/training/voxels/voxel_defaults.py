"""What a VoxelField's training takes where its configuration leaves a choice to it.

A bounded scene's grid grows with the photos and with the time. Detail finer than a pixel cannot be learnt, so
its longest axis gets at most VOXELS_PER_PIXEL vertices for each pixel of the photos' longer side. And every
voxel of its surfaces must be met by enough rays: their number grows with the square of the resolution.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.training.voxels.voxel_config import VoxelConfig

VOXELS_PER_PIXEL = 0.9
"""Vertices along the longest axis for each pixel of the photos' longer side, at most."""

RAYS_PER_VOXEL = 340.0
"""Rays that a training takes for each vertex of a square of the grid's longest axis, at least."""

RAYS_PER_SECOND = 75_000.0
"""Rays that one thread of a slow CPU takes a second; a run by the clock chooses its resolution by it."""

SMALLEST, LARGEST = 64, 512
"""Limits of the resolution that is chosen; a larger grid may need more than 6 GiB of memory."""

BATCH, GPU_BATCH = 4096, 32768
"""Rays of a batch: on a CPU and of a run of so many steps, and on a GPU by the clock."""

UNBOUNDED = 256
"""Resolution of an unbounded capture."""


@dataclass(frozen=True)
class Settings:
    """The choices of a `VoxelConfig`, all made; see there."""

    resolution: int
    sh_degree: int
    rate: tuple[float, float]
    smooth: float
    plain: float
    batch_rays: int


def settings(
    config: VoxelConfig, sizes: NDArray[np.int64], *, unbounded: bool, threads: int | None
) -> Settings:
    """The choices for photos of these sizes [V,2]; `threads` of the CPU, None on a GPU."""
    batch = GPU_BATCH if threads is None and config.minutes is not None else BATCH
    chosen = (
        Settings(UNBOUNDED, 1, (4.0, 0.4), 2e-3, 2e-2, batch)
        if unbounded
        else Settings(bounded_resolution(sizes, rays(config, threads)), 2, (8.0, 2.0), 2e-5, 3e-3, batch)
    )
    named = {field.name: getattr(config, field.name) for field in dataclasses.fields(Settings)}
    return dataclasses.replace(chosen, **{name: value for name, value in named.items() if value is not None})


def rays(config: VoxelConfig, threads: int | None) -> float:
    """How many rays a training takes, about; infinite on a GPU by the clock."""
    if config.minutes is None:
        return float(config.steps * (config.batch_rays or BATCH))
    return math.inf if threads is None else 60.0 * config.minutes * threads * RAYS_PER_SECOND


def bounded_resolution(sizes: NDArray[np.int64], rays: float) -> int:
    """Vertices along the longest axis for photos of these sizes [V,2] and so many rays; a multiple of 8."""
    side = float(np.median(sizes.max(axis=1)))
    found = min(VOXELS_PER_PIXEL * side, math.sqrt(rays / RAYS_PER_VOXEL), LARGEST)
    return int(max(SMALLEST, 8 * round(found / 8)))
