"""Training of a NerfField with nerf-pytorch's recipe.

Each step takes random rays of the training photos (in the first `precrop_steps` steps from the photos' middle
halves), renders the rays with stratified samples, and minimizes |C_coarse - C|^2 + |C_fine - C|^2 with Adam;
the learning rate falls to a tenth over `lr_decay_steps` steps. Photos with alpha are composited on white. The
rays of a batch come from one photo, as in nerf-pytorch for Blender scenes, or, for an unbounded capture, from
up to PHOTOS_PER_BATCH photos. An unbounded capture is first moved to a normalized world
(`training.nerf.nerf_space`) and has no precrop.

On a CUDA device with bfloat16 the networks run in bfloat16; weights, encodings and sums stay float32.

Source: Mildenhall et al., "NeRF" (2020), section 5.3 and the authors' code.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cagefield.datasets.views import Dataset, View
from cagefield.fields.nerf_field import NerfField
from cagefield.rendering.nerf.nerf_renderer import Rays, trace
from cagefield.training.evaluation import Evaluation, ViewMetrics, composite_on_white
from cagefield.training.loop import run_to_end
from cagefield.training.nerf.nerf_config import NerfConfig
from cagefield.training.nerf.nerf_run import NerfProgress, NerfRun
from cagefield.training.nerf.nerf_space import SamplingSpace
from cagefield.training.result import TrainResult


@dataclass(frozen=True, eq=False, kw_only=True)
class NerfResult(TrainResult[NerfField]):
    """A trained NerfField with its sampling space, whose data set has the cameras in the field's world."""

    space: SamplingSpace


def train_nerf(
    dataset: Dataset,
    config: NerfConfig | None = None,
    *,
    checkpoint: Path | str | None = None,
    resume: bool = False,
    on_progress: Callable[[NerfProgress], None] | None = None,
) -> NerfResult:
    """NerfField trained on a data set's photos, with its metrics.

    With `checkpoint` the state of the run is written every minute and at the end, which Ctrl-C brings early
    (`finished` is then False). `resume` continues the checkpoint; a finished one takes no further step.

    Raises:
        CagefieldError: NDC for a capture that is not forward-facing, or a checkpoint without folder,
            unreadable, or of other options.
    """
    run = NerfRun(dataset, config or NerfConfig())
    finished = run_to_end(run, checkpoint=checkpoint, resume=resume, on_progress=on_progress)
    field = run.field()
    train, test = (
        evaluate_nerf(field, views[:: max(1, len(views) // 4)][:4])
        for views in (run.dataset.train, run.dataset.test)
    )
    return NerfResult(
        field=field,
        space=run.space,
        steps=run.step,
        seconds=run.seconds,
        train_psnr=train.psnr,
        test=test,
        finished=finished,
        cameras=tuple(view.camera for view in run.dataset.train),
    )


def evaluate_nerf(field: NerfField, views: tuple[View, ...], pixels: int = 2500) -> Evaluation:
    """Raw PSNRs of views, on about `pixels` pixels of each; alpha is composited on white.

    A subset of pixels has neither a color-corrected PSNR nor an SSIM: both are NaN.
    """
    metrics = []
    for view in views:
        photo, camera = composite_on_white(view.load()), view.camera
        step = max(1, round((camera.width * camera.height / pixels) ** 0.5))
        j, i = np.meshgrid(np.arange(0, camera.height, step), np.arange(0, camera.width, step), indexing="ij")
        indices = np.stack([i.ravel(), j.ravel()], axis=1)
        valid = view.valid_pixels()
        if valid is not None:
            indices = indices[valid[indices[:, 1], indices[:, 0]]]
        if not len(indices):
            continue
        rgb, opacity, _ = trace(field.torch, Rays.from_camera(camera, field.torch.device, indices))
        background = 1.0 if view.load().shape[2] == 4 else 0.0
        image = rgb.cpu().numpy() + background * (1.0 - opacity.cpu().numpy()[:, None])
        error = np.mean((np.clip(image, 0, 1) - photo[indices[:, 1], indices[:, 0]]) ** 2)
        psnr = -10.0 * float(np.log10(max(float(error), 1e-10)))
        metrics.append(ViewMetrics(view.name, psnr, float("nan"), float("nan")))
    return Evaluation(tuple(metrics))
