"""Where a NerfField's rays are sampled, and the world that its capture is moved to for that.

| capture | world | samples |
| --- | --- | --- |
| bounded | its own | even in depth, between the depths at which its cameras may see its box |
| forward-facing | NDC's (`datasets.nerf_normalization`) | even in NDC, from the near plane to infinity |
| any other | its cube of interest is [-1, 1]^3 | even in 1/depth, from `near` to `far` |

The last one's near and far are nerf-pytorch's 0.9 times the nearest and the farthest depth that the capture
states; where it states none, NEAR and FAR times the cameras' median distance from the middle of the cube.
Content beyond far ends up at far: there is no background model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.datasets.nerf_normalization import in_ndc_world, in_unit_cube, why_not_ndc
from cagefield.datasets.views import Dataset
from cagefield.errors import CagefieldError

NEAR_SHARE = 0.9
"""Sampling starts at this share of the nearest depth that is known."""

NEAR, FAR = 0.2, 20.0
"""Sampling between these multiples of the cameras' distance, where no depth is known."""


@dataclass(frozen=True, eq=False)
class Space:
    """The capture in the field's world, and how its rays are sampled; see `NerfField` for near to ndc."""

    dataset: Dataset
    near: float
    far: float
    lindisp: bool = False
    ndc: tuple[float, float] | None = None

    def __str__(self) -> str:
        """What a person should know of it."""
        if self.ndc is not None:
            return "sampled in NDC (forward-facing)"
        even = ", even in 1/depth" if self.lindisp else ""
        return f"sampled from depth {self.near:.4g} to {self.far:.4g}{even}"


def space_of(dataset: Dataset, ndc: bool | None = None) -> Space:
    """How a capture is trained; `ndc` None takes NDC where they suit it.

    Raises:
        CagefieldError: `ndc` True for a capture that they do not suit.
    """
    if ndc or (ndc is None and dataset.unbounded):
        reason = why_not_ndc(dataset)
        if reason is None:
            moved, ratios = in_ndc_world(dataset)
            return Space(moved, 0.0, 1.0, ndc=ratios)
        if ndc:
            raise CagefieldError(f"{dataset.path} cannot be trained in NDC: {reason}; train it without")
    if not dataset.unbounded:
        return Space(dataset, *_depths_of_box(dataset))
    moved = in_unit_cube(dataset)
    if moved.depths is not None:
        return Space(moved, NEAR_SHARE * moved.depths[0], moved.depths[1], lindisp=True)
    distance = float(np.median([np.linalg.norm(view.camera.origin) for view in moved.train]))
    return Space(moved, NEAR * distance, FAR * distance, lindisp=True)


def _depths_of_box(dataset: Dataset) -> tuple[float, float]:
    """Planar depths between which the training cameras may see the box of the data set."""
    corners = np.array([[dataset.bounds[b, a] for a, b in enumerate(bits)] for bits in np.ndindex(2, 2, 2)])
    depths = np.concatenate([(corners - view.camera.origin) @ view.camera.forward for view in dataset.train])
    nearest = max(float(depths.min()), 0.02 * float(depths.max()))
    return nearest, float(depths.max())
