"""Training of a VoxelField: coarse to fine, pruned by weight, diagonal Gauss-Newton steps.

A run is a sequence of stages (`schedule`). Each stage is a grid: the stored vertices of the stage before,
pruned by the largest weight they got in any training ray, cropped to what is left (bounded scenes) and
refined. Within a stage, batches of pixel patches are marched (`kernels.march`) and every voxel that they met
is updated (`kernels.gauss_newton_voxels`). Patches that meet no occupied block any more are left out of the
batches: their gradients are zero. At the end, specks are taken out of a bounded scene's field, and what no
photo showed of it is filled.

On a CPU a run of given `steps` gives the same field for the same seed and number of threads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.datasets.views import Dataset
from cagefield.fields.voxel_field import VoxelField
from cagefield.training.evaluation import Evaluation, evaluate_views
from cagefield.training.loop import run_to_end
from cagefield.training.progress import Progress, Snapshots
from cagefield.training.voxels.inpainting import filled
from cagefield.training.voxels.voxel_config import VoxelConfig


@dataclass(frozen=True, eq=False)
class TrainResult:
    """A trained field and its figures: those of the test views, and the mean PSNR of ten training views, NaN
    where there are none."""

    field: VoxelField
    steps: int
    seconds: float
    train_psnr: float
    test: Evaluation
    gains: NDArray[np.float32]
    finished: bool

    @property
    def test_psnr(self) -> float:
        """Mean raw PSNR of the test views in dB, NaN where there are none."""
        return self.test.psnr

    @property
    def test_ssim(self) -> float:
        """Mean SSIM of the test views, NaN where there are none."""
        return self.test.ssim


def train_voxel(
    dataset: Dataset,
    config: VoxelConfig | None = None,
    *,
    checkpoint: Path | str | None = None,
    resume: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    snapshots: Snapshots | None = None,
    evaluate: bool = True,
) -> TrainResult:
    """The field trained on the data set's photos, with PSNR and SSIM on its test views.

    With `checkpoint`, the state of the run is written there every minute and at its end, which may be early
    (Ctrl-C; `finished` is then False); `resume` continues it, and takes no step where it was finished. On
    a CPU a resumed run of given `steps` ends in the same field as an uninterrupted one. `snapshots` are
    handed out on the way.

    Raises:
        DatasetError: no photos, or photos that cannot be read.
        CagefieldError: a checkpoint that cannot be read or was written with another configuration.
    """
    devices.start()
    # Modules with kernels: without a device, importing them prints a line.
    from cagefield.training.voxels.vertex_visibility import unseen_vertices
    from cagefield.training.voxels.voxel_run import VoxelRun

    run = VoxelRun(dataset, config or VoxelConfig())

    def snapshot(before: tuple[int, float]) -> None:
        if snapshots is not None and snapshots.due(before, (run.step, run.seconds)):
            snapshots.on_field(run.progress(), run.field())

    finished = run_to_end(
        run, checkpoint=checkpoint, resume=resume, on_progress=on_progress, after_step=snapshot
    )
    field = run.field()
    if not field.contracted:
        field = filled(field, unseen_vertices(field, [view.camera for view in dataset.train]))
    train, test = Evaluation(), Evaluation()
    if evaluate and len(field.vertices):
        some = dataset.train[:: max(1, len(dataset.train) // 10)]
        train, test = evaluate_views(field, some), evaluate_views(field, dataset.test)
    return TrainResult(field, run.step, run.seconds, train.psnr, test, run.exposure.values(), finished)
