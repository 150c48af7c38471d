"""How a NerfField is trained."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class NerfConfig:
    """How a NerfField is trained; the defaults are nerf-pytorch's for Blender scenes.

    Attributes:
        steps: number of batches.
        minutes: train for this long instead of `steps`.
        depth, width: layers of the trunk and their width, of both networks.
        octaves: (position, direction) frequencies.
        samples: (coarse, fine) on each ray of the training.
        shown_samples: those of the trained field's pictures, where even samples show what random ones average
            out; None takes as many.
        batch_rays: rays a step.
        rate: learning rate at the start.
        decay: steps over which it falls to a tenth; left out, `steps`, or as far as `minutes` got.
        precrop: steps in which rays are taken from the middle half of the photos.
        noise: standard deviation of the noise on raw densities; None takes nerf-pytorch's, 1 for a capture
            without bounds, which without it may end empty (density below its ReLU everywhere), else 0.
        ndc: train in normalised device coordinates; None does where they suit the capture.
        seed: of weights, rays and jitter.
        half: bfloat16 for the networks; None uses it on a GPU that has it.
    """

    steps: int = 200_000
    minutes: float | None = None
    depth: int = 8
    width: int = 256
    octaves: tuple[int, int] = (10, 4)
    samples: tuple[int, int] = (64, 128)
    shown_samples: tuple[int, int] | None = None
    batch_rays: int = 1024
    rate: float = 5e-4
    decay: int | None = None
    precrop: int = 500
    noise: float | None = None
    ndc: bool | None = None
    seed: int = 0
    half: bool | None = None

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
        if not 0 < self.rate < 1:
            raise CagefieldError(f"rate is {self.rate}; it must be between 0 and 1")

    @classmethod
    def small(cls, **options: Any) -> NerfConfig:
        """The preset for a CPU: 4 layers of 128, small batches at a high rate.

        24 + 24 samples a ray, 64 + 32 in pictures.
        """
        small = {
            "depth": 4,
            "width": 128,
            "samples": (24, 24),
            "shown_samples": (64, 32),
            "batch_rays": 64,
            "rate": 4e-3,
            "precrop": 100,
            "octaves": (8, 3),
        }
        return cls(**{**small, **options})
