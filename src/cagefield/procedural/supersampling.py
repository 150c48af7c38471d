"""Supersampled photographs: each pixel is the mean of several rays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.errors import SceneError
from cagefield.images.render_result import Background, RenderResult
from cagefield.procedural.parts import transform_vectors
from cagefield.procedural.tracing import Hits
from cagefield.typing import Array, Float32

Shoot = Callable[[Array, Float32], tuple[Float32, Float32, Hits]]
"""(rgb [N,3], normals [N,3], hits) of rays from one origin [3] with unit directions [3,N]."""


def photograph(shoot: Shoot, camera: Camera, *, supersample: int, background: Background) -> RenderResult:
    """Image of the surfaces that rays meet, each pixel the mean of supersample^2 rays.

    opacity is the share of rays that meet a surface, depth and normals the means over these rays. Raises
    SceneError for supersample < 1.
    """
    if supersample < 1:
        raise SceneError(f"supersample must be at least 1, not {supersample}")
    height, width = camera.height, camera.width
    fine = camera if supersample == 1 else camera.resized(width * supersample, height * supersample)
    directions = transform_vectors(camera.c2w[:3, :3], fine.local_directions().T)
    rgb, normals, hits = shoot(camera.origin, directions)
    is_hit = np.isfinite(hits.t)

    def mean(values: NDArray[np.float32]) -> NDArray[np.float32]:
        blocks = values.reshape(height, supersample, width, supersample, -1)
        averaged: NDArray[np.float32] = blocks.mean((1, 3), dtype=np.float32)
        return averaged

    opacity = mean(is_hit.astype(np.float32))[..., 0]
    depth = mean(np.where(is_hit, hits.t, np.float32(0)))[..., 0]
    depth[opacity > 0] /= opacity[opacity > 0]
    depth[opacity == 0] = np.inf
    normal = mean(normals)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    return RenderResult.from_premultiplied(mean(rgb), opacity, depth, normals=normal, background=background)
