"""One batch of a VoxelField's training: marched, smoothed, and every voxel it met updated."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.devices import floats, ints
from cagefield.compute.quadrants import qd
from cagefield.training.voxels.exposure import Exposure
from cagefield.training.voxels.grid_state import GridState
from cagefield.training.voxels.kernels.gauss_newton_voxels import gauss_newton, laplacian
from cagefield.training.voxels.kernels.ray_batches import PatchArgs
from cagefield.training.voxels.kernels.training_march import (
    MOST_SAMPLES,
    SAMPLE,
    BatchArgs,
    LossArgs,
    WorkerArgs,
    march_batch,
)
from cagefield.training.voxels.ray_batches import Photos
from cagefield.training.voxels.voxel_config import VoxelConfig
from cagefield.training.voxels.voxel_defaults import Settings
from cagefield.training.voxels.voxel_space import VoxelSpace

GPU_WORKERS = 1 << 15
"""Rays that a GPU marches at once: what they note takes 16 kB each."""


class Batches:
    """Batches of the patches of `photos`, and the device memory that they share."""

    def __init__(self, config: VoxelConfig, settings: Settings, photos: Photos, space: VoxelSpace) -> None:
        self._config, self._settings, self._photos, self._space = config, settings, photos, space
        self._buffers: dict[int, tuple[Any, Any, Any, Any]] = {}
        self._notes: tuple[int, Any] | None = None

    def train(
        self, grid: GridState, patches: NDArray[np.int32], exposure: Exposure, step: int, done: float
    ) -> float:
        """Mean squared error of the patches [P,3] per channel; `grid` and `exposure` have learnt from them.

        The step decides jitter and backgrounds, the progress `done` of the run the learning rate.
        """
        losses, sums = self._march(grid, patches, exposure.gains, step)
        if self._settings.smooth > 0:
            self._regularise(grid)
        self._descend(grid, done)
        if exposure.fitted:
            exposure.add(patches[:, 0], sums.to_numpy().reshape(len(patches), -1, 6).sum(axis=1))
        return float(losses.to_numpy().mean()) / 3.0

    def _march(
        self, grid: GridState, chosen: NDArray[np.int32], gains: Any, step_number: int
    ) -> tuple[Any, Any]:
        """Device arrays: losses [rays] and exposure sums [rays * 6]; the grid's accumulator is filled."""
        config, photos, space = self._config, self._photos, self._space
        count, gpu = len(chosen), devices.is_gpu()
        workers = min(count * config.patch**2, GPU_WORKERS) if gpu else grid.workers
        patches, losses, penalties, sums = self._buffer(count)
        patches.from_numpy(np.ascontiguousarray(chosen).reshape(-1))
        cells = grid.args
        step = config.step if space.contracted else config.step / float(np.max(cells.scale))
        march_batch(
            block_cyclic_schedule(workers, 1),
            PatchArgs(patches, count, config.patch),
            photos.args(gains),
            cells,
            grid.bricks,
            WorkerArgs(grid.accumulator, grid.record, self._scratch(workers), workers),
            LossArgs(losses, penalties, sums),
            BatchArgs(
                step,
                space.near,
                config.distortion,
                space.reach,
                step_number + 1000003 * config.seed,
                1,
                floats((1.0, 1.0, 1.0)),
            ),
            grid.terms,
            space.contracted,
            gpu,
        )
        return losses, sums

    def _regularise(self, grid: GridState) -> None:
        """Adds the Laplacian's gradient to the accumulator."""
        laplacian(
            grid.density,
            grid.sh,
            grid.index,
            grid.vertex_at,
            grid.cell,
            grid.accumulator,
            grid.slots,
            ints(grid.resolution),
            self._settings.smooth,
            self._settings.smooth,
            grid.terms,
        )

    def _descend(self, grid: GridState, done: float) -> None:
        """Updates the grid from its accumulator, which is empty then."""
        config = self._config
        first, last = self._settings.rate
        rate = first * (last / first) ** done
        gauss_newton(
            grid.density,
            grid.sh,
            grid.state,
            grid.weight,
            grid.cell,
            grid.accumulator,
            grid.record,
            grid.workers,
            grid.slots,
            config.decay,
            rate,
            rate,
            config.largest_step,
            config.damping,
            self._settings.plain,
            grid.terms,
        )

    def _buffer(self, count: int) -> tuple[Any, Any, Any, Any]:
        """Device arrays for so many patches: patches, losses, penalties, exposure sums."""
        rays = count * self._config.patch**2
        if count not in self._buffers:
            self._buffers = {
                count: (
                    qd.ndarray(qd.i32, (3 * count,)),
                    qd.ndarray(qd.f32, (rays,)),
                    qd.ndarray(qd.f32, (rays,)),
                    qd.ndarray(qd.f32, (6 * rays,)),
                )
            }
        return self._buffers[count]

    def _scratch(self, workers: int) -> Any:
        """Device memory in which so many workers note their samples."""
        if self._notes is None or self._notes[0] != workers:
            self._notes = (workers, qd.ndarray(qd.f32, (workers * MOST_SAMPLES * SAMPLE,)))
        return self._notes[1]
