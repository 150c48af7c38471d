"""State of a VoxelField's training run."""

from __future__ import annotations

import dataclasses
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.datasets.views import Dataset
from cagefield.errors import DatasetError
from cagefield.fields.voxel_field import VoxelField
from cagefield.training.checkpoint import read_checkpoint, signature_options, write_checkpoint
from cagefield.training.checkpoint_checks import (
    check_arrays,
    check_counts,
    check_finite,
    check_run,
    reject_damage,
)
from cagefield.training.progress import Progress
from cagefield.training.voxels.batches import BatchTrainer
from cagefield.training.voxels.exposure import Exposure
from cagefield.training.voxels.floater_removal import remove_floaters
from cagefield.training.voxels.grid_state import GridState
from cagefield.training.voxels.pixel_patches import PatchSampler
from cagefield.training.voxels.ray_batches import DevicePhotos
from cagefield.training.voxels.schedule import MIN_RESOLUTION, Schedule, stages
from cagefield.training.voxels.voxel_config import CHECKPOINT_KEYS, VoxelConfig
from cagefield.training.voxels.voxel_defaults import resolve_settings
from cagefield.training.voxels.voxel_space import VoxelSpace

EXPOSURE_START_PROGRESS = 0.05
"""Progress from which the march uses fitted exposures."""

EXPOSURE_INTERVAL_STEPS = 50
"""Steps between two updates of the march's exposures."""

MAX_RESOLUTION = 1024
"""Maximum number of vertices along the longest axis, as in `VoxelConfig`."""


class VoxelRun:
    """Training run of a VoxelField; a `loop.Run`.

    Attributes:
        step, seconds, rays: totals of the batches so far.
        running_loss: exponential moving average of the mean squared error.
    """

    def __init__(self, dataset: Dataset, config: VoxelConfig) -> None:
        self._config, self._photos = config, DevicePhotos.load(dataset.train)
        self._space = VoxelSpace.from_dataset(dataset, config.near)
        self._threads = 1 if devices.is_gpu() else devices.threads()
        self._settings = resolve_settings(
            config,
            self._photos.sizes,
            unbounded=dataset.unbounded,
            threads=None if devices.is_gpu() else self._threads,
        )
        self._schedule = self._new_schedule(self._settings.resolution)
        self._patches = PatchSampler(self._photos, config.patch_size, config.seed)
        self._batch_trainer = BatchTrainer(config, self._settings, self._photos, self._space)
        fitted = (not self._photos.has_alpha) if config.exposure is None else config.exposure
        self.exposure = Exposure(len(dataset.train), fitted)
        self._grid = self._space.first_grid(
            dataset.train, self._schedule.resolution, self._schedule.sh_degree, self._threads
        )
        self._patches.compile(self._space, self._grid)
        self.step, self.rays = 0, 0
        self.seconds, self.running_loss = 0.0, float("nan")
        self._compiled: set[int] = set()

    def _new_schedule(self, resolution: int) -> Schedule:
        return Schedule(resolution, self._settings.sh_degree, by_clock=self._config.minutes is not None)

    @property
    def done(self) -> float:
        """Progress of the run, 0 to 1."""
        if self._config.minutes is not None:
            return min(1.0, self.seconds / (60.0 * self._config.minutes))
        return min(1.0, self.step / self._config.steps)

    def advance(self) -> None:
        """Train one batch, after a due change of stage or pruning.

        Raises:
            DatasetError: pruning removes everything.
        """
        began = time.perf_counter()
        done, schedule = self.done, self._schedule
        if schedule.is_over(done, self.step):
            schedule.enter_next(self.step)
            self._grid = self._pruned()
            # The accumulator is empty after every batch; freeing it makes room for the refined grid's.
            self._grid.accumulator = None
            self._grid = self._space.refine(self._grid, schedule.resolution, schedule.sh_degree)
            self._patches.select_occupied(self._space, self._grid)
        elif schedule.is_pruning_due(done, self.step):
            schedule.prune(self.step)
            self._grid = self._pruned()
            self._patches.select_occupied(self._space, self._grid)
        prepared = time.perf_counter()
        self.next_batch(done)
        self.step += 1
        # The first batch of each SH degree in a process compiles kernels; compilation is not training time.
        compiles = self._grid.degree not in self._compiled
        self._compiled.add(self._grid.degree)
        self.seconds += (prepared if compiles else time.perf_counter()) - began

    def next_batch(self, done: float) -> None:
        """Train one batch at this progress."""
        config = self._config
        patches = self._patches.take(
            (1 + self._schedule.is_last) * self._settings.batch_rays // config.patch_size**2
        )
        loss = self._batch_trainer.train(self._grid, patches, self.exposure, self.step, done)
        self.running_loss = loss if not self.running_loss > 0 else 0.98 * self.running_loss + 0.02 * loss
        self.rays += len(patches) * config.patch_size**2
        if (
            self.exposure.fitted
            and self.step % EXPOSURE_INTERVAL_STEPS == EXPOSURE_INTERVAL_STEPS - 1
            and done > EXPOSURE_START_PROGRESS
        ):
            self.exposure.refresh()

    def _pruned(self) -> GridState:
        """Grid without the vertices of low weight. Raises DatasetError where fewer than 8 remain."""
        pruned = self._grid.prune(self._config.prune_weight)
        if len(pruned.vertices) < 8:
            raise DatasetError(
                "training lost the scene: no voxel got any weight; check the camera poses and their axes "
                "(OpenGL: looking along -z), and that `bounds` holds the scene"
            )
        return pruned

    def field(self) -> VoxelField:
        """Current field; a bounded scene's without floaters."""
        field = self._grid.to_field()
        return field if self._space.contracted else remove_floaters(field)

    def progress(self) -> Progress:
        """Progress report of the run."""
        done = self.done
        left = self.seconds * (1.0 - done) / done if done > 0 else float("nan")
        if self._config.minutes is not None:
            left = 60.0 * self._config.minutes - self.seconds
        return Progress(
            done=done,
            step=self.step,
            loss=self.running_loss,
            psnr=-10.0 * float(np.log10(max(self.running_loss, 1e-10))),
            rays_per_second=self.rays / max(self.seconds, 1e-9),
            seconds=self.seconds,
            seconds_left=max(left, 0.0),
            resolution=max(self._grid.resolution),
            voxels=len(self._grid.vertices),
        )

    def store(self, path: Path) -> None:
        """Write the run's state atomically."""
        schedule, patches, grid = self._schedule, self._patches, self._grid
        density, sh, state, weight = grid.arrays()
        scalars = {
            "step": self.step,
            "resolution": schedule.final,
            "stage": schedule.stage,
            "stage_began": schedule.start_step,
            "pruned": schedule.is_pruned,
            "seconds": self.seconds,
            "rays": self.rays,
            "running_loss": self.running_loss,
            "epoch": patches.epoch,
            "position": patches.position,
        }
        arrays = {
            "bounds": grid.bounds,
            "resolution": grid.resolution,
            "vertices": grid.vertices,
            "density": density,
            "sh": sh,
            "state": state,
            "weight": weight,
            "patches": patches.selected,
            "gain_sums": self.exposure.sums,
            "gains": self.exposure.gains.to_numpy(),
        }
        write_checkpoint(path, self._signature(), scalars, arrays)

    def restore(self, path: Path) -> None:
        """Restore the run's state from a file written by `store`.

        Raises:
            CagefieldError: the file is unreadable, or of other photos or settings.
        """
        scalars, arrays = read_checkpoint(path, self._signature())
        with reject_damage(path):
            schedule = self._check_state(scalars, arrays)
        self._grid = GridState.build(
            arrays["bounds"],
            _triple(arrays["resolution"]),
            arrays["vertices"],
            arrays["density"],
            arrays["sh"],
            arrays["state"],
            contracted=self._space.contracted,
            threads=self._threads,
        )
        self._grid.weight.from_numpy(np.concatenate([np.zeros(1, np.float32), arrays["weight"]]))
        self.step, self.rays = scalars["step"], scalars["rays"]
        self.seconds, self.running_loss = scalars["seconds"], scalars["running_loss"]
        self._schedule = schedule
        self._patches.restore(arrays["patches"], scalars["epoch"], scalars["position"])
        self.exposure.restore(arrays["gain_sums"], arrays["gains"])

    def _check_state(self, scalars: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Schedule:
        """Schedule of a checkpoint. Raises ValueError where its scalars or arrays are inconsistent."""
        photos = len(self._photos.names)
        lengths = check_arrays(
            arrays,
            {
                "bounds": ("float64", (2, 3)),
                "resolution": ("int", (3,)),
                "vertices": ("int64", ("M",)),
                "density": ("float32", ("M",)),
                "sh": ("float32", ("M", "K", 3)),
                "state": ("float32", ("M", 2)),
                "weight": ("float32", ("M",)),
                "patches": ("int32", ("P", 3)),
                "gain_sums": ("float64", (photos, 6)),
                "gains": (str(self.exposure.gains.to_numpy().dtype), self.exposure.gains.shape),
            },
        )
        check_finite(arrays, ("bounds", "density", "sh", "state", "weight", "gain_sums", "gains"))
        check_run(scalars, "running_loss")
        check_counts(scalars, resolution=MAX_RESOLUTION, rays=2**62, epoch=2**31, position=lengths["P"])
        # In a run limited by time the resolution depends on the number of threads of the machine.
        schedule = self._new_schedule(max(scalars["resolution"], MIN_RESOLUTION))
        check_counts(scalars, stage=len(stages(schedule.final)) - 1, stage_began=scalars["step"])
        schedule = dataclasses.replace(
            schedule,
            stage=scalars["stage"],
            start_step=scalars["stage_began"],
            is_pruned=scalars["pruned"] is True,
        )
        low, high = arrays["bounds"]
        dims, vertices = arrays["resolution"], arrays["vertices"]
        if not (low < high).all() or dims.min() < 2 or dims.max() > schedule.resolution:
            raise ValueError(f"a grid of {dims.tolist()} vertices in stage {schedule.stage}")
        if lengths["K"] != (schedule.sh_degree + 1) ** 2:
            raise ValueError(f"colors of {lengths['K']} numbers in stage {schedule.stage}")
        if not len(vertices) or vertices.min() < 0 or vertices.max() >= np.prod(dims):
            raise ValueError("vertices outside of its grid")
        if len(np.unique(vertices)) != len(vertices):
            raise ValueError("vertices that are there twice")
        if not self._patches.contains_all(arrays["patches"]):
            raise ValueError("patches of no photo")
        return schedule

    def _signature(self) -> str:
        """Options and photos that a checkpoint must share with this run."""
        settings = signature_options(self._config, CHECKPOINT_KEYS) | {
            "batch_rays": self._settings.batch_rays
        }
        return json.dumps([settings, list(self._photos.names), self._photos.sizes.tolist()])


def _triple(values: Any) -> tuple[int, int, int]:
    x, y, z = (int(value) for value in values)
    return x, y, z
