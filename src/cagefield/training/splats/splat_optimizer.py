"""Step of all splats by one photo, in stages: the part of a training that runs on the compute device."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.training.splats.kernels.gauss_newton_splats import StepArgs
from cagefield.training.splats.splat_state import SplatState
from cagefield.typing import Array, Float32


class Photo(NamedTuple):
    """Photo, and the conditions under which an image is compared with it.

    Attributes:
        target: [tiles, 3 or 4, AREA] uint8; straight alpha where there are 4 channels. Never changed: devices
            keep it.
        weights: [tiles,AREA] weights of the pixels; 0 for masked ones. None: 1.
        gain: [3] exposure, by which the image is multiplied.
        background: [3] in [0,1], behind image and photo.
    """

    target: NDArray[np.uint8]
    weights: Float32 | None
    gain: Float32
    background: Float32


class SplatOptimizer(Protocol):
    """Splats in training, and the stages of a step; each stage uses the results of those before it."""

    @property
    def state(self) -> SplatState:
        """Splats on the host. Changes between steps count; later steps may leave this copy stale."""

    @state.setter
    def state(self, state: SplatState) -> None: ...

    def __len__(self) -> int: ...

    def render(self, camera: Camera, kept: NDArray[np.bool_] | None) -> None:
        """Draw the splats, or those of the mask `kept` [N], as `camera` sees them."""

    def compare(self, photo: Photo) -> Float32:
        """Sums [tiles,7] over the image's pixels; see `gauss_newton_splats.residuals`."""

    def slopes(self) -> Float32:
        """Gradient [tiles,3,AREA] of the loss by the image's pixels."""

    def add_ssim(self, weight: float) -> None:
        """Add `weight` times the SSIM loss to the gradient by the image's pixels."""

    def backpropagate(self, free_distances: Float32, empty_space_penalty: float) -> None:
        """Compute gradients and curvatures of the visible splats.

        `free_distances` [2,h,w]: see `rasterizer.Projection.gradients`; never changed.
        """

    def pose_sums(self) -> tuple[Array, Array]:
        """(gradient [6], curvature [6,6]) of the camera's motion; see `pose_optimization`."""

    def update(self, rule: StepArgs) -> None:
        """Take a Gauss-Newton step of the visible splats that are not frozen; count their errors and hits."""
