"""Shading of the procedural scenes by directional light, so that a part moved without rotation looks
unchanged.

rgb = texture * occlusion * (sky and ground light + wrapped Lambert of two lights) + a Blinn-Phong highlight.
There are no cast shadows. Occlusion belongs to the scene as modeled and travels with the parts. Colors are
combined as sRGB-encoded values, like the radiance a field is trained on.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from cagefield.typing import Float32


def _unit(x: float, y: float, z: float) -> Float32:
    vector = np.array([x, y, z], np.float32)
    return vector / np.float32(np.linalg.norm(vector))


SKY_RGB = np.array([0.69, 0.71, 0.75], np.float32)
GROUND_RGB = np.array([0.47, 0.44, 0.41], np.float32)
KEY_DIRECTION, KEY_COLOR = _unit(0.55, -0.45, 0.8), np.array([0.47, 0.45, 0.41], np.float32)
FILL_DIRECTION, FILL_COLOR = _unit(-0.8, 0.45, 0.25), np.array([0.12, 0.13, 0.16], np.float32)
KEY_WRAP_SHARE = 0.3
"""Share by which the key light reaches around the terminator."""


def dot(first: Float32, second: Float32) -> Float32:
    """Dot products [N] of vectors [3,N] (or one [3])."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


class Light(Protocol):
    """Function of surface points to the color that they send to the camera."""

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
        """rgb [N,3] of surface points; see `shade`. points [3,N] are as modeled."""
        ...


def shade(
    albedo: Float32,
    points: Float32,
    normals: Float32,
    viewdirs: Float32,
    *,
    occlusion: Float32,
    gloss: tuple[float, float],
) -> Float32:
    """rgb [N,3] in [0,1] of surface points, independent of their positions (`points` is not used).

    albedo [N,3]; normals [3,N] unit, outwards; viewdirs [3,N] unit, from the camera; occlusion [N] in [0,1]
    (1 is open); gloss: strength and exponent of the highlight.
    """
    up = 0.5 + 0.5 * normals[2]
    ambient = GROUND_RGB + (SKY_RGB - GROUND_RGB) * up[:, None]
    key = np.maximum((dot(KEY_DIRECTION, normals) + KEY_WRAP_SHARE) / (1 + KEY_WRAP_SHARE), 0)
    fill = np.maximum(dot(FILL_DIRECTION, normals), 0)
    light = ambient * occlusion[:, None]
    light = light + (key * (0.4 + 0.6 * occlusion))[:, None] * KEY_COLOR + fill[:, None] * FILL_COLOR
    halfway = KEY_DIRECTION[:, None] - viewdirs
    facing = np.maximum(dot(normals, halfway) / np.sqrt(dot(halfway, halfway)), np.float32(1e-6))
    highlight = np.float32(gloss[0]) * facing ** np.float32(gloss[1]) * occlusion
    out: Float32 = np.clip(albedo * light + highlight[:, None], 0, 1).astype(np.float32)
    return out
