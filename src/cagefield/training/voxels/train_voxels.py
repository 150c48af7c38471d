"""Training of a VoxelField: coarse to fine, pruned by weight, diagonal Gauss-Newton steps.

A run is a sequence of stages (`schedule`), each with its own grid: the vertices of the previous stage, pruned
by their maximum weight in any training ray, cropped to the remaining ones (bounded scenes) and refined.
Within a stage, batches of pixel patches are marched (`kernels.training_march`) and every voxel met is updated
(`kernels.gauss_newton_voxels`). Patches that meet no occupied block have zero gradients and are left out of
the batches. At the end, floaters are removed from a bounded scene's field, and vertices that no photo shows
are inpainted.

On a CPU a run of given `steps` gives equal fields for equal seeds and numbers of threads.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cagefield.compute import devices
from cagefield.datasets.views import Dataset
from cagefield.fields.voxel_field import VoxelField
from cagefield.training.evaluation import Evaluation, evaluate_views
from cagefield.training.loop import run_to_end
from cagefield.training.progress import Progress, Snapshots
from cagefield.training.result import TrainResult
from cagefield.training.voxels.inpainting import fill_unseen
from cagefield.training.voxels.voxel_config import VoxelConfig


def train_voxel(
    dataset: Dataset,
    config: VoxelConfig | None = None,
    *,
    checkpoint: Path | str | None = None,
    resume: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    snapshots: Snapshots | None = None,
    evaluate: bool = True,
) -> TrainResult[VoxelField]:
    """VoxelField trained on the data set's photos, with PSNR and SSIM on its test views.

    With `checkpoint`, the state of the run is written every minute and at the end, which Ctrl-C brings early
    (`finished` is then False); `resume` continues the checkpoint, and takes no step after a finished run. On
    a CPU a resumed run of given `steps` ends in the field of an uninterrupted one. `snapshots` get the field
    during the run.

    Raises:
        DatasetError: no photos, or unreadable photos.
        CagefieldError: a checkpoint that is unreadable or of another configuration.
    """
    devices.start()
    # Modules with kernels: without a device, importing them prints a line.
    from cagefield.training.voxels.vertex_visibility import invisible_vertices
    from cagefield.training.voxels.voxel_run import VoxelRun

    run = VoxelRun(dataset, config or VoxelConfig())

    def snapshot(before: tuple[int, float]) -> None:
        if snapshots is not None and snapshots.is_due(before, (run.step, run.seconds)):
            snapshots.on_field(run.progress(), run.field())

    finished = run_to_end(
        run, checkpoint=checkpoint, resume=resume, on_progress=on_progress, after_step=snapshot
    )
    field = run.field()
    if not field.contracted:
        field = fill_unseen(field, invisible_vertices(field, [view.camera for view in dataset.train]))
    train, test = Evaluation(), Evaluation()
    if evaluate and len(field.vertices):
        some = dataset.train[:: max(1, len(dataset.train) // 10)]
        train, test = evaluate_views(field, some), evaluate_views(field, dataset.test)
    return TrainResult(
        field,
        run.step,
        run.seconds,
        train.psnr,
        test,
        finished,
        tuple(view.camera for view in dataset.train),
        run.exposure.values(),
    )
