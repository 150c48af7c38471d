"""Progress reports of a training, and snapshots of its field at chosen times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cagefield.errors import CagefieldError
from cagefield.fields.voxel_field import VoxelField


@dataclass(frozen=True)
class Progress:
    """Progress of a run: `done` in [0,1], running mean squared error and its PSNR, rays/s, seconds."""

    done: float
    step: int
    loss: float
    psnr: float
    rays_per_second: float
    seconds: float
    seconds_left: float
    resolution: int
    voxels: int

    def __str__(self) -> str:
        """Loss, PSNR, speed and grid size."""
        return (
            f"loss {self.loss:.5f}, PSNR {self.psnr:.1f} dB, {self.rays_per_second / 1e3:.0f} k rays/s, "
            f"{self.resolution}^3 grid"
        )


@dataclass(frozen=True)
class Snapshots:
    """Calls of `on_field` with the field after given steps and minutes of training.

    Time spent in `on_field` does not count as training. Several times within one step give one call; a
    resumed run skips the times before its checkpoint.

    Raises:
        CagefieldError: a step below 1, minutes that are not above 0.
    """

    on_field: Callable[[Progress, VoxelField], None]
    steps: tuple[int, ...] = ()
    minutes: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for step in self.steps:
            if step < 1:
                raise CagefieldError(f"a snapshot is asked for after step {step}; it must be at least 1")
        for minutes in self.minutes:
            if not minutes > 0:
                raise CagefieldError(f"a snapshot is asked for after {minutes} minutes; it must be above 0")

    def is_due(self, before: tuple[int, float], now: tuple[int, float]) -> bool:
        """Whether a time lies after `before` and not after `now`, each (step, seconds)."""
        return any(before[0] < step <= now[0] for step in self.steps) or any(
            before[1] < 60.0 * minutes <= now[1] for minutes in self.minutes
        )
