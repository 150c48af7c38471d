"""Steps of splats on a GPU (Quadrants kernels).

Splats stay on the device from step to step, photos up to a limit. Each step downloads the sums of its photo's
tiles; `state` downloads the splats, and the next step uploads them again.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.compute.device_buffers import DeviceBuffers
from cagefield.compute.devices import floats, ints
from cagefield.rendering.splats.device_rasterizer import DeviceProjection, camera_args, project_args
from cagefield.rendering.splats.kernels import device_rasterizer as raster_kernels
from cagefield.rendering.splats.kernels import device_splat_args
from cagefield.rendering.splats.kernels.blending import SUMS
from cagefield.rendering.splats.kernels.projection import AREA
from cagefield.rendering.splats.rasterizer import COLOR, intrinsics
from cagefield.training.splats.kernels import device_backward, device_gauss_newton, device_pixels, device_ssim
from cagefield.training.splats.kernels.device_args import AverageArgs, PairArgs, ParameterArgs, PhotoArgs
from cagefield.training.splats.kernels.device_args import StepArgs as DeviceStepArgs
from cagefield.training.splats.kernels.gauss_newton_splats import StepArgs
from cagefield.training.splats.kernels.ssim import MOMENT_PLANES
from cagefield.training.splats.pose_optimization import pose_sums
from cagefield.training.splats.splat_optimizer import Photo
from cagefield.training.splats.splat_state import SplatState
from cagefield.typing import Array, Float32

_FIELDS = tuple(field.name for field in dataclasses.fields(SplatState))


class DeviceSplatOptimizer:
    """A `splat_optimizer.SplatOptimizer` on the compute device.

    Sums over pixels are atomic: equal inputs give equal results up to the last digits.
    """

    def __init__(self, state: SplatState, near: float, antialiased: bool) -> None:
        self._has_subgroups = devices.start() != "cpu"
        self._near, self._antialiased = near, antialiased
        self._buffers = DeviceBuffers()
        self._arrays: dict[str, Any] = {}
        self._state, self._is_host_current, self._is_device_current = state, True, False
        self._camera: Camera
        self._projected: DeviceProjection
        self._opacities: Any
        self._image: Any
        self._photo: PhotoArgs
        self._color: Any
        self._slopes: Any
        self._ones: tuple[int, Any] | None = None

    @property
    def state(self) -> SplatState:
        """See `SplatOptimizer.state`."""
        if not self._is_host_current:
            self._download(_FIELDS)
        self._is_host_current, self._is_device_current = True, False
        return self._state

    @state.setter
    def state(self, state: SplatState) -> None:
        self._state, self._is_host_current, self._is_device_current = state, True, False

    def __len__(self) -> int:
        return len(self._state)

    def render(self, camera: Camera, kept: NDArray[np.bool_] | None) -> None:
        """See `SplatOptimizer.render`."""
        self._upload()
        count, buffers = len(self), self._buffers
        covariances = buffers.take("covariances", 6 * count)
        self._opacities = buffers.take("opacities", count)
        mask = buffers.take("unused_mask", 1, np.uint8)
        if kept is not None:
            mask = buffers.upload("kept", kept.view(np.uint8))
        device_backward.build_covariances(
            self._parameters(), mask, int(kept is not None), covariances, self._opacities, count
        )
        unused = buffers.take("unused", 1)
        splats = device_splat_args.SplatArgs(
            means=self._arrays["means"],
            covariances=covariances,
            opacities=self._opacities,
            sh=self._arrays["sh"],
            rotations=unused,
            normals=unused,
            count=count,
            antialiased=int(self._antialiased),
            turned=0,
            with_normals=0,
        )
        self._camera = camera
        seen = self._projected = project_args(splats, self._terms, camera, self._near, buffers)
        self._image = buffers.take("image", seen.tiles * COLOR * AREA)
        raster_kernels.blend(
            seen.packed,
            seen.ids,
            seen.starts,
            seen.tiles,
            seen.across,
            self._image,
            device_pixels.MIN_PIXEL_TRANSMITTANCE,
            COLOR,
        )

    def compare(self, photo: Photo) -> Float32:
        """See `SplatOptimizer.compare`."""
        seen, buffers = self._projected, self._buffers
        self._photo = PhotoArgs(
            target=buffers.upload_once("target", photo.target),
            weights=self._unit_weights()
            if photo.weights is None
            else buffers.upload("weights", photo.weights),
            gain=floats(photo.gain),
            background=floats(photo.background),
            width=seen.width,
            height=seen.height,
            channels=photo.target.shape[1],
        )
        self._color = buffers.take("color", seen.tiles * 3 * AREA)
        self._slopes = buffers.take("slopes", seen.tiles * 3 * AREA)
        sums = buffers.exact("tile_sums", seen.tiles * device_pixels.TILE_SUMS)
        device_pixels.residuals(
            self._image, self._photo, self._color, self._slopes, sums, seen.tiles, self._has_subgroups
        )
        return np.asarray(sums.to_numpy()).reshape(seen.tiles, device_pixels.TILE_SUMS)

    def _unit_weights(self) -> Any:
        """Weights 1 of at least as many pixels as the image has."""
        size = self._projected.tiles * AREA
        if self._ones is None or self._ones[0] < size:
            self._ones = size, self._buffers.upload("ones", np.ones(size, np.float32))
        return self._ones[1]

    def slopes(self) -> Float32:
        """See `SplatOptimizer.slopes`."""
        values = self._slopes.to_numpy()[: self._projected.tiles * 3 * AREA]
        return np.asarray(values).reshape(-1, 3, AREA)

    def add_ssim(self, weight: float) -> None:
        """See `SplatOptimizer.add_ssim`."""
        size = self._projected.width * self._projected.height
        device_ssim.add_ssim_gradient(
            self._color,
            self._photo,
            weight,
            self._buffers.take("moments", 3 * MOMENT_PLANES * size),
            self._buffers.take("by_moment", 9 * size),
            self._buffers.take("pixels", 6 * size),
            self._slopes,
        )

    def backpropagate(self, free_distances: Float32, empty_space_penalty: float) -> None:
        """See `SplatOptimizer.backpropagate`."""
        seen, count, buffers = self._projected, len(self), self._buffers
        sums = buffers.take("sums", SUMS * count)
        device_pixels.gradients(
            PairArgs(seen.packed, seen.ids, seen.starts, seen.tiles),
            ints((seen.width, seen.height)),
            self._color,
            self._slopes,
            self._photo.weights,
            buffers.upload_once("free_distances", free_distances),
            ints(free_distances.shape[:0:-1]),
            empty_space_penalty,
            sums,
            count,
            self._has_subgroups,
        )
        device_backward.backpropagate(
            seen.boxes,
            sums,
            self._parameters(),
            self._opacities,
            camera_args(self._camera, self._near),
            int(self._antialiased),
            self._arrays["gradients"],
            self._arrays["curvatures"],
            count,
            intrinsics(self._camera).model,
        )
        self._is_host_current, self._is_device_current = False, True

    def pose_sums(self) -> tuple[Array, Array]:
        """See `SplatOptimizer.pose_sums`; summed on the host."""
        self._download(("means", "quaternions", "gradients", "curvatures"))
        boxes = self._projected.boxes.to_numpy()[: 4 * len(self)].reshape(-1, 4)
        return pose_sums(self._camera.origin, self._state, np.flatnonzero(boxes[:, 1] > boxes[:, 0]))

    def update(self, rule: StepArgs) -> None:
        """See `SplatOptimizer.update`."""
        arrays = self._arrays
        device_gauss_newton.gauss_newton(
            self._projected.boxes,
            arrays["gradients"],
            arrays["curvatures"],
            self._parameters(),
            camera_args(self._camera, self._near),
            AverageArgs(*(arrays[name] for name in ("momentum", "running", "ticks", "error", "hits"))),
            DeviceStepArgs(
                memory=floats(rule.memory),
                rates=floats(rule.rates),
                damping=floats(rule.damping),
                caps=floats(rule.caps),
                log_range=floats(np.log(rule.scale_range)),
                terms=rule.terms,
                pull=rule.pull,
            ),
            len(self),
            self._terms,
        )
        self._is_host_current, self._is_device_current = False, True

    @property
    def _terms(self) -> int:
        """Number of harmonics of a splat."""
        return self._state.sh.shape[1]

    def _parameters(self) -> ParameterArgs:
        """Parameters on the device as kernel arguments."""
        names = ("means", "log_scales", "quaternions", "logits", "sh")
        return ParameterArgs(*(self._arrays[name] for name in names))

    def _upload(self) -> None:
        """Copy the splats to the device where those of the host are newer."""
        if not self._is_device_current:
            for name in _FIELDS:
                self._arrays[name] = self._buffers.upload(f"state_{name}", getattr(self._state, name))
            self._is_device_current = True

    def _download(self, names: tuple[str, ...]) -> None:
        """Copy arrays of the splats to the host."""
        for name in names:
            shape = getattr(self._state, name).shape
            setattr(self._state, name, np.asarray(self._arrays[name].to_numpy()).reshape(shape))
