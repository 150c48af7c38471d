"""The result of a training run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.training.evaluation import Evaluation

F = TypeVar("F", covariant=True)


@dataclass(frozen=True, eq=False)
class TrainResult(Generic[F]):
    """A trained field and its metrics.

    Attributes:
        steps, seconds: of training.
        train_psnr: mean PSNR of several training views in dB, NaN without any.
        test: metrics of the test views.
        finished: False after Ctrl-C.
        cameras: of the training photos, in their order, with refined poses where the run refines them.
        gains: exposure gain [V,3] of each training photo; None where the trainer fits none.
    """

    field: F
    steps: int
    seconds: float
    train_psnr: float
    test: Evaluation
    finished: bool
    cameras: tuple[Camera, ...]
    gains: NDArray[np.float32] | None = None

    @property
    def test_psnr(self) -> float:
        """Mean raw PSNR of the test views in dB, NaN where there are none."""
        return self.test.psnr

    @property
    def test_ssim(self) -> float:
        """Mean SSIM of the test views, NaN where there are none."""
        return self.test.ssim
