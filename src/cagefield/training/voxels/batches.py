"""Training batches of a VoxelField: ray march, Laplacian regularization, and the update of the voxels met."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.device_buffers import DeviceBuffers
from cagefield.compute.devices import floats, ints
from cagefield.compute.quadrants import qd
from cagefield.training.voxels.exposure import Exposure
from cagefield.training.voxels.grid_state import GridState
from cagefield.training.voxels.kernels.gauss_newton_voxels import (
    RecordArgs,
    StepArgs,
    gauss_newton,
    laplacian,
    reduce_workers,
)
from cagefield.training.voxels.kernels.ray_batches import PatchArgs
from cagefield.training.voxels.kernels.sample_lists import NOTE_FLOATS, SampleListArgs, gather_samples
from cagefield.training.voxels.kernels.training_march import (
    MAX_SAMPLES,
    SAMPLE_FLOATS,
    BatchArgs,
    LossArgs,
    WorkerArgs,
    march_batch,
)
from cagefield.training.voxels.ray_batches import DevicePhotos
from cagefield.training.voxels.voxel_config import VoxelConfig
from cagefield.training.voxels.voxel_defaults import VoxelSettings
from cagefield.training.voxels.voxel_space import VoxelSpace

MAX_GPU_RAYS = 1 << 15
"""Maximum number of rays that a GPU marches at once; the noted samples of a ray take 16 kB."""

LISTED_SAMPLES_PER_RAY = 48
"""Samples of a batch that are listed by cell on a GPU, on average per ray; a listed sample takes 68 bytes."""

LAPLACIAN_INTERVAL_BATCHES = 4
"""Batches per Laplacian, whose weight is as many times larger: to read the neighbors of the voxels met takes
half as long as the march (chair, 360^3)."""


class BatchTrainer:
    """Trains a grid on batches of pixel patches; owns the device buffers that the batches share."""

    def __init__(
        self, config: VoxelConfig, settings: VoxelSettings, photos: DevicePhotos, space: VoxelSpace
    ) -> None:
        self._config, self._settings, self._photos, self._space = config, settings, photos, space
        self._buffers: dict[int, tuple[Any, Any, Any, Any]] = {}
        self._notes: tuple[int, Any] | None = None
        self._memory = DeviceBuffers()
        self._emptied: Any = None

    def train(
        self, grid: GridState, patches: NDArray[np.int32], exposure: Exposure, step: int, done: float
    ) -> float:
        """Mean squared error per channel of the patches [P,3], before the update of `grid` and `exposure`.

        `step` seeds jitter and random backgrounds; the progress `done` sets the learning rate.
        """
        losses, sums = self._march(grid, patches, exposure.gains, step)
        if grid.workers > 1:
            reduce_workers(
                grid.accumulator,
                grid.met,
                grid.record,
                grid.workers,
                grid.slots,
                grid.group_bits,
                grid.terms,
            )
        if self._settings.laplacian_reg > 0 and step % LAPLACIAN_INTERVAL_BATCHES == 0:
            self._add_laplacian(grid)
        self._update_grid(grid, done)
        if exposure.fitted:
            exposure.add(patches[:, 0], sums.to_numpy().reshape(len(patches), -1, 6).sum(axis=1))
        return float(losses.to_numpy().mean()) / 3.0

    def _march(
        self, grid: GridState, selected: NDArray[np.int32], gains: Any, step_number: int
    ) -> tuple[Any, Any]:
        """Device arrays (losses [rays], exposure sums [rays * 6]); adds to the grid's accumulator."""
        config, photos, space = self._config, self._photos, self._space
        count, gpu = len(selected), devices.is_gpu()
        workers = min(count * config.patch_size**2, MAX_GPU_RAYS) if gpu else grid.workers
        patches, losses, penalties, sums = self._batch_buffers(count)
        patches.from_numpy(np.ascontiguousarray(selected).reshape(-1))
        cells = grid.args
        step = config.step_voxels if space.contracted else config.step_voxels / float(np.max(cells.scale))
        lists = self._sample_lists(grid, count * config.patch_size**2 if gpu else 0)
        march_batch(
            block_cyclic_schedule(workers, 1),
            PatchArgs(patches, count, config.patch_size),
            photos.args(gains),
            cells,
            grid.bricks,
            WorkerArgs(
                grid.accumulator,
                grid.met,
                grid.record,
                grid.groups,
                grid.group_bits,
                self._sample_scratch(workers),
                workers,
            ),
            LossArgs(losses, penalties, sums),
            BatchArgs(
                step,
                space.near,
                self._settings.distortion_reg,
                space.half_extent,
                step_number + 1000003 * config.seed,
                1,
                floats((1.0, 1.0, 1.0)),
            ),
            lists,
            grid.terms,
            space.contracted,
            gpu,
        )
        if gpu:
            gather_samples(
                lists,
                grid.accumulator,
                grid.met,
                grid.vertex_at,
                grid.slots,
                grid.group_bits,
                ints(grid.resolution),
                grid.terms,
            )
        return losses, sums

    def _add_laplacian(self, grid: GridState) -> None:
        """Add the gradient of the Laplacian regularization to the reduced accumulator."""
        weight = LAPLACIAN_INTERVAL_BATCHES * self._settings.laplacian_reg
        laplacian(
            grid.density,
            grid.sh,
            grid.index,
            grid.vertex_at,
            grid.cell,
            RecordArgs(grid.accumulator, grid.met, grid.slots, grid.group_bits),
            ints(grid.resolution),
            weight,
            weight,
            grid.terms,
        )

    def _update_grid(self, grid: GridState, done: float) -> None:
        """Update the grid from its reduced accumulator, and empty the accumulator."""
        config = self._config
        first, last = self._settings.lr
        rate = first * (last / first) ** done
        gauss_newton(
            grid.density,
            grid.sh,
            grid.state,
            grid.weight,
            grid.cell,
            RecordArgs(grid.accumulator, grid.met, grid.slots, grid.group_bits),
            StepArgs(
                config.curvature_decay,
                rate,
                rate,
                config.max_step,
                config.damping,
                self._settings.view_dependence_reg,
            ),
            grid.terms,
        )

    def _batch_buffers(self, count: int) -> tuple[Any, Any, Any, Any]:
        """Device arrays for `count` patches: (patches, losses, penalties, exposure sums)."""
        rays = count * self._config.patch_size**2
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

    def _sample_lists(self, grid: GridState, rays: int) -> SampleListArgs:
        """Empty lists of the samples of `rays` rays by cell."""
        room = LISTED_SAMPLES_PER_RAY * rays
        vertices = int(np.prod(grid.resolution)) if rays else 1
        heads = self._memory.exact("heads", vertices, np.int32)
        count = self._memory.exact("count", 1, np.int32)
        if self._emptied is not heads:
            # A batch leaves them empty.
            heads.fill(0)
            count.fill(0)
            self._emptied = heads
        links = self._memory.take("links", room, np.int32)
        return SampleListArgs(heads, links, self._memory.take("notes", NOTE_FLOATS * room), count, room)

    def _sample_scratch(self, workers: int) -> Any:
        """Device buffer for the samples of `workers` rays."""
        if self._notes is None or self._notes[0] != workers:
            self._notes = (workers, qd.ndarray(qd.f32, (workers * MAX_SAMPLES * SAMPLE_FLOATS,)))
        return self._notes[1]
