"""World and sampling space of a NerfField's training.

| capture | world | samples |
| --- | --- | --- |
| bounded | its own | even in depth, within the depth range of its box in the training cameras |
| forward-facing | NDC (`datasets.nerf_normalization`) | even in NDC, from the near plane to infinity |
| any other | its cube of interest is [-1, 1]^3 | even in 1/depth, from `near` to `far` |

`near` and `far` of the last kind are nerf-pytorch's: 0.9 times the nearest and once the farthest depth that
the capture states. Without stated depths `near` and `far` are NEAR_CAMERA_DISTANCES and FAR_CAMERA_DISTANCES
times the cameras' median distance from the center of the cube. Content beyond `far` is rendered at `far`:
there is no background model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.datasets.nerf_normalization import ndc_obstacle, normalize_to_ndc, normalize_to_unit_cube
from cagefield.datasets.views import Dataset
from cagefield.errors import CagefieldError

NEAR_DEPTH_SHARE = 0.9
"""Near bound of the samples, as a share of the nearest stated depth."""

NEAR_CAMERA_DISTANCES, FAR_CAMERA_DISTANCES = 0.2, 20.0
"""Near and far bound of the samples without stated depths, in median camera distances."""


@dataclass(frozen=True, eq=False)
class SamplingSpace:
    """Capture in the field's world, and the sampling of its rays; `near` to `ndc` as in `NerfField`."""

    dataset: Dataset
    near: float
    far: float
    lindisp: bool = False
    ndc: tuple[float, float] | None = None

    def __str__(self) -> str:
        """Summary of the sampling for messages."""
        if self.ndc is not None:
            return "sampled in NDC (forward-facing)"
        even = ", even in 1/depth" if self.lindisp else ""
        return f"sampled from depth {self.near:.4g} to {self.far:.4g}{even}"


def build_sampling_space(dataset: Dataset, ndc: bool | None = None) -> SamplingSpace:
    """Sampling space of a capture; `ndc` None takes NDC where NDC suit the capture.

    Raises:
        CagefieldError: `ndc` is True for a capture that is not forward-facing.
    """
    if ndc or (ndc is None and dataset.unbounded):
        reason = ndc_obstacle(dataset)
        if reason is None:
            moved, ratios = normalize_to_ndc(dataset)
            return SamplingSpace(moved, 0.0, 1.0, ndc=ratios)
        if ndc:
            raise CagefieldError(f"{dataset.path} cannot be trained in NDC: {reason}; train it without")
    if not dataset.unbounded:
        return SamplingSpace(dataset, *_depths_of_box(dataset))
    moved = normalize_to_unit_cube(dataset)
    if moved.depths is not None:
        return SamplingSpace(moved, NEAR_DEPTH_SHARE * moved.depths[0], moved.depths[1], lindisp=True)
    distance = float(np.median([np.linalg.norm(view.camera.origin) for view in moved.train]))
    return SamplingSpace(
        moved, NEAR_CAMERA_DISTANCES * distance, FAR_CAMERA_DISTANCES * distance, lindisp=True
    )


def _depths_of_box(dataset: Dataset) -> tuple[float, float]:
    """(near, far) planar depth of the data set's box over all training cameras, in world units."""
    corners = np.array([[dataset.bounds[b, a] for a, b in enumerate(bits)] for bits in np.ndindex(2, 2, 2)])
    depths = np.concatenate([(corners - view.camera.origin) @ view.camera.forward for view in dataset.train])
    nearest = max(float(depths.min()), 0.02 * float(depths.max()))
    return nearest, float(depths.max())
