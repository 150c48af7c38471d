"""Training of a VoxelField: coarse to fine, pruned by weight, diagonal Gauss-Newton steps.

A run is a sequence of stages. Each stage is a grid: the stored vertices of the stage before, pruned by the
largest weight they got in any training ray, cropped to what is left (bounded scenes) and refined. Within a
stage, batches of pixel patches are marched (`kernels.march_batch`) and every voxel that they met is updated
(`kernels.gauss_newton`). Patches that meet no occupied block any more are left out of the batches: their
gradients are zero. At the end, specks are taken out of a bounded scene's field, and
what no photo showed of it is filled.

On a CPU a run of given `steps` gives the same field for the same seed and number of threads.
"""

from __future__ import annotations

import dataclasses
import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cagefield import devices
from cagefield.datasets.views import Dataset, View
from cagefield.devices import floats, ints
from cagefield.errors import CagefieldError, DatasetError
from cagefield.fields.seen import seen_by
from cagefield.fields.voxel import VoxelField
from cagefield.rendering.metrics import psnr, ssim
from cagefield.training.filling import filled
from cagefield.training.photos import Photos
from cagefield.training.progress import Progress, Snapshots
from cagefield.training.running import run_to_end
from cagefield.training.specks import without_specks

if TYPE_CHECKING:
    from cagefield.training.grid_state import GridState

STAGES = ((0.25, 0.0), (0.4375, 0.06), (0.75, 0.18), (1.0, 0.4))
"""(fraction of the final resolution, progress at which the stage starts)."""

PRUNE_WITHIN = 0.4
"""A stage is pruned once more after this share of it."""


_SCALARS = (
    "step", "stage", "stage_began", "pruned", "seconds", "rays", "running_loss", "epoch", "position",
)  # fmt: skip

LEAST_STEPS = 60
"""Steps that a stage has at least when a run is limited by time."""


@dataclass(frozen=True)
class VoxelConfig:
    """How a VoxelField is trained.

    Attributes:
        steps: number of batches.
        minutes: train for this long instead of `steps`; the result then depends on the machine's speed.
        resolution: vertices along the longest axis at the end.
        sh_degree: degree of the colour's spherical harmonics, 0 to 2.
        seed: of the batches, jitter and random backgrounds.
        batch_rays: rays a batch; doubled for the last stage.
        patch: edge of a pixel patch.
        rate: (first, last) learning rate.
        decay: of the running curvatures, for each touch of a voxel.
        damping: added to every curvature.
        largest_step: largest change of a voxel's optical depth in one step.
        smooth: weight of the Laplacian regularisation; None takes 2e-4, or 2e-3 for an unbounded capture.
        plain: weight of a penalty on the colour's dependence on the view, relative to what the photos say:
            what was seen from one side alone keeps its colour on the others, where it would take a wild one.
        prune: vertices whose largest weight stayed under this are dropped.
        step: distance between samples, in voxels.
        distortion: weight of mip-NeRF 360's distortion loss, against floaters.
        near: distance, relative to the cameras' median distance to the centre, within which an unbounded
            scene is empty.
        exposure: fit a colour gain to each photo; None does so for captures without alpha.
    """

    steps: int = 8000
    minutes: float | None = None
    resolution: int = 256
    sh_degree: int = 1
    seed: int = 0
    batch_rays: int = 4096
    patch: int = 4
    rate: tuple[float, float] = (4.0, 0.4)
    decay: float = 0.95
    damping: float = 0.05
    largest_step: float = 0.3
    smooth: float | None = None
    plain: float = 2e-2
    prune: float = 0.01
    step: float = 0.7
    exposure: bool | None = None
    distortion: float = 0.0
    near: float = 0.15

    def __post_init__(self) -> None:
        limits = {
            "steps": (1, 10**8),
            "resolution": (16, 1024),
            "sh_degree": (0, 2),
            "patch": (1, 64),
            "batch_rays": (self.patch**2, 2**22),
        }
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise CagefieldError(f"{name} is {value}; it must be from {low} to {high}")
        if self.minutes is not None and not 0 < self.minutes < 1e5:
            raise CagefieldError(f"minutes is {self.minutes}; it must be above 0")
        if not 0 < self.decay < 1:
            raise CagefieldError(f"decay is {self.decay}; it must be between 0 and 1")


@dataclass(frozen=True, eq=False)
class TrainResult:
    """A trained field and its figures; PSNR and SSIM are means over views, NaN where there are none."""

    field: VoxelField
    steps: int
    seconds: float
    train_psnr: float
    test_psnr: float
    test_ssim: float
    gains: NDArray[np.float32]
    finished: bool


def train_voxel(
    dataset: Dataset,
    config: VoxelConfig | None = None,
    *,
    checkpoint: Path | None = None,
    resume: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    snapshots: Snapshots | None = None,
    evaluate: bool = True,
) -> TrainResult:
    """The field trained on the data set's photos, with PSNR and SSIM on its test views.

    With `checkpoint`, the state of the run is written there every minute and when it is interrupted
    (Ctrl-C ends the run early, `finished` is then False); `resume` goes on from it. On a CPU a resumed run
    of given `steps` ends in the same field as an uninterrupted one. `snapshots` are handed out on the way.

    Raises:
        DatasetError: no photos, or photos that cannot be read.
        CagefieldError: a checkpoint that cannot be read or was written with another configuration.
    """
    from cagefield.training.unseen import unseen

    devices.start()
    run = _Run(dataset, config or VoxelConfig())

    def snapshot(before: tuple[int, float]) -> None:
        if snapshots is not None and snapshots.due(before, (run.step, run.seconds)):
            snapshots.on_field(run.progress(), run.field())

    finished = run_to_end(
        run, checkpoint=checkpoint, resume=resume, on_progress=on_progress, after_step=snapshot
    )
    field = run.field()
    if not field.contracted:
        field = filled(field, unseen(field, [view.camera for view in dataset.train]))
    train_psnr = test_psnr = test_ssim = float("nan")
    if evaluate and len(field.vertices):
        some = dataset.train[:: max(1, len(dataset.train) // 10)]
        train_psnr, _ = evaluate_views(field, some)
        if dataset.test:
            test_psnr, test_ssim = evaluate_views(field, dataset.test)
    return TrainResult(
        field, run.step, run.seconds, train_psnr, test_psnr, test_ssim, run.exposure_gains(), finished
    )


def evaluate_views(field: VoxelField, views: tuple[View, ...]) -> tuple[float, float]:
    """(PSNR, SSIM) of the field's pictures against photos, means over views; alpha is composited on white."""
    from cagefield.rendering.renderer import Renderer

    renderer = Renderer(field)
    scores = []
    for view in views:
        photo = view.load().astype(np.float32) / 255.0
        if photo.shape[2] == 4:
            photo = photo[..., :3] * photo[..., 3:] + (1.0 - photo[..., 3:])
            frame = renderer.render(view.camera, background="white")
        else:
            frame = renderer.render(view.camera, background="black")
        if frame is not None:
            rgb = np.clip(frame.rgb, 0.0, 1.0)
            scores.append((psnr(rgb, photo), ssim(rgb, photo)))
    means = np.mean(scores, axis=0)
    return float(means[0]), float(means[1])


class _Run:
    """The state of one training run."""

    def __init__(self, dataset: Dataset, config: VoxelConfig) -> None:
        from cagefield.rendering.grid import to_device
        from cagefield.training.grid_state import GridState

        self.config = config
        self.dataset = dataset
        self.photos = Photos.load(dataset.train)
        self.exposure = (not self.photos.has_alpha) if config.exposure is None else config.exposure
        self.contracted = dataset.unbounded
        self.smooth = config.smooth if config.smooth is not None else (2e-3 if self.contracted else 2e-4)
        self.workers = 1 if devices.is_gpu() else devices.threads()
        self.bounds = np.array(dataset.bounds, dtype=np.float64)
        if self.contracted:
            half = (self.bounds[1] - self.bounds[0]).max() / 2
            middle = self.bounds.mean(axis=0)
            self.bounds = np.stack([middle - half, middle + half])
        self.near = 0.0
        self.reach = float((self.bounds[1] - self.bounds[0]).max()) / 2
        keep = None
        first = self._resolution(0)
        if self.contracted:
            self.near = config.near * float(
                np.median([np.linalg.norm(v.camera.origin - middle) for v in dataset.train])
            )
            keep = _seen_vertices(dataset.train, self.bounds, first, self.near)
        self.all_patches = self.photos.patches(config.patch)
        self.step = 0
        self.stage = 0
        self.stage_began = 0
        self.pruned = True
        self.cold = True
        self.seconds = 0.0
        self.rays = 0
        self.running_loss = float("nan")
        self.epoch = 0
        self.position = 0
        self.gain_sums = np.zeros((len(dataset.train), 6))
        self.gains = to_device(np.ones((len(dataset.train), 3), np.float32))
        self._buffers: dict[int, tuple[Any, Any, Any, Any]] = {}
        self._notes: tuple[int, Any] | None = None
        self.grid: GridState = GridState.dense(
            *((self.bounds, (first,) * 3) if self.contracted else _cubic_voxels(self.bounds, first)),
            opacity=0.5 / first,
            degree=config.sh_degree,
            contracted=self.contracted,
            workers=self.workers,
            keep=keep,
        )
        self._choose_patches()

    # -- schedule ---------------------------------------------------------------------------------------

    @property
    def done(self) -> float:
        """Progress of the run, 0 to 1."""
        if self.config.minutes is not None:
            return min(1.0, self.seconds / (60.0 * self.config.minutes))
        return min(1.0, self.step / self.config.steps)

    def _resolution(self, stage: int) -> int:
        return max(16, round(STAGES[stage][0] * self.config.resolution))

    def advance(self) -> None:
        """One batch; before it, the next stage or a pruning where one is due."""
        began = time.perf_counter()
        done = self.done
        if self._stage_is_over(done):
            self.stage += 1
            self.stage_began = self.step
            self._next_grid()
        elif not self.pruned:
            start = STAGES[self.stage][1]
            end = STAGES[self.stage + 1][1] if self.stage + 1 < len(STAGES) else 1.0
            if done >= start + PRUNE_WITHIN * (end - start):
                self._prune()
                self.pruned = True
        self._batch(done)
        self.step += 1
        # The first batch of a process compiles the kernels, which is no training.
        self.seconds += 0.0 if self.cold else time.perf_counter() - began
        self.cold = False

    def _stage_is_over(self, done: float) -> bool:
        if self.stage + 1 == len(STAGES) or done < STAGES[self.stage + 1][1]:
            return False
        # By the clock, a slow machine could reach a stage's end before its grid has learnt anything.
        return self.config.minutes is None or self.step - self.stage_began >= LEAST_STEPS

    def _next_grid(self) -> None:
        self._prune(choose=False)
        resolution = self._resolution(self.stage)
        if self.contracted:
            self.grid = self.grid.refined(self.bounds, (resolution,) * 3)
        else:
            self.grid = self.grid.refined(*_cubic_voxels(self.grid.support(), resolution))
        self.pruned = False
        self._choose_patches()

    def _prune(self, choose: bool = True) -> None:
        pruned = self.grid.pruned(self.config.prune)
        if len(pruned.vertices) < 8:
            raise DatasetError(
                "training lost the scene: no voxel got any weight; check the camera poses and their axes "
                "(OpenGL: looking along -z), and that `bounds` holds the scene"
            )
        self.grid = pruned
        if choose:
            self._choose_patches()

    # -- batches ----------------------------------------------------------------------------------------

    def _choose_patches(self) -> None:
        """Leave out the patches that meet no occupied block."""
        from cagefield.rendering.grid import to_device
        from cagefield.training import kernels

        self.patches = self.all_patches
        if not self.contracted and self.stage > 0:
            grid = self.grid
            lower, scale = self._transform()
            count = len(self.all_patches)
            touched = to_device(np.zeros(count, np.int32))
            kernels.touched_patches(
                touched,
                to_device(self.all_patches),
                count,
                self.config.patch,
                self.photos.views,
                self.photos.poses,
                self.photos.directions,
                grid.codes,
                ints(grid.brick_dims),
                floats(lower),
                floats(scale),
                ints(grid.resolution),
                self.near,
            )
            self.patches = self.all_patches[touched.to_numpy() > 0]
        self._shuffle()

    def _shuffle(self) -> None:
        self.epoch += 1
        self.position = 0
        self._order()

    def _order(self) -> None:
        self.order = np.random.default_rng((self.config.seed, self.epoch)).permutation(len(self.patches))

    def _transform(self) -> tuple[list[float], list[float]]:
        if self.contracted:
            half = (self.bounds[1] - self.bounds[0]) / 2
            return self.bounds.mean(axis=0).tolist(), (1.0 / half).tolist()
        n = np.array(self.grid.resolution) - 1
        return self.grid.bounds[0].tolist(), (n / (self.grid.bounds[1] - self.grid.bounds[0])).tolist()

    def _batch(self, done: float) -> None:
        from cagefield.loops import deal_of
        from cagefield.training import kernels

        config, grid, photos = self.config, self.grid, self.photos
        last = self.stage + 1 == len(STAGES)
        count = min(len(self.patches), (1 + last) * config.batch_rays // config.patch**2)
        if self.position + count > len(self.patches):
            self._shuffle()
        chosen = self.patches[self.order[self.position : self.position + count]]
        self.position += count
        rays = count * config.patch**2
        patches, losses, penalties, gain_sums = self._buffer(count, rays)
        patches.from_numpy(np.ascontiguousarray(chosen).reshape(-1))
        lower, scale = self._transform()
        step = config.step if self.contracted else config.step / max(scale)
        gpu = devices.is_gpu()
        kernels.march_batch(
            patches,
            count,
            config.patch,
            count if gpu else self.workers,
            deal_of(count if gpu else self.workers, 1),
            self.step + 1000003 * config.seed,
            photos.views,
            photos.poses,
            self.gains,
            photos.directions,
            photos.pixels,
            grid.codes,
            grid.index,
            grid.density,
            grid.sh,
            grid.accumulator,
            grid.record,
            self._scratch(count if gpu else self.workers),
            losses,
            penalties,
            gain_sums,
            ints(grid.brick_dims),
            ints(grid.resolution),
            floats(lower),
            floats(scale),
            step,
            self.near,
            config.distortion,
            self.reach,
            1,
            floats((1.0, 1.0, 1.0)),
            grid.terms,
            self.contracted,
            gpu,
        )
        if self.smooth > 0:
            kernels.laplacian(
                grid.density,
                grid.sh,
                grid.index,
                grid.vertex_at,
                grid.cell,
                grid.accumulator,
                grid.slots,
                ints(grid.resolution),
                self.smooth,
                self.smooth,
                grid.terms,
            )
        rate = config.rate[0] * (config.rate[1] / config.rate[0]) ** done
        kernels.gauss_newton(
            grid.density,
            grid.sh,
            grid.state,
            grid.weight,
            grid.cell,
            grid.accumulator,
            grid.record,
            self.workers,
            grid.slots,
            config.decay,
            rate,
            rate,
            config.largest_step,
            config.damping,
            config.plain,
            grid.terms,
        )
        loss = float(losses.to_numpy().mean()) / 3.0
        self.running_loss = loss if not self.running_loss > 0 else 0.98 * self.running_loss + 0.02 * loss
        self.rays += rays
        if self.exposure:
            self._fit_exposure(chosen[:, 0], gain_sums.to_numpy().reshape(count, -1, 6).sum(axis=1))

    def _buffer(self, count: int, rays: int) -> tuple[Any, Any, Any, Any]:
        import quadrants as qd

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
        import quadrants as qd

        from cagefield.training.kernels import MOST_SAMPLES, SAMPLE

        if self._notes is None or self._notes[0] != workers:
            self._notes = (workers, qd.ndarray(qd.f32, (workers * MOST_SAMPLES * SAMPLE,)))
        return self._notes[1]

    # -- exposure ---------------------------------------------------------------------------------------

    def _fit_exposure(self, views: NDArray[np.int32], sums: NDArray[np.float32]) -> None:
        """Least-squares gain of each photo from decayed sums of C photo and C C; their mean stays 1."""
        self.gain_sums *= 0.995
        np.add.at(self.gain_sums, views, sums)
        if self.step % 50 == 49 and self.done > 0.05:
            self.gains.from_numpy(self.exposure_gains().reshape(-1))

    def exposure_gains(self) -> NDArray[np.float32]:
        """Colour gain [V,3] of each photo."""
        if not self.exposure:
            return np.ones((len(self.dataset.train), 3), np.float32)
        prior = 0.05 * self.gain_sums[:, 3:].mean(axis=0) + 1e-6
        gains = (self.gain_sums[:, :3] + prior) / (self.gain_sums[:, 3:] + prior)
        gains = np.clip(gains, 0.5, 2.0)
        return np.asarray(gains / gains.mean(axis=0), np.float32)

    # -- reports and checkpoints ------------------------------------------------------------------------

    def field(self) -> VoxelField:
        """The field as it is now; that of a bounded scene without specks."""
        field = self.grid.to_field()
        return field if self.contracted else without_specks(field)

    def progress(self) -> Progress:
        """Where the run stands."""
        done = self.done
        left = self.seconds * (1.0 - done) / done if done > 0 else float("nan")
        if self.config.minutes is not None:
            left = 60.0 * self.config.minutes - self.seconds
        return Progress(
            done=done,
            step=self.step,
            loss=self.running_loss,
            psnr=-10.0 * float(np.log10(max(self.running_loss, 1e-10))),
            rays_per_second=self.rays / max(self.seconds, 1e-9),
            seconds=self.seconds,
            seconds_left=max(left, 0.0),
            resolution=max(self.grid.resolution),
            voxels=len(self.grid.vertices),
        )

    def store(self, path: Path) -> None:
        """Writes the run's state, atomically."""
        density, sh, state, weight = self.grid.arrays()
        scalars = {name: getattr(self, name) for name in _SCALARS}
        draft = path.with_name(path.name + ".part")
        with open(draft, "wb") as file:
            np.savez(
                file,
                scalars=json.dumps(scalars),
                config=self._signature(),
                bounds=self.grid.bounds,
                resolution=self.grid.resolution,
                vertices=self.grid.vertices,
                density=density,
                sh=sh,
                state=state,
                weight=weight,
                patches=self.patches,
                gain_sums=self.gain_sums,
                gains=self.gains.to_numpy(),
            )
        os.replace(draft, path)

    def restore(self, path: Path) -> None:
        """Takes the run's state from a file written by `store`."""
        from cagefield.rendering.grid import to_device
        from cagefield.training.grid_state import GridState

        try:
            with np.load(path, allow_pickle=False) as file:
                data = {name: file[name] for name in file.files}
            scalars = json.loads(str(data["scalars"]))
        except (OSError, ValueError, KeyError, EOFError) as error:
            raise CagefieldError(
                f"{path}: not a readable checkpoint ({error}); start without resume"
            ) from error
        except Exception as error:  # zipfile raises its own classes on damaged archives
            raise CagefieldError(
                f"{path}: not a readable checkpoint ({error}); start without resume"
            ) from error
        if str(data["config"]) != self._signature():
            raise CagefieldError(f"{path}: written for other photos or settings; start without resume")
        for name, value in scalars.items():
            setattr(self, name, value)
        resolution = tuple(int(n) for n in data["resolution"])
        self.grid = GridState.build(
            data["bounds"],
            (resolution[0], resolution[1], resolution[2]),
            data["vertices"],
            data["density"],
            data["sh"],
            data["state"],
            contracted=self.contracted,
            workers=self.workers,
        )
        self.grid.weight.from_numpy(np.concatenate([np.zeros(1, np.float32), data["weight"]]))
        self.patches = data["patches"]
        self.gain_sums = data["gain_sums"]
        self.gains = to_device(data["gains"].astype(np.float32))
        self._order()

    def _signature(self) -> str:
        settings = dataclasses.asdict(self.config)
        return json.dumps([settings, list(self.photos.names), self.photos.sizes.tolist()])


def _cubic_voxels(
    box: NDArray[np.float64], resolution: int
) -> tuple[NDArray[np.float64], tuple[int, int, int]]:
    """The box, grown so that cubic voxels fill it, and its vertices: `resolution` along the longest axis."""
    voxel = float((box[1] - box[0]).max()) / (resolution - 1)
    n = np.maximum(np.ceil((box[1] - box[0]) / voxel - 1e-6).astype(int) + 1, 2)
    middle = box.mean(axis=0)
    grown = np.stack([middle - (n - 1) * voxel / 2, middle + (n - 1) * voxel / 2])
    return grown, (int(n[0]), int(n[1]), int(n[2]))


def _seen_vertices(
    views: tuple[View, ...], bounds: NDArray[np.float64], resolution: int, near: float
) -> NDArray[np.bool_]:
    """Vertices [resolution^3] of a contracted grid that at least two views have in their picture.

    What fewer views see cannot be told from a floater in front of a camera.
    """
    from cagefield.fields.contraction import uncontract

    axis = np.linspace(-2.0, 2.0, resolution)
    c = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = uncontract(c) * ((bounds[1] - bounds[0]) / 2) + bounds.mean(axis=0)
    return seen_by([view.camera for view in views], points, near, least=min(2, len(views)))
