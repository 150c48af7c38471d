"""Flash light: a small lamp at the camera, in addition to the light of the room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.procedural.shading import Light, dot
from cagefield.procedural.srgb import decode_srgb, encode_srgb
from cagefield.typing import Array, Float32

FLASH_STRENGTH = 5.0
"""Linear light from a white surface at a distance of 1 (25 cm), lit and seen at right angles."""

MIN_FLASH_DISTANCE = 0.7
"""Distance below which the flash gets no brighter, room units."""


@dataclass(frozen=True)
class FlashLight:
    """Light of a scene plus a lamp at `eye` [3], added in linear light.

    linear(rgb) = linear(rgb of the scene's light) + (linear(albedo) + g cos^h) FLASH_STRENGTH cos / r^2, r
    the distance, cos between normal and direction to the eye, g and h strength and exponent of the gloss.
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
        power = np.float32(FLASH_STRENGTH) * cosine / np.maximum(square, np.float32(MIN_FLASH_DISTANCE**2))
        sent = decode_srgb(albedo) + (np.float32(gloss[0]) * cosine ** np.float32(gloss[1]))[:, None]
        return encode_srgb(decode_srgb(np.maximum(rgb, 0)) + sent * power[:, None]).astype(np.float32)
