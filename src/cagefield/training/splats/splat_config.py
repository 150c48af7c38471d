"""What a person may choose of a SplatField's training."""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class SplatConfig:
    """How a SplatField is trained.

    Attributes:
        steps: number of steps; each is one photo.
        minutes: train for this long instead of `steps`; the result then depends on the machine's speed.
        splats: most splats at the end; None takes what the photos' pixels and the time allow.
        sh_degree: degree of the colour's spherical harmonics at the end, 0 to 3.
        seed: of the photos' order, of splits and of random splats.
        antialiased: as SplatField.
        exposure: fit a colour gain to each photo; None does so for captures without alpha.
        robust: give less weight to regions of photos that contradict the others (`robust_weights`).
        refine_poses: move the photos' cameras to where the splats agree best with them.
        background: splats far behind an unbounded capture, in shares of the others that a run begins with.
        rate: (first, last) rate of the steps.
        damping: (relative, absolute) damping of the blocks.
        cap: largest step of log scales and turns, and of means in sigmas.
        memory: decay of the running gradients and curvatures.
        opaque: pull on each opacity's logit towards 1, as a gradient: surfaces in place of fog.
        veil: what each alpha of a splat costs in space that is known to be empty, beside a squared error
            of colours in [0,1].
        structure: weight of structural similarity, (1 - SSIM) / 2 of each pixel's window, beside half its
            squared error, from when surfaces are found.
        prune: splats whose opacity falls below this are taken out.
        dropout: share of the splats that steps leave out at the end, so that none explains what others show.
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
    background: float = 0.05
    rate: tuple[float, float] = (1.8, 0.1)
    damping: tuple[float, float] = (0.1, 0.01)
    cap: float = 0.15
    memory: tuple[float, float] = (0.5, 0.98)
    opaque: float = 0.003
    veil: float = 0.1
    structure: float = 0.02
    prune: float = 0.01
    dropout: float = 0.1

    def __post_init__(self) -> None:
        limits = {"steps": (1, 10**8), "sh_degree": (0, 3), "splats": (100, 10**8)}
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise CagefieldError(f"{name} is {value}; it must be from {low} to {high}")
        if self.minutes is not None and not 0 < self.minutes < 1e5:
            raise CagefieldError(f"minutes is {self.minutes}; it must be above 0")
