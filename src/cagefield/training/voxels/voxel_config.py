"""Configuration of a VoxelField's training."""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.errors import CagefieldError

CHECKPOINT_KEYS = {
    "patch_size": "patch",
    "lr": "rate",
    "curvature_decay": "decay",
    "max_step": "largest_step",
    "laplacian_reg": "smooth",
    "view_dependence_reg": "plain",
    "prune_weight": "prune",
    "step_voxels": "step",
    "distortion_reg": "distortion",
}
"""Key in a checkpoint's signature of each option that has another name there."""


@dataclass(frozen=True)
class VoxelConfig:
    """Options of a VoxelField's training.

    Attributes:
        steps: number of batches.
        minutes: training time instead of `steps`; the result then depends on the machine's speed.
        resolution: final number of vertices along the longest axis; None chooses it from the photos' size and
            the training time (`voxel_defaults`).
        sh_degree: degree of the color's spherical harmonics, 0 to 2; None takes 2, or 1 for an unbounded
            capture.
        seed: seed of the batches, jitter and random backgrounds.
        batch_rays: rays per batch, doubled for the last stage; None takes 4096, on a GPU by the clock 32768.
        patch_size: edge of a pixel patch, in pixels.
        lr: (initial, final) learning rate, log-linear in progress; None takes (8, 2), or (4, 0.4) for an
            unbounded capture.
        curvature_decay: decay of the running curvatures, per batch that meets the voxel.
        damping: constant added to every curvature.
        max_step: maximum change of a voxel's optical depth in one step.
        laplacian_reg: weight of the Laplacian regularization; None takes 1e-5, or 1e-3 for an unbounded
            capture, for a batch of 4096 rays, and in proportion for others: a batch has one Laplacian, and
            evidence in proportion to its rays.
        view_dependence_reg: weight of the penalty on view-dependent color coefficients, relative to the
            evidence of the photos; colors seen from one side alone then extrapolate to the other sides. None
            takes 3e-3, or 2e-2 for an unbounded capture.
        prune_weight: vertices whose maximum rendering weight stays below this value are removed.
        step_voxels: distance between samples of a ray, in voxels.
        exposure: fit a color gain to each photo; None does so for captures without alpha.
        distortion_reg: weight of mip-NeRF 360's distortion loss, which pulls the weights of a ray together:
            surfaces then look right from directions without photos. None takes 0.3, or 0 for an unbounded
            capture.
        near: distance within which an unbounded scene is empty around each camera, relative to the cameras'
            median distance to the center.
    """

    steps: int = 8000
    minutes: float | None = None
    resolution: int | None = None
    sh_degree: int | None = None
    seed: int = 0
    batch_rays: int | None = None
    patch_size: int = 4
    lr: tuple[float, float] | None = None
    curvature_decay: float = 0.95
    damping: float = 0.05
    max_step: float = 0.3
    laplacian_reg: float | None = None
    view_dependence_reg: float | None = None
    prune_weight: float = 0.01
    step_voxels: float = 0.7
    exposure: bool | None = None
    distortion_reg: float | None = None
    near: float = 0.15

    def __post_init__(self) -> None:
        limits = {
            "steps": (1, 10**8),
            "resolution": (16, 1024),
            "sh_degree": (0, 2),
            "patch_size": (1, 64),
            "batch_rays": (self.patch_size**2, 2**22),
        }
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise CagefieldError(f"{name} is {value}; it must be from {low} to {high}")
        if self.minutes is not None and not 0 < self.minutes < 1e5:
            raise CagefieldError(f"minutes is {self.minutes}; it must be above 0")
        if not 0 < self.curvature_decay < 1:
            raise CagefieldError(f"curvature_decay is {self.curvature_decay}; it must be between 0 and 1")
