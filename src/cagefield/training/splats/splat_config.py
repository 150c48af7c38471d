"""Configuration of a SplatField's training."""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.errors import CagefieldError

CHECKPOINT_KEYS = {
    "background_share": "background",
    "lr": "rate",
    "max_step": "cap",
    "ema_decay": "memory",
    "opacity_reg": "opaque",
    "empty_space_penalty": "veil",
    "ssim_lambda": "structure",
    "prune_opacity": "prune",
}
"""Key in a checkpoint's signature of each option that has another name there."""


@dataclass(frozen=True)
class SplatConfig:
    """Options of a SplatField's training.

    Attributes:
        steps: number of steps; each step uses one photo.
        minutes: training time instead of `steps`; the result then depends on the machine's speed.
        splats: maximum number of splats; None chooses it from the photos' pixels and the training time.
        sh_degree: final degree of the color's spherical harmonics, 0 to 3.
        seed: seed of the photos' order, of dropout and of random splats.
        antialiased: as in `SplatField`.
        exposure: fit a color gain to each photo; None does so for captures without alpha.
        robust: reduce the weight of photo regions that contradict the other photos (`robust_weights`).
        refine_poses: optimize the camera poses together with the splats.
        background_share: initial background splats of an unbounded capture, as a share of the other splats.
        lr: (initial, final) learning rate, log-linear in progress.
        damping: (relative, absolute) Levenberg-Marquardt damping of the curvature blocks.
        max_step: maximum step of log scales and of rotations in radians, and of means in sigmas.
        ema_decay: decay of the running (gradients, curvatures), per visit of a splat.
        opacity_reg: constant added to each opacity logit's gradient; it pulls opacities to 1, which gives
            surfaces instead of fog.
        empty_space_penalty: loss per unit of splat alpha in space that is known to be empty, relative to the
            squared error of colors in [0,1].
        ssim_lambda: weight of (1 - SSIM) / 2 of each pixel's window, beside half its squared error, from
            `splat_run.SSIM_START_PROGRESS` on.
        prune_opacity: opacity below which a splat is removed.
        dropout: share of splats that a step leaves out at the end of the run; it grows linearly from 0.
    """

    steps: int = 6000
    minutes: float | None = None
    splats: int | None = None
    sh_degree: int = 2
    seed: int = 0
    antialiased: bool = True
    exposure: bool | None = None
    robust: bool = False
    refine_poses: bool = False
    background_share: float = 0.05
    lr: tuple[float, float] = (1.8, 0.1)
    damping: tuple[float, float] = (0.1, 0.01)
    max_step: float = 0.15
    ema_decay: tuple[float, float] = (0.5, 0.98)
    opacity_reg: float = 0.003
    empty_space_penalty: float = 0.1
    ssim_lambda: float = 0.02
    prune_opacity: float = 0.01
    dropout: float = 0.1

    def __post_init__(self) -> None:
        limits = {"steps": (1, 10**8), "sh_degree": (0, 3), "splats": (100, 10**8)}
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise CagefieldError(f"{name} is {value}; it must be from {low} to {high}")
        if self.minutes is not None and not 0 < self.minutes < 1e5:
            raise CagefieldError(f"minutes is {self.minutes}; it must be above 0")
