"""A flash: a small lamp at the camera, beside the light of the room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.procedural.shading import Light, dot
from cagefield.procedural.srgb import encoded, linear
from cagefield.typing import Array, Float32

STRENGTH = 5.0
"""Linear light that a white surface sends back from a distance of 1, seen at right angles: 25 cm."""

NEAREST = 0.7
"""Distance below which the flash gets no brighter."""


@dataclass(frozen=True)
class FlashLight:
    """The light of a scene, and of a lamp at `eye` [3]: linear light is added.

    linear(rgb) = linear(rgb of the scene's light) + (linear(albedo) + g cos^h) STRENGTH cos / r^2, r the
    distance, cos that between normal and direction to the eye, g and h strength and exponent of the gloss.
    """

    ambient: Light
    eye: Array

    def __call__(
        self,
        albedo: Float32,
        points: Float32,
        normals: Float32,
        viewdirs: Float32,
        *,
        occlusion: Float32,
        gloss: tuple[float, float],
    ) -> Float32:
        """rgb [N,3] of surface points [3,N]; other arguments as of `shading.shade`."""
        rgb = self.ambient(albedo, points, normals, viewdirs, occlusion=occlusion, gloss=gloss)
        toward = self.eye.astype(np.float32)[:, None] - points
        square = np.maximum(dot(toward, toward), np.float32(1e-6))
        cosine = np.maximum(dot(normals, toward) / np.sqrt(square), np.float32(0))
        power = np.float32(STRENGTH) * cosine / np.maximum(square, np.float32(NEAREST**2))
        sent = linear(albedo) + (np.float32(gloss[0]) * cosine ** np.float32(gloss[1]))[:, None]
        return encoded(linear(np.maximum(rgb, 0)) + sent * power[:, None]).astype(np.float32)
