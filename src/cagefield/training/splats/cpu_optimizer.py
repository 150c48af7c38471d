"""Steps of splats on the CPU (Numba kernels)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.rendering.splats.kernels.blending import SUMS
from cagefield.rendering.splats.kernels.projection import AREA
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.rendering.splats.rasterizer import COLOR, Buffers, Projection, camera_args, project
from cagefield.training.splats.kernels.gauss_newton_splats import StepArgs, gauss_newton, residuals
from cagefield.training.splats.kernels.splat_backward import PairArgs, backpropagate, build_covariances
from cagefield.training.splats.kernels.ssim import MOMENT_PLANES, add_ssim_gradient
from cagefield.training.splats.pose_optimization import pose_sums
from cagefield.training.splats.splat_optimizer import Photo
from cagefield.training.splats.splat_state import SplatState
from cagefield.typing import Array, Float32


class CpuSplatOptimizer:
    """A `splat_optimizer.SplatOptimizer` on the CPU; equal inputs give equal bits."""

    def __init__(self, state: SplatState, near: float, antialiased: bool) -> None:
        self.state = state
        self._near, self._antialiased = near, antialiased
        self._buffers = Buffers()
        self._camera: Camera
        self._photo: Photo
        self._projected: Projection
        self._opacities: Float32
        self._out: Float32
        self._stops: NDArray[np.int64]
        self._color: Float32
        self._slopes: Float32

    def __len__(self) -> int:
        return len(self.state)

    def render(self, camera: Camera, kept: NDArray[np.bool_] | None) -> None:
        """See `SplatOptimizer.render`."""
        state, count = self.state, len(self.state)
        covariances = self._buffers.take("covariances", (count, 6), np.float32)
        self._opacities = self._buffers.take("opacities", (count,), np.float32)
        build_covariances(state.log_scales, state.quaternions, state.logits, covariances, self._opacities)
        if kept is not None:
            self._opacities *= kept
        splats = DeformedSplats(state.means, covariances, self._opacities, state.sh, None, self._antialiased)
        self._camera = camera
        self._projected = project(splats, camera, near=self._near, buffers=self._buffers)
        self._out, self._stops = self._projected.blend(COLOR)

    def compare(self, photo: Photo) -> Float32:
        """See `SplatOptimizer.compare`."""
        seen = self._projected
        self._weights = photo.weights
        if self._weights is None:
            self._weights = self._buffers.take("weights", (seen.tiles, AREA), np.float32)
            self._weights.fill(1.0)
        self._photo = photo
        self._color = self._buffers.take("color", (seen.tiles, 3, AREA), np.float32)
        self._slopes = self._buffers.take("slopes", (seen.tiles, 3, AREA), np.float32)
        sums = np.empty((seen.tiles, 7), np.float32)
        residuals(
            self._out, photo.target, seen.width, seen.height, photo.gain, photo.background, self._weights,
            self._color, self._slopes, sums,
        )  # fmt: skip
        return sums

    def slopes(self) -> Float32:
        """See `SplatOptimizer.slopes`."""
        return self._slopes

    def add_ssim(self, weight: float) -> None:
        """See `SplatOptimizer.add_ssim`."""
        seen, photo = self._projected, self._photo
        size = (seen.height, seen.width)
        assert self._weights is not None, "`compare` comes first"
        add_ssim_gradient(
            self._color, photo.target, photo.gain, photo.background, self._weights, weight,
            self._buffers.take("moments", (3, MOMENT_PLANES, *size), np.float32),
            self._buffers.take("moment_slopes", (3, 3, *size), np.float32),
            self._buffers.take("pixels", (3, 2, *size), np.float32), self._slopes,
        )  # fmt: skip

    def backpropagate(self, free_distances: Float32, empty_space_penalty: float) -> None:
        """See `SplatOptimizer.backpropagate`."""
        seen, state = self._projected, self.state
        sums = self._buffers.take("sums", (max(seen.pairs, 1), SUMS), np.float32)
        seen.gradients(
            self._color, self._slopes, self._stops, sums, free_distances, empty_space_penalty,
            self._weights,
        )  # fmt: skip
        backpropagate(
            PairArgs(seen.order, seen.firsts, seen.slots, sums),
            seen.packed,
            state.parameter_args(),
            self._opacities,
            camera_args(self._camera, self._near),
            self._antialiased,
            False,
            state.gradients,
            state.curvatures,
        )

    def pose_sums(self) -> tuple[Array, Array]:
        """See `SplatOptimizer.pose_sums`."""
        return pose_sums(self._camera.origin, self.state, self._projected.order)

    def update(self, rule: StepArgs) -> None:
        """See `SplatOptimizer.update`."""
        state, visible = self.state, self._projected.order
        if state.frozen.any():
            visible = visible[~state.frozen[visible]]
        gauss_newton(
            visible,
            state.gradients,
            state.curvatures,
            state.parameter_args(),
            self._camera.origin,
            state.average_args(),
            rule,
        )
        state.error[visible] += state.gradients[visible, 15]
        state.hits[visible] += 1
