"""What a person may choose of a VoxelField's training."""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class VoxelConfig:
    """How a VoxelField is trained.

    Attributes:
        steps: number of batches.
        minutes: train for this long instead of `steps`; the result then depends on the machine's speed.
        resolution: vertices along the longest axis at the end; None takes as many as the photos show and
            the training has time for (`voxel_defaults`).
        sh_degree: degree of the colour's spherical harmonics, 0 to 2; None takes 2, or 1 for an unbounded
            capture.
        seed: of the batches, jitter and random backgrounds.
        batch_rays: rays a batch, doubled for the last stage; None takes 4096, on a GPU by the clock 32768.
        patch: edge of a pixel patch.
        rate: (first, last) learning rate; None takes (8, 2), or (4, 0.4) for an unbounded capture.
        decay: of the running curvatures, for each touch of a voxel.
        damping: added to every curvature.
        largest_step: largest change of a voxel's optical depth in one step.
        smooth: weight of the Laplacian regularisation; None takes 2e-5, or 2e-3 for an unbounded capture.
        plain: weight of a penalty on the colour's dependence on the view, relative to what the photos say:
            what was seen from one side alone keeps its colour on the others, where it would take a wild one;
            None takes 3e-3, or 2e-2 for an unbounded capture.
        prune: vertices whose largest weight stayed under this are dropped.
        step: distance between samples, in voxels.
        distortion: weight of mip-NeRF 360's distortion loss, against floaters.
        near: distance, relative to the cameras' median distance to the centre, within which an unbounded
            scene is empty.
        exposure: fit a colour gain to each photo; None does so for captures without alpha.
    """

    steps: int = 8000
    minutes: float | None = None
    resolution: int | None = None
    sh_degree: int | None = None
    seed: int = 0
    batch_rays: int | None = None
    patch: int = 4
    rate: tuple[float, float] | None = None
    decay: float = 0.95
    damping: float = 0.05
    largest_step: float = 0.3
    smooth: float | None = None
    plain: float | None = None
    prune: float = 0.01
    step: float = 0.7
    exposure: bool | None = None
    distortion: float = 0.0
    near: float = 0.15

    def __post_init__(self) -> None:
        limits = {
            "steps": (1, 10**8),
            "resolution": (16, 1024),
            "sh_degree": (0, 2),
            "patch": (1, 64),
            "batch_rays": (self.patch**2, 2**22),
        }
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise CagefieldError(f"{name} is {value}; it must be from {low} to {high}")
        if self.minutes is not None and not 0 < self.minutes < 1e5:
            raise CagefieldError(f"minutes is {self.minutes}; it must be above 0")
        if not 0 < self.decay < 1:
            raise CagefieldError(f"decay is {self.decay}; it must be between 0 and 1")
