"""Fields trained on captures, whatever their kind, and how the benchmarks look at them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.datasets import Dataset
from cagefield.edits import EditStack
from cagefield.errors import CagefieldError
from cagefield.images.render_result import Background, RenderResult
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.typing import Float32

Show = Callable[[Camera], RenderResult]
CaptureField = Literal["splat", "voxel"]

SAMPLES = 256
"""Samples along a ray whose opacity is summed up."""

_CHUNK = 1 << 19


@dataclass(frozen=True)
class Learnt:
    """A trained field: its kind, its number of splats or voxels, how long it took, and its pictures.

    `opacity_before(camera, pixels, distances)` is the opacity [K] gathered along the rays through the centers
    of pixels [K,2] (column, row) before distances [K]; `edited(edits)` shows the field under an edit stack.
    """

    kind: str
    elements: int
    seconds: float
    steps: int
    show: Show
    opacity_before: Callable[[Camera, NDArray[Any], NDArray[Any]], NDArray[Any]]
    edited: Callable[[EditStack], Show]


@dataclass(frozen=True)
class Budget:
    """How long and how large: minutes, or `steps` where they are given; None takes the trainer's own."""

    minutes: float = 5.0
    steps: int | None = None
    splats: int | None = None
    resolution: int = 256
    sh_degree: int | None = None
    seed: int = 0
    robust: bool = False


def learn(dataset: Dataset, kind: str, budget: Budget, on_progress: Callable[[Any], None]) -> Learnt:
    """The field of that kind trained on the data set.

    Raises CagefieldError for another kind, KeyboardInterrupt where the training was interrupted.
    """
    trainers = {"splat": _splats, "voxel": _voxels}
    if kind not in trainers:
        raise CagefieldError(f"fields of captures are {', '.join(trainers)}, not {kind!r}")
    return trainers[kind](dataset, budget, on_progress)


def _splats(dataset: Dataset, budget: Budget, on_progress: Callable[[Any], None]) -> Learnt:
    from cagefield.rendering.splats.splat_renderer import SplatRenderer
    from cagefield.training.splats.train_splats import train_splat

    result = train_splat(dataset, splat_config(budget), on_progress=on_progress, evaluate=False)
    if not result.finished:
        raise KeyboardInterrupt
    renderer = SplatRenderer(result.field)
    behind = "white" if dataset.white_background else "black"
    show = _show(renderer, behind)

    def before(camera: Camera, pixels: NDArray[Any], distances: NDArray[Any]) -> NDArray[Any]:
        return renderer.opacity_before(camera, pixels + 0.5, distances)

    def edited(edits: EditStack) -> Show:
        return _show(renderer.with_edits(edits), behind)

    return Learnt("splat", len(result.field), result.seconds, result.steps, show, before, edited)


def _show(renderer: Any, background: Background) -> Show:
    """Pictures of a renderer over a background."""

    def show(camera: Camera) -> RenderResult:
        frame: RenderResult = renderer.render(camera, background=background)
        return frame

    return show


def splat_config(budget: Budget) -> SplatConfig:
    """The configuration of the splats' trainer for a budget."""
    return SplatConfig(
        steps=SplatConfig.steps if budget.steps is None else budget.steps,
        minutes=budget.minutes if budget.steps is None else None,
        splats=budget.splats,
        sh_degree=SplatConfig.sh_degree if budget.sh_degree is None else budget.sh_degree,
        seed=budget.seed,
        robust=budget.robust,
    )


def _voxels(dataset: Dataset, budget: Budget, on_progress: Callable[[Any], None]) -> Learnt:
    from cagefield.training.voxels.train_voxels import train_voxel
    from cagefield.training.voxels.voxel_config import VoxelConfig

    config = VoxelConfig(
        steps=VoxelConfig.steps if budget.steps is None else budget.steps,
        minutes=budget.minutes if budget.steps is None else None,
        resolution=budget.resolution,
        sh_degree=VoxelConfig.sh_degree if budget.sh_degree is None else budget.sh_degree,
        seed=budget.seed,
    )
    result = train_voxel(dataset, config, on_progress=on_progress, evaluate=False)
    if not result.finished:
        raise KeyboardInterrupt
    from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer

    renderer = VoxelRenderer(result.field)

    behind = "white" if dataset.white_background else "black"

    def before(camera: Camera, pixels: NDArray[Any], distances: NDArray[Any]) -> NDArray[Any]:
        return sampled_opacity(result.field, camera, pixels, distances)

    def edited(edits: EditStack) -> Show:
        return _show(renderer.with_edits(edits), behind)

    shown = _show(renderer, behind)
    return Learnt("voxel", len(result.field.vertices), result.seconds, result.steps, shown, before, edited)


def sampled_opacity(
    field: Callable[[Float32, Float32], tuple[Any, Any]],
    camera: Camera,
    pixels: NDArray[Any],
    distances: NDArray[Any],
    samples: int = SAMPLES,
) -> NDArray[np.float64]:
    """Opacity [K] of a field before distances [K] along the rays of pixels [K,2].

    1 - exp(-sum sigma delta), of samples in the middle of equal steps.
    """
    origins, directions = camera.rays(pixels)
    depth = np.zeros(len(pixels))
    middles = (np.arange(samples) + 0.5) / samples
    rows = max(1, _CHUNK // samples)
    for start in range(0, len(pixels), rows):
        some = slice(start, start + rows)
        t = (np.asarray(distances)[some, None] * middles).astype(np.float32)
        points = origins[some, None] + t[..., None] * directions[some, None]
        along = np.broadcast_to(directions[some, None], points.shape)
        sigma, _ = field(points.reshape(-1, 3), np.ascontiguousarray(along).reshape(-1, 3))
        depth[some] = np.asarray(sigma, np.float64).reshape(t.shape).sum(axis=1)
    return 1.0 - np.exp(-depth * np.asarray(distances, np.float64) / samples)
