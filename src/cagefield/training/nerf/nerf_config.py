"""Configuration of a NerfField's training."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cagefield.errors import CagefieldError

CHECKPOINT_KEYS = {
    "render_samples": "shown_samples",
    "lr": "rate",
    "lr_decay_steps": "decay",
    "precrop_steps": "precrop",
    "raw_noise_std": "noise",
    "bfloat16": "half",
}
"""Key in a checkpoint's signature of each option that has another name there."""


@dataclass(frozen=True)
class NerfConfig:
    """Options of a NerfField's training; the defaults are nerf-pytorch's for Blender scenes.

    Attributes:
        steps: number of batches.
        minutes: training time instead of `steps`; the result then depends on the machine's speed.
        depth, width: number of trunk layers and their width, of both networks.
        octaves: (position, direction) frequencies of the positional encoding.
        samples: (coarse, fine) samples of each training ray.
        render_samples: (coarse, fine) samples of the trained field's images, whose samples are evenly spaced;
            None takes `samples`.
        batch_rays: rays per step.
        lr: initial learning rate.
        lr_decay_steps: steps over which the learning rate falls to a tenth; None takes the whole run.
        precrop_steps: initial steps that take rays from the middle half of the photos.
        raw_noise_std: standard deviation of the noise added to raw densities; None takes nerf-pytorch's, 1
            for an unbounded capture, which may end empty without noise (density below its ReLU everywhere),
            else 0.
        ndc: train in normalized device coordinates; None does so where NDC suit the capture.
        seed: seed of weights, rays and jitter.
        bfloat16: evaluate the networks in bfloat16; None does so on a GPU that has it.
    """

    steps: int = 200_000
    minutes: float | None = None
    depth: int = 8
    width: int = 256
    octaves: tuple[int, int] = (10, 4)
    samples: tuple[int, int] = (64, 128)
    render_samples: tuple[int, int] | None = None
    batch_rays: int = 1024
    lr: float = 5e-4
    lr_decay_steps: int | None = None
    precrop_steps: int = 500
    raw_noise_std: float | None = None
    ndc: bool | None = None
    seed: int = 0
    bfloat16: bool | None = None

    def __post_init__(self) -> None:
        limits = {"steps": (1, 10**8), "depth": (1, 64), "width": (2, 4096), "batch_rays": (1, 2**20)}
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise CagefieldError(f"{name} is {value}; it must be from {low} to {high}")
        if not all(0 <= count <= 16 for count in self.octaves):
            raise CagefieldError(f"octaves are {self.octaves}; each must be from 0 to 16")
        if self.minutes is not None and not 0 < self.minutes < 1e5:
            raise CagefieldError(f"minutes is {self.minutes}; it must be above 0")
        if not 0 < self.lr < 1:
            raise CagefieldError(f"lr is {self.lr}; it must be between 0 and 1")

    @classmethod
    def small(cls, **options: Any) -> NerfConfig:
        """Preset for a CPU: 4 layers of 128, small batches at a high learning rate.

        24 + 24 samples per ray, 64 + 32 in images.
        """
        small = {
            "depth": 4,
            "width": 128,
            "samples": (24, 24),
            "render_samples": (64, 32),
            "batch_rays": 64,
            "lr": 4e-3,
            "precrop_steps": 100,
            "octaves": (8, 3),
        }
        return cls(**{**small, **options})
