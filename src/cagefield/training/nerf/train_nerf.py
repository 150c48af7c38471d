"""Training of a NerfField with nerf-pytorch's recipe.

Each step takes random rays of the training photos (in the first `precrop` steps from their middles), renders
them with stratified samples, and descends on |C_coarse - C|^2 + |C_fine - C|^2 with Adam; the learning rate
falls to a tenth over `decay` steps. Photos with alpha are composited on white. A batch's rays are of one
photo, as nerf-pytorch's are for Blender scenes, or, of an unbounded capture, of PHOTOS photos; such a capture
is moved to a world of its own first (see `training.nerf.nerf_space`), and its `precrop` is left out.

On CUDA the networks run in bfloat16 where the device has it; weights, encodings and sums stay in float32.

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
from cagefield.training.evaluation import composited
from cagefield.training.loop import run_to_end
from cagefield.training.nerf.nerf_config import NerfConfig
from cagefield.training.nerf.nerf_run import NerfProgress, NerfRun
from cagefield.training.nerf.nerf_space import Space


@dataclass(frozen=True, eq=False)
class NerfResult:
    """A trained field and its figures; PSNRs are means over views, NaN where there are none.

    `space` holds the data set as the field's world has it, and says how rays were sampled.
    """

    field: NerfField
    space: Space
    steps: int
    seconds: float
    train_psnr: float
    test_psnr: float
    finished: bool


def train_nerf(
    dataset: Dataset,
    config: NerfConfig | None = None,
    *,
    checkpoint: Path | str | None = None,
    resume: bool = False,
    on_progress: Callable[[NerfProgress], None] | None = None,
) -> NerfResult:
    """The NerfField trained on a data set's photos.

    With `checkpoint` the state is written there every minute and at the end of the run, which may be early
    (Ctrl-C; `finished` is then False); `resume` continues it, and takes no step where it was finished.

    Raises:
        CagefieldError: NDC that do not suit the capture, or a checkpoint that has no folder, cannot be read
            or has other options.
    """
    run = NerfRun(dataset, config or NerfConfig())
    finished = run_to_end(run, checkpoint=checkpoint, resume=resume, on_progress=on_progress)
    field = run.field()
    train, test = (
        evaluate_nerf(field, views[:: max(1, len(views) // 4)][:4])
        for views in (run.dataset.train, run.dataset.test)
    )
    return NerfResult(field, run.space, run.step, run.seconds, train, test, finished)


def evaluate_nerf(field: NerfField, views: tuple[View, ...], pixels: int = 2500) -> float:
    """Mean PSNR in dB over views, on about so many pixels of each; alpha is composited on white."""
    scores = []
    for view in views:
        colours, camera = composited(view.load()), view.camera
        step = max(1, round((camera.width * camera.height / pixels) ** 0.5))
        j, i = np.meshgrid(np.arange(0, camera.height, step), np.arange(0, camera.width, step), indexing="ij")
        chosen = np.stack([i.ravel(), j.ravel()], axis=1)
        valid = view.valid_pixels()
        if valid is not None:
            chosen = chosen[valid[chosen[:, 1], chosen[:, 0]]]
        if not len(chosen):
            continue
        rgb, opacity, _ = trace(field.torch, Rays.of(camera, field.torch.device, chosen))
        behind = 1.0 if view.load().shape[2] == 4 else 0.0
        picture = rgb.cpu().numpy() + behind * (1.0 - opacity.cpu().numpy()[:, None])
        error = np.mean((np.clip(picture, 0, 1) - colours[chosen[:, 1], chosen[:, 0]]) ** 2)
        scores.append(-10.0 * np.log10(max(float(error), 1e-10)))
    return float(np.mean(scores)) if scores else float("nan")
