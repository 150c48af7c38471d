"""Coarse training of a whole capture, around which its blocks are trained.

The scaffold is trained on all photos at a reduced size. It gives each block the photos' exposure gains and
frozen splats for the content outside the block, and the merged field the content that is far from all
cameras, which no block sees from enough places; the blocks' photos refine it (`refinement`).

Source: the coarse scaffold of Hierarchical 3D Gaussians (Kerbl et al. 2024, section 5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.datasets.views import Dataset
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.training_views import MIN_SIDE_PIXELS
from cagefield.typing import Float32

MIN_SPLATS = 100
"""Minimum of the maximum number of splats of a scaffold or a block."""
MAX_PIXELS = 50_000_000
"""Maximum number of the photos' pixels in a scaffold's training, as far as MIN_SIDE_PIXELS allows."""
STEPS_SHARE = 0.3
"""Steps of a scaffold, as a share of the training's."""
SPLATS_SHARE = 0.25
"""Maximum number of a scaffold's splats, as a share of the training's."""
VIEW_MARGIN = 0.25
"""Margin around a photo within which frozen splats belong to it, as a share of its size."""


class Cell(Protocol):
    """Part of space in which a block's splats are trained."""

    def trains(self, positions: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Mask [N] of positions [N,3]."""


@dataclass(frozen=True, eq=False)
class Context:
    """Surroundings of a block's training.

    Attributes:
        frozen: splats of other parts of the capture, which take part in the images and stay as they are.
        gains: [V,3] exposure gains of the block's photos, which are kept.
        cell: space in which initial splats are placed; None keeps all of them.
        start_progress: progress at which the training begins, 0 to 1: above 0 of a refinement.
        keeps_splats: no splat is split or removed, so that each keeps its row.
    """

    frozen: SplatField
    gains: Float32
    cell: Cell | None = None
    start_progress: float = 0.0
    keeps_splats: bool = False

    def joined(self, state: SplatState) -> SplatState:
        """The initial splats of `state` within the cell, and the frozen ones.

        Raises:
            CagefieldError: no initial splat lies in the cell.
        """
        if self.cell is not None:
            state.take(np.flatnonzero(self.cell.trains(state.means)))
        if not len(state):
            raise CagefieldError("a block has no points to start from; give fewer --blocks")
        state.append(SplatState.frozen_from(self.frozen, state.sh.shape[1]))
        return state


def visible_splats(field: SplatField, cameras: Sequence[Camera]) -> SplatField:
    """Splats whose means lie in front of a camera, in its photo or in a margin around it."""
    return field.take(visible_mask(field, cameras))


def visible_mask(field: SplatField, cameras: Sequence[Camera]) -> NDArray[np.bool_]:
    """Mask [N] of the splats that `visible_splats` takes."""
    means = field.means.astype(np.float64)
    shown = np.zeros(len(field), bool)
    for camera in cameras:
        pixels, depth = camera.project(means)
        size = np.array([camera.width, camera.height])
        with np.errstate(invalid="ignore"):
            inside = (pixels >= -VIEW_MARGIN * size).all(axis=1)
            shown |= inside & (pixels < (1.0 + VIEW_MARGIN) * size).all(axis=1) & (depth > 0)
    return shown


def scaffold_config(config: SplatConfig) -> SplatConfig:
    """Options of the scaffold of a training."""
    return replace(
        config,
        steps=max(1, round(STEPS_SHARE * config.steps)),
        minutes=None if config.minutes is None else STEPS_SHARE * config.minutes,
        splats=None if config.splats is None else max(MIN_SPLATS, round(SPLATS_SHARE * config.splats)),
    )


def scaffold_dataset(dataset: Dataset) -> Dataset:
    """The capture with photos of half the size, or of less where they have more than MAX_PIXELS together.

    Photos whose shorter side would have less than MIN_SIDE_PIXELS keep their size.
    """
    sizes = [(view.camera.width, view.camera.height) for view in dataset.train]
    total, shortest = sum(width * height for width, height in sizes), min(min(size) for size in sizes)
    factor = 1
    while shortest // (2 * factor) >= MIN_SIDE_PIXELS and (factor == 1 or total > factor**2 * MAX_PIXELS):
        factor *= 2
    train = tuple(view.downscaled(factor) if factor > 1 else view for view in dataset.train)
    return replace(dataset, train=train, test=(), val=())
