"""Light in a room with one window: light through the window, and light reflected by the walls.

rgb = soft(texture * (ambient * corners * occlusion + window * shadow)) + a highlight of the window, where

    window     sum over patches k of the window of area A_k cos_surface cos_window / (pi r^2): a diffuse
    emitter shadow     the visible share of the window, from the distances on the way to it (a soft shadow)
    occlusion  at least MIN_OCCLUSION_LIGHT: surrounding walls send light into every gap
    corners    darker towards the other walls, in two widths
    soft       x / (1 + x^4)^(1/4): bright walls do not clip

Shadows and occlusion belong to the scene as modeled. Colors are combined as sRGB-encoded values.

Source: Quilez, "Soft shadows in raymarched SDFs", for the shadow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.procedural.occlusion import Occlusion
from cagefield.procedural.parts import Part
from cagefield.procedural.shading import dot
from cagefield.typing import Float32

Vector = tuple[float, float, float]

AMBIENT_RGB = np.array([0.58, 0.575, 0.56], np.float32)
AMBIENT_BELOW_RGB = np.array([0.5, 0.485, 0.46], np.float32)
WINDOW_RGB = np.array([1.0, 0.985, 0.95], np.float32)
CORNER_WIDTHS_AND_DEPTHS = ((0.5, 0.13), (2.2, 0.1))
"""Widths (world units) and depths of the darkening towards a wall."""

MIN_OCCLUSION_LIGHT = 0.4
"""Minimum share of the light that reaches a point with no open space above it."""

WINDOW_PATCHES_PER_SIDE = 3
"""Number of patches along each side of the window: the window is cut into its square of emitters."""

SHADOW_STEPS = tuple(float(step) for step in np.geomspace(0.05, 3.5, 20))
"""Distances, world units, towards the window at which free space is sampled."""


@dataclass(frozen=True)
class Room:
    """Box with a window in its +y wall.

    low, high     corners of the inside
    window        (x, z) of the window's lower left and upper right corner
    shell         names of the parts that are the room itself, not furniture
    brightness    factor of the window's light
    detail        spacing of the lattice of shadows and occlusion
    """

    low: Vector
    high: Vector
    window: tuple[tuple[float, float], tuple[float, float]]
    shell: tuple[str, ...] = ()
    brightness: float = 7.0
    detail: float = 0.025

    def furniture(self, parts: tuple[Part, ...]) -> tuple[Part, ...]:
        """Parts that are not of the room itself."""
        return tuple(part for part in parts if part.name not in self.shell)

    def distance(self, points: Float32) -> Float32:
        """Distance [N] of points [3,N] inside the room to its nearest wall, floor or ceiling; outside inf."""
        low, high = np.array(self.low, np.float32)[:, None], np.array(self.high, np.float32)[:, None]
        distance = np.minimum(points - low, high - points).min(0)
        # things in the window opening count as inside the room
        return np.where(distance < 0, np.float32(np.inf), distance)

    @property
    def emitters(self) -> tuple[Float32, float]:
        """(centers [K,3], area) of the window's patches."""
        (left, bottom), (right, top) = self.window
        across = (np.arange(WINDOW_PATCHES_PER_SIDE) + 0.5) / WINDOW_PATCHES_PER_SIDE
        x, z = np.meshgrid(left + (right - left) * across, bottom + (top - bottom) * across)
        y = np.full(x.size, self.high[1])
        area = (right - left) * (top - bottom) / WINDOW_PATCHES_PER_SIDE**2
        return np.stack([x.ravel(), y, z.ravel()], 1).astype(np.float32), area


@dataclass(frozen=True)
class RoomLight:
    """Light of a room on its contents; `occlusion` is that of the scene as modeled."""

    room: Room
    occlusion: Occlusion

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
        """rgb [N,3] of surface points [3,N], as modeled; other arguments as of `shading.shade`."""
        occlusion = np.float32(MIN_OCCLUSION_LIGHT) + np.float32(1 - MIN_OCCLUSION_LIGHT) * occlusion
        up = (0.5 + 0.5 * normals[2])[:, None]
        ambient = AMBIENT_BELOW_RGB + (AMBIENT_RGB - AMBIENT_BELOW_RGB) * up
        visible_share = self._shadow(points)
        window = self._window(points, normals) * visible_share
        light = ambient * (self._corners(points, normals) * occlusion)[:, None]
        light = light + (window * (0.5 + 0.5 * occlusion))[:, None] * WINDOW_RGB
        out = albedo * light
        out = out / np.sqrt(np.sqrt(1 + out**4)) * np.float32(1.06)
        halfway = self._toward(points) - viewdirs
        facing = np.maximum(dot(normals, halfway) / np.sqrt(dot(halfway, halfway)), np.float32(1e-6))
        highlight = np.float32(gloss[0]) * facing ** np.float32(gloss[1]) * occlusion * visible_share
        return (out + highlight[:, None]).astype(np.float32)

    def _toward(self, points: Float32) -> Float32:
        """Unit vectors [3,N] towards the window's middle."""
        toward = self.room.emitters[0].mean(0)[:, None] - points
        return toward / np.maximum(np.sqrt(dot(toward, toward)), np.float32(1e-6))

    def _window(self, points: Float32, normals: Float32) -> Float32:
        """Light [N] through the window."""
        centers, area = self.room.emitters
        total = np.zeros(points.shape[1], np.float32)
        for center in centers:
            toward = center[:, None] - points
            square = dot(toward, toward) + np.float32(0.2 * area)
            # the window looks along -y: its cosine is toward_y / r
            total += np.maximum(dot(toward, normals), 0) * np.maximum(toward[1], 0) / square**2
        return total * np.float32(self.room.brightness * area / np.pi)

    def _shadow(self, points: Float32) -> Float32:
        """Share [N] of the window's light that passes the furniture."""
        low, high = self.occlusion.bounds
        visible_share = np.ones(points.shape[1], np.float32)
        far = np.float32(SHADOW_STEPS[-1])
        near_rows = np.flatnonzero(((points > low[:, None] - far) & (points < high[:, None] + far)).all(0))
        points, shadow = points[:, near_rows], visible_share[near_rows]
        toward = self._toward(points)
        reach = np.float32(self.occlusion.reach)
        for step in SHADOW_STEPS:
            half_width = np.float32(min(0.35 * step, 0.98 * float(reach)))
            distance = self.occlusion.distance_to_parts(points + np.float32(step) * toward)
            share = np.clip(0.5 + 0.5 * distance / half_width, 0, 1)
            np.minimum(shadow, np.where(distance >= 0.99 * reach, 1, share), out=shadow)
        visible_share[near_rows] = shadow
        return np.float32(0.15) + np.float32(0.85) * visible_share * visible_share * (3 - 2 * visible_share)

    def _corners(self, points: Float32, normals: Float32) -> Float32:
        """Factor [N] of the ambient light, lower near the walls that a surface does not lie on."""
        factor = np.ones(points.shape[1], np.float32)
        for axis in range(3):
            for bound, sign in ((self.room.low[axis], 1.0), (self.room.high[axis], -1.0)):
                distance = np.float32(sign) * (points[axis] - np.float32(bound))
                faces = 1 - np.maximum(np.float32(sign) * normals[axis], 0)
                dark = sum(
                    np.float32(depth) * np.exp(-np.maximum(distance, 0) / np.float32(width))
                    for width, depth in CORNER_WIDTHS_AND_DEPTHS
                )
                factor *= 1 - faces * dark
        return factor
