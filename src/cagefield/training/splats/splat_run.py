"""State of a SplatField's training run."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.datasets.views import Dataset
from cagefield.fields.splat_field import SplatField
from cagefield.rendering.splats.kernels.projection import AREA, TILE_PX
from cagefield.rendering.splats.rasterizer import Buffers, near_depth
from cagefield.training.checkpoint import read_checkpoint, signature_options, write_checkpoint
from cagefield.training.checkpoint_checks import (
    ArrayForm,
    check_arrays,
    check_finite,
    check_run,
    reject_damage,
)
from cagefield.training.splats.cpu_optimizer import CpuSplatOptimizer
from cagefield.training.splats.densification import needle_mask, prune_mask, split_splats
from cagefield.training.splats.free_space import FreeSpace
from cagefield.training.splats.initialization import (
    MIN_DEPTH_SHARE,
    InitialSplats,
    closer_mask,
    depth_ranges,
    initialize_splats,
    median_camera_distance,
)
from cagefield.training.splats.kernels.gauss_newton_splats import StepArgs
from cagefield.training.splats.kernels.ssim import WINDOW_PIXELS
from cagefield.training.splats.pose_optimization import POSE_START_PROGRESS, PoseRefinement
from cagefield.training.splats.robust_weights import ROBUST_START_PROGRESS, RobustWeights
from cagefield.training.splats.scaffold import Context
from cagefield.training.splats.splat_config import CHECKPOINT_KEYS, SplatConfig
from cagefield.training.splats.splat_optimizer import Photo, SplatOptimizer
from cagefield.training.splats.splat_progress import SplatProgress
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.training_views import load_views

LEVEL_END_PROGRESS = ((2, 0.04), (1, 0.15))
"""(photo level, progress until which it is used); afterwards level 0, the full size."""

SSIM_START_PROGRESS = 0.6
"""Progress from which SSIM counts; earlier SSIM favors fog over surfaces."""

DEGREE_START_PROGRESS = (0.0, 0.1, 0.3, 0.6)
"""Progress from which harmonics of each degree are trained."""

DENSIFICATION_PROGRESS = (0.02, 0.6)
"""Progress at the first and the last densification."""

DENSIFICATION_INTERVAL_STEPS = 60
"""Steps between two densifications."""

OBSTRUCTION_DEPTH_SHARE = 0.7
"""Share of a photo's least depth within which a splat in its image is fog in front of the camera."""

CARVING_INTERVAL_STEPS = 120
"""Steps between two removals of obstructing splats."""

MAX_SPLATS_PER_PIXEL = 0.15
"""Maximum number of splats per photo pixel after a run of five minutes."""

GPU_SPEEDUP = 10.0
"""Minutes of two CPU cores that count as a minute of a GPU (`benchmarks/results/splats_cuda.md`)."""

STEPS_PER_MINUTE = 800
"""Steps that count as a minute in a run limited by steps."""


def max_splats(cameras: Sequence[Camera], config: SplatConfig) -> int:
    """Maximum number of splats of a training: `config.splats`, else from the photos' pixels and the time."""
    if config.splats is not None:
        return config.splats
    pixels = float(np.median([camera.width * camera.height for camera in cameras]))
    minutes = config.steps / STEPS_PER_MINUTE
    if config.minutes is not None:
        minutes = config.minutes * (GPU_SPEEDUP if devices.is_gpu() else 1.0)
    return int(np.clip(MAX_SPLATS_PER_PIXEL * pixels * (minutes / 5.0) ** 0.5, 2000, 1_000_000))


def new_optimizer(state: SplatState, near: float, antialiased: bool) -> SplatOptimizer:
    """Optimizer on the GPU where kernels run on one, else on the CPU."""
    if devices.is_gpu():
        from cagefield.training.splats.device_optimizer import DeviceSplatOptimizer

        return DeviceSplatOptimizer(state, near, antialiased)
    return CpuSplatOptimizer(state, near, antialiased)


class SplatRun:
    """Training run of a SplatField; a `loop.Run`."""

    def __init__(
        self,
        dataset: Dataset,
        config: SplatConfig,
        seeds: InitialSplats | None = None,
        context: Context | None = None,
    ) -> None:
        """State at the start; `seeds` are initial splats, None for `initialize_splats`.

        `context` has the frozen splats and the photos' gains of a block's training.
        """
        self._config, self._dataset = config, dataset
        self.views = load_views(dataset.train)
        self._rng = np.random.default_rng(config.seed)
        self._scale = median_camera_distance([view.camera for view in dataset.train], dataset.bounds)
        self._near = near_depth(dataset.bounds)
        self._max_splats = max_splats([view.cameras[0] for view in self.views], config)
        state, self.free_distances = seeds or initialize_splats(dataset, self.views, config, self._max_splats)
        self._start_progress = 0.0 if context is None else context.start_progress
        self._keeps_splats = context is not None and context.keeps_splats
        if context is not None:
            state = context.joined(state)
        self._optimizer = new_optimizer(state, self._near, config.antialiased)
        self._depths = depth_ranges([view.cameras[0] for view in self.views], state.means)
        self._free_space = FreeSpace(
            [view.cameras[0] for view in self.views],
            [None if depth is None else depth[0] / MIN_DEPTH_SHARE for depth in self._depths],
            state.means,
        )
        alpha = self.views[0].has_alpha
        self.background = np.full(3, 1.0 if dataset.white_background else 0.0, np.float32)
        self._fits_exposure = (not alpha) if config.exposure is None else config.exposure
        self.gains = np.ones((len(self.views), 3), np.float32)
        if context is not None:
            self._fits_exposure, self.gains = False, np.array(context.gains, np.float32)
        sizes = [(view.cameras[0].width, view.cameras[0].height) for view in self.views]
        self._robust = (
            RobustWeights([(-(-h // TILE_PX), -(-w // TILE_PX)) for w, h in sizes]) if config.robust else None
        )
        self.poses = PoseRefinement(len(self.views), self._scale)
        self._buffers = Buffers()
        self._queue: list[int] = []
        self.step, self.seconds, self.running_loss = 0, 0.0, float("nan")
        self._is_first_step = True

    @property
    def state(self) -> SplatState:
        """Splats on the host; changes to them count, later steps may leave them stale."""
        return self._optimizer.state

    @property
    def done(self) -> float:
        """Progress of the training, to 1; from 0, or from where a refinement begins."""
        share = self._share
        return 1.0 if share >= 1.0 else self._start_progress + (1.0 - self._start_progress) * share

    @property
    def _share(self) -> float:
        """Share of the run's steps or minutes that are done."""
        if self._config.minutes is not None:
            return min(1.0, self.seconds / (60.0 * self._config.minutes))
        return min(1.0, self.step / self._config.steps)

    def advance(self) -> None:
        """Train one photo, after a due densification or removal of obstructions."""
        began = time.perf_counter()
        done = self.done
        if not self._keeps_splats:
            self._change_splats(done)
        if not self._queue:
            self.poses.remove_mean_motion()
            if self._robust is not None:
                self._robust.update_scale()
            self._queue = [int(n) for n in self._rng.permutation(len(self.views))]
        self.step_photo(self._queue.pop(), done)
        self.step += 1
        self.seconds += 0.0 if self._is_first_step else time.perf_counter() - began
        self._is_first_step = False

    def _change_splats(self, done: float) -> None:
        """Densify and remove obstructions where they are due."""
        if (
            self.step % DENSIFICATION_INTERVAL_STEPS == DENSIFICATION_INTERVAL_STEPS - 1
            and DENSIFICATION_PROGRESS[0] <= done < DENSIFICATION_PROGRESS[1]
        ):
            self._densify(done)
        if self.step % CARVING_INTERVAL_STEPS == CARVING_INTERVAL_STEPS - 1 and done < 0.95:
            self._remove_obstructions()

    def step_photo(self, index: int, done: float) -> None:
        """Take one step of all splats visible in a photo."""
        config, optimizer = self._config, self._optimizer
        level = next((level for level, until in LEVEL_END_PROGRESS if done < until), 0)
        camera, target = self.views[index].level(level)
        if config.refine_poses:
            camera = self.poses.camera(index, camera)
        kept = None
        if config.dropout > 0.0:
            kept = self._rng.random(len(optimizer), np.float32) >= config.dropout * done
        optimizer.render(camera, kept)
        background = self._next_background()
        gain = self.gains[index]
        rate = config.lr[0] * (config.lr[1] / config.lr[0]) ** done
        degree = max(n for n in range(config.sh_degree + 1) if done >= DEGREE_START_PROGRESS[n])
        weights = self._weights(index, level, len(target))
        tile_sums = optimizer.compare(Photo(target, weights, gain, background))
        if self._robust is not None and level == 0:
            self._robust.add(index, optimizer.slopes(), gain, self.views[index].valid_at(0))
        uses_ssim = config.ssim_lambda > 0.0 and done >= SSIM_START_PROGRESS
        if uses_ssim and min(camera.width, camera.height) >= WINDOW_PIXELS:
            optimizer.add_ssim(config.ssim_lambda)
        optimizer.backpropagate(self.free_distances[index], config.empty_space_penalty)
        if config.refine_poses and done >= POSE_START_PROGRESS:
            self.poses.step(index, *optimizer.pose_sums(), min(rate, 1.0))
        optimizer.update(self._step_args(rate, degree))
        self._update_gain(index, tile_sums)
        total = len(target) * AREA if weights is None else float(weights.sum())
        loss = float(tile_sums[:, 0].sum()) / max(3.0 * total, 1.0)
        self.running_loss = loss if not self.running_loss > 0 else 0.98 * self.running_loss + 0.02 * loss

    def _step_args(self, rate: float, degree: int) -> StepArgs:
        """Rule of the Gauss-Newton step at a learning rate, with harmonics up to a degree."""
        config = self._config
        return StepArgs(
            memory=np.array(config.ema_decay),
            rates=np.array([rate, rate, rate, rate, 0.5 * rate]),
            damping=np.array(config.damping),
            caps=np.array([config.max_step, config.max_step]),
            terms=(degree + 1) ** 2,
            scale_range=np.array([1e-5, 1e3]) * self._scale,
            pull=-config.opacity_reg,
        )

    def _weights(self, index: int, level: int, tiles: int) -> NDArray[np.float32] | None:
        """Weights [tiles,AREA] of a photo's pixels, 0 for masked pixels; None where all are 1."""
        valid = self.views[index].valid_at(level)
        is_robust = self._robust is not None and level == 0 and self.done >= ROBUST_START_PROGRESS
        if valid is None and not is_robust:
            return None
        weights = self._buffers.take("weights", (tiles, AREA), np.float32)
        weights[:] = 1.0 if valid is None else valid
        if self._robust is not None and is_robust:
            self._robust.scale_weights(index, weights)
        return weights

    def _next_background(self) -> NDArray[np.float32]:
        """Background [3] of the next image; random behind cut-outs, so that the field becomes opaque."""
        if self.views[0].has_alpha:
            return self._rng.uniform(size=3).astype(np.float32)
        return self.background

    def _update_gain(self, index: int, tile_sums: NDArray[np.float32]) -> None:
        """Update a photo's exposure gain from the sums of its tiles."""
        if not self._fits_exposure:
            return
        sums = tile_sums[:, 1:].sum(axis=0, dtype=np.float64)
        if self.done > 0.05 and sums[3:].mean() > 0:
            fit = (sums[:3] + 0.02 * sums[3:].mean()) / (sums[3:] + 0.02 * sums[3:].mean())
            self.gains[index] += 0.3 * (np.clip(fit, 0.5, 2.0) - self.gains[index])
            self.gains /= self.gains.mean(axis=0)

    def _remove_obstructions(self) -> None:
        """Remove needles, splats in free space, and splats closer to a camera than its photo's content."""
        state = self.state
        close = needle_mask(state.log_scales) | self._free_space.occupied_mask(state)
        for view, depth in zip(self.views, self._depths, strict=True):
            if depth is not None:
                close |= closer_mask(view.cameras[0], state.means, OBSTRUCTION_DEPTH_SHARE * depth[0])
        close &= ~state.frozen
        if close.any() and not close.all():
            state.take(np.flatnonzero(~close))

    def _densify(self, done: float) -> None:
        """Prune splats without effect, and split those with the largest error."""
        state, config = self.state, self._config
        pruned = prune_mask(state, config.prune_opacity, 20.0 * self._scale) & ~state.frozen
        keep = np.flatnonzero(~pruned)
        state.take(keep if len(keep) else np.arange(1))
        count = len(state) - int(state.frozen.sum())
        rounds = max(
            1.0,
            (DENSIFICATION_PROGRESS[1] - done)
            / max(done / max(self.step, 1), 1e-9)
            / DENSIFICATION_INTERVAL_STEPS,
        )
        if 0 < count < self._max_splats:
            want = int(count * ((self._max_splats / count) ** (1.0 / rounds) - 1.0))
            want = min(want, count // 2, self._max_splats - count)
            rows = np.argsort(-state.error)[:want]
            split_splats(state, rows[state.error[rows] > 0])
        state.error[:] = 0.0
        state.hits[:] = 0

    def cameras(self) -> tuple[Camera, ...]:
        """Current cameras of the photos."""
        return tuple(self.poses.camera(n, view.cameras[0]) for n, view in enumerate(self.views))

    def field(self) -> SplatField:
        """Current field, without needles and frozen splats."""
        state = self.state
        field = state.to_field(self._config.antialiased, self._dataset.bounds, self._dataset.unbounded)
        if state.frozen.any():
            field = field.take(~state.frozen)
        thin = needle_mask(field.log_scales)
        return field if thin.all() else field.take(~thin)

    def progress(self) -> SplatProgress:
        """Progress report of the run."""
        done = self._share
        left = self.seconds * (1.0 - done) / done if done > 0 else float("nan")
        if self._config.minutes is not None:
            left = 60.0 * self._config.minutes - self.seconds
        return SplatProgress(
            done=done,
            step=self.step,
            loss=self.running_loss,
            psnr=-10.0 * float(np.log10(max(self.running_loss, 1e-10))),
            seconds=self.seconds,
            seconds_left=max(left, 0.0),
            splats=len(self._optimizer),
        )

    def store(self, path: Path) -> None:
        """Write the run's state atomically."""
        scalars = {
            "step": self.step,
            "seconds": self.seconds,
            "running_loss": self.running_loss,
            "queue": self._queue,
            "random": self._rng.bit_generator.state,
        }
        state = self.state
        arrays = {field.name: getattr(state, field.name) for field in dataclasses.fields(state)}
        arrays |= {"gains": self.gains, "motions": self.poses.motions}
        if self._robust is not None:
            arrays |= {"residuals": self._robust.residuals, "visits": self._robust.visits}
            scalars["robust_scale"] = self._robust.scale
        write_checkpoint(path, self._signature(), scalars, arrays)

    def restore(self, path: Path) -> None:
        """Restore the run's state from a file written by `store`.

        Raises:
            CagefieldError: the file is unreadable, or of other photos or settings.
        """
        scalars, arrays = read_checkpoint(path, self._signature())
        with reject_damage(path):
            self._take(scalars, arrays)

    def _take(self, scalars: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> None:
        """Set the state to a checkpoint's. Raises ValueError where its scalars or arrays are inconsistent."""
        state = self.state
        own = {field.name: getattr(state, field.name) for field in dataclasses.fields(state)}
        forms: dict[str, ArrayForm] = {
            name: (str(array.dtype), ("N", *array.shape[1:])) for name, array in own.items()
        }
        count = len(self.views)
        forms |= {"gains": ("float32", (count, 3)), "motions": ("float64", (count, 6))}
        if self._robust is not None:
            forms |= {"residuals": ("float32", (len(self._robust.residuals),)), "visits": ("int64", (count,))}
            check_finite(arrays, ("residuals",))
        lengths = check_arrays(arrays, forms)
        check_finite(arrays, ("means", "log_scales", "quaternions", "logits", "sh", "gains", "motions"))
        check_run(scalars, "running_loss")
        queue = scalars["queue"]
        if len(arrays) != len(forms) or not lengths["N"]:
            raise ValueError(f"{lengths['N']} splats and {len(arrays)} arrays")
        if not isinstance(queue, list) or not set(queue) <= set(range(count)) or len(queue) > count:
            raise ValueError(f"photos that come next: {queue!s:.40}")
        self._rng.bit_generator.state = scalars["random"]
        self.gains, self.poses.motions = arrays.pop("gains"), arrays.pop("motions")
        if self._robust is not None:
            self._robust.residuals, self._robust.visits = arrays.pop("residuals"), arrays.pop("visits")
            self._robust.scale = float(scalars["robust_scale"])
        self._optimizer.state = SplatState(**arrays)
        self.step, self.seconds = scalars["step"], scalars["seconds"]
        self.running_loss, self._queue = scalars["running_loss"], [int(number) for number in queue]

    def _signature(self) -> str:
        """Options and photos that a checkpoint must share with this run."""
        sizes = [[view.cameras[0].width, view.cameras[0].height] for view in self.views]
        settings = signature_options(self._config, CHECKPOINT_KEYS)
        return json.dumps(["splats", settings, [view.name for view in self.views], sizes])
