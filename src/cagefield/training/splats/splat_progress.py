"""Progress report of a SplatField's training."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SplatProgress:
    """Progress of a run: `done` in [0,1], running mean squared error and its PSNR, seconds, splats."""

    done: float
    step: int
    loss: float
    psnr: float
    seconds: float
    seconds_left: float
    splats: int

    def __str__(self) -> str:
        """Loss, PSNR, speed and number of splats."""
        rate = self.step / max(self.seconds, 1e-9)
        return f"loss {self.loss:.5f}, PSNR {self.psnr:.1f} dB, {rate:.0f} photos/s, {self.splats} splats"
