"""Procedural colors over a primitive's own frame: (points [N,3], instance [N]) -> rgb [N,3], float32.

Patterns are soft-edged, a few pixels wide at 200x200 from distance 4, so that photos do not alias and a voxel
field of ordinary size can represent them. Colors are sRGB-encoded.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from cagefield.typing import Float32

Rgb = tuple[float, float, float]
Vector = tuple[float, float, float]

NOISE_SIZE_VOXELS = 64


class Texture(Protocol):
    """Color of points of one primitive; `instance` numbers its placements."""

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32: ...


def rgb_from_hex(code: str) -> Rgb:
    """rgb in [0,1] of "#rrggbb"."""
    value = int(code.lstrip("#"), 16)
    return (value >> 16) / 255, (value >> 8 & 255) / 255, (value & 255) / 255


@lru_cache(maxsize=1)
def _noise_volume() -> Float32:
    """Periodic fractal noise [S,S,S] with mean 0 and deviation 1: a spectrum 1/f^2 up to 12 cycles."""
    size = NOISE_SIZE_VOXELS
    white = np.random.RandomState(7).standard_normal((size, size, size))
    wave = np.fft.fftfreq(size, 1 / size)
    frequency = np.sqrt(wave[:, None, None] ** 2 + wave[:, None] ** 2 + wave[: size // 2 + 1] ** 2)
    gain = np.where((frequency >= 3) & (frequency <= 12), 1 / np.maximum(frequency, 1) ** 2, 0)
    volume = np.fft.irfftn(np.fft.rfftn(white) * gain, white.shape, axes=(0, 1, 2))
    return (volume / volume.std()).astype(np.float32)


def noise(points: Float32, scale: float) -> Float32:
    """Smooth noise [N], mean 0, deviation 1, with features of about `scale` and down to a quarter of it."""
    lattice = points.T * np.float32(NOISE_SIZE_VOXELS / (8 * scale))
    sampled: Float32 = map_coordinates(_noise_volume(), lattice, order=1, mode="grid-wrap")
    return sampled


def _mix(first: Rgb, second: Rgb, share: Float32) -> Float32:
    a, b = np.array(first, np.float32), np.array(second, np.float32)
    return a + (b - a) * share[:, None]


def _soft_square(phase: Float32, duty: float, soft: float) -> Float32:
    """Square wave of period 1 in [0,1], high for `duty` of it, with ramps of width `soft`."""
    centered = np.abs(phase - np.round(phase))
    return np.clip((duty / 2 - centered) / soft + 0.5, 0, 1).astype(np.float32)


@dataclass(frozen=True)
class Plain:
    """One color with faint noise, each instance a shade lighter or darker by up to `variety`."""

    color: Rgb
    grain: float = 0.04
    scale: float = 0.12
    variety: float = 0.0

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        # the golden ratio spreads the instances' shades evenly
        shade = 1 + self.variety * (2 * np.mod(instance * 0.618034, 1) - 1).astype(np.float32)
        shade = shade + self.grain * noise(points, self.scale)
        return np.array(self.color, np.float32) * shade[:, None]


@dataclass(frozen=True)
class Mottled:
    """Two colors mixed by noise; `contrast` sharpens the border between them."""

    first: Rgb
    second: Rgb
    scale: float = 0.2
    contrast: float = 0.5
    stretch: Vector = (1.0, 1.0, 1.0)

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        offset = (instance * 0.37).astype(np.float32)
        squeezed = points * (1 / np.array(self.stretch)).astype(np.float32) + offset[:, None]
        value = noise(squeezed, self.scale)
        return _mix(self.first, self.second, np.clip(0.5 + self.contrast * value, 0, 1))


@dataclass(frozen=True)
class Stripes:
    """Bands across `direction` with the given period; `second` covers `duty` of each."""

    first: Rgb
    second: Rgb
    direction: Vector
    period: float
    duty: float = 0.5
    phase: float = 0.0
    soft: float = 0.06

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        axis = np.array(self.direction, np.float32)
        axis /= np.float32(np.linalg.norm(axis) * self.period)
        along = np.einsum("ni,i->n", points, axis) + np.float32(self.phase)
        return _mix(self.first, self.second, _soft_square(along, self.duty, self.soft))


@dataclass(frozen=True)
class Checker:
    """Checkerboard of squares of the given size on two axes (or cubes on three)."""

    first: Rgb
    second: Rgb
    size: float
    axes: tuple[int, ...] = (0, 1)
    soft: float = 0.03

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        sign = np.ones(len(points), np.float32)
        for axis in self.axes:
            wave = _soft_square(points[:, axis] / np.float32(2 * self.size), 0.5, self.soft)
            sign = sign * (2 * wave - 1)
        return _mix(self.first, self.second, 0.5 + 0.5 * sign)


@dataclass(frozen=True)
class Grid:
    """Lines of a square mesh: `second` on lines of relative width `duty`, spaced by `period` on two axes."""

    first: Rgb
    second: Rgb
    period: float
    duty: float = 0.25
    axes: tuple[int, int] = (0, 1)
    soft: float = 0.1

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        waves = [
            _soft_square(points[:, axis] / np.float32(self.period), self.duty, self.soft)
            for axis in self.axes
        ]
        return _mix(self.first, self.second, np.maximum(waves[0], waves[1]))


@dataclass(frozen=True)
class Weave:
    """Diamond mesh on a surface of revolution about z: lines along longitude plus and minus latitude."""

    first: Rgb
    second: Rgb
    turns: int
    rise: float
    duty: float = 0.35
    soft: float = 0.15

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        longitude = np.arctan2(points[:, 1], points[:, 0]) * np.float32(self.turns / (2 * np.pi))
        radius = np.sqrt(np.einsum("ni,ni->n", points, points))
        latitude = np.arcsin(np.clip(points[:, 2] / np.maximum(radius, 1e-6), -1, 1)) * np.float32(self.rise)
        first = _soft_square(longitude + latitude, self.duty, self.soft)
        second = _soft_square(longitude - latitude, self.duty, self.soft)
        return _mix(self.first, self.second, np.maximum(first, second))


@dataclass(frozen=True)
class Wood:
    """Wood grain along `axis`: noisy growth rings of a trunk whose heart lies `offset` away from the axis."""

    light: Rgb
    dark: Rgb
    axis: int = 2
    period: float = 0.07
    offset: tuple[float, float] = (0.35, 0.2)
    wobble: float = 0.5

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        u, v = (points[:, k] for k in range(3) if k != self.axis)
        shift = (instance * 0.41).astype(np.float32)
        radius = np.hypot(u - np.float32(self.offset[0]) - 0.1 * shift, v - np.float32(self.offset[1]))
        # the grain is long: noise varies five times slower along the axis
        squeezed = points.copy()
        squeezed[:, self.axis] *= np.float32(0.2)
        bent = noise(squeezed + shift[:, None], 0.15)
        rings = radius / np.float32(self.period) + np.float32(self.wobble) * bent
        share = 0.5 + 0.35 * np.sin(np.float32(2 * np.pi) * rings) + 0.12 * bent
        return _mix(self.light, self.dark, np.clip(share, 0, 1).astype(np.float32))


@dataclass(frozen=True)
class Rosette:
    """Petals around z: `second` in `count` sectors that fade towards the center and past `radius`."""

    first: Rgb
    second: Rgb
    count: int
    radius: float
    ring: Rgb | None = None

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        angle = np.arctan2(points[:, 1], points[:, 0])
        radius = np.hypot(points[:, 0], points[:, 1]) / np.float32(self.radius)
        petal = 0.62 + 0.38 * np.cos(np.float32(self.count) * angle)
        share = np.clip((petal - radius) / 0.08 + 0.5, 0, 1).astype(np.float32)
        out = _mix(self.first, self.second, share)
        if self.ring is not None:
            band = np.clip((0.06 - np.abs(radius - 1.12)) / 0.03 + 0.5, 0, 1).astype(np.float32)
            out = out + (np.array(self.ring, np.float32) - out) * band[:, None]
        return out


@dataclass(frozen=True)
class Layered:
    """`above` where a coordinate exceeds `level`, else `below`: caps, hems, painted ends."""

    below: Texture
    above: Texture
    axis: int
    level: float
    soft: float = 0.01

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        share = np.clip((points[:, self.axis] - np.float32(self.level)) / np.float32(self.soft) + 0.5, 0, 1)
        lower, upper = self.below(points, instance), self.above(points, instance)
        return lower + (upper - lower) * share[:, None]


@dataclass(frozen=True)
class Tiled:
    """Fabric print: on a square lattice flowers of four petals with a heart, and stripes between the rows."""

    ground: Rgb
    flower: Rgb
    heart: Rgb
    size: float
    soft: float = 0.05

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        # the print is projected along the axis on which the surface lies: the two other coordinates of a slab
        u, v = points[:, 0] / np.float32(self.size), points[:, 1] / np.float32(self.size)
        row = np.round(v)
        u = u + 0.5 * np.mod(row, 2)
        du, dv = u - np.round(u), v - row
        radius, angle = np.hypot(du, dv), np.arctan2(dv, du)
        petal = 0.26 + 0.12 * np.cos(4 * angle)
        share = np.clip((petal - radius) / self.soft + 0.5, 0, 1).astype(np.float32)
        heart = np.clip((0.1 - radius) / self.soft + 0.5, 0, 1).astype(np.float32)
        out = _mix(self.ground, self.flower, share)
        out = out + (np.array(self.heart, np.float32) - out) * heart[:, None]
        weave = 1 + 0.03 * noise(points, 0.06)
        return out * weave[:, None].astype(np.float32)


@dataclass(frozen=True)
class Veined:
    """Leaf along x: a light midrib and side veins, darker between them, lighter towards the tip."""

    blade: Rgb
    vein: Rgb
    length: float

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        x, y = points[:, 0] / np.float32(self.length), np.abs(points[:, 1]) / np.float32(self.length)
        rib = np.clip((0.018 - y) / 0.02 + 0.5, 0, 1)
        side = _soft_square((x - 0.7 * y).astype(np.float32) * 7, 0.22, 0.15) * 0.45
        share = np.maximum(rib, side) + 0.25 * (x + 0.5) * 0.5
        variety = 0.9 + 0.2 * np.mod(instance * 0.618034, 1).astype(np.float32)
        return _mix(self.blade, self.vein, np.clip(share, 0, 1).astype(np.float32)) * variety[:, None]


@dataclass(frozen=True)
class Zigzag:
    """Painted pottery about z: a light band around `level`, on it a dark zigzag of `count` teeth."""

    clay: Rgb
    band: Rgb
    line: Rgb
    count: int
    level: float
    half_width: float = 0.085

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        angle = np.arctan2(points[:, 1], points[:, 0]) * np.float32(self.count / (2 * np.pi))
        z = points[:, 2] - np.float32(self.level)
        tooth = (4 * np.abs(angle - np.floor(angle + 0.5)) - 1) * np.float32(0.6 * self.half_width)
        on_band = np.clip((self.half_width - np.abs(z)) / 0.012 + 0.5, 0, 1).astype(np.float32)
        edge = np.clip((0.014 - np.abs(np.abs(z) - self.half_width)) / 0.012 + 0.5, 0, 1)
        zigzag = np.clip((0.02 - np.abs(z - tooth)) / 0.014 + 0.5, 0, 1)
        out = _mix(self.clay, self.band, on_band)
        dark = np.maximum(edge, zigzag * on_band).astype(np.float32)
        out = out + (np.array(self.line, np.float32) - out) * dark[:, None]
        return out * (1 + 0.05 * noise(points, 0.1))[:, None]


@dataclass(frozen=True)
class Ramp:
    """Color gradient from `first` to `second` while a coordinate runs from `low` to `high`."""

    first: Rgb
    second: Rgb
    axis: int
    low: float
    high: float
    grain: float = 0.05

    def __call__(self, points: Float32, instance: NDArray[np.intp]) -> Float32:
        share = np.clip((points[:, self.axis] - self.low) / (self.high - self.low), 0, 1).astype(np.float32)
        return _mix(self.first, self.second, share) * (1 + self.grain * noise(points, 0.5))[:, None]
