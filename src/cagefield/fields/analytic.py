"""Closed-form radiance fields, used as oracles of the renderers.

Notation: a point x, a unit view direction d, a ray o + t d. Every component knows its optical depth
tau = integral of sigma along a ray segment in closed form; opacity is 1 - exp(-tau) (Beer-Lambert).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import erf

from cagefield.errors import FieldError
from cagefield.typing import Array, Float32

GAUSSIAN_REACH_SIGMAS = 5.0
"""Extent of a blob's bounds in standard deviations; beyond it sigma is below 3.7e-6 of the peak."""


def _vector(name: str, value: ArrayLike, *, low: float = -np.inf, high: float = np.inf) -> Array:
    """Read-only float64 [3] from a 3-vector or a scalar. Raises FieldError outside [low, high]."""
    try:
        out = np.array(np.broadcast_to(np.asarray(value, np.float64), (3,)))
    except ValueError as error:
        raise FieldError(f"{name} must be a number or 3 numbers, not {value!r}") from error
    if not (np.isfinite(out).all() and (out >= low).all() and (out <= high).all()):
        raise FieldError(f"{name} must be finite and in [{low:g}, {high:g}], not {out.tolist()}")
    out.flags.writeable = False
    return out


def _positive(name: str, value: float) -> float:
    if not (np.isfinite(value) and value > 0):
        raise FieldError(f"{name} must be positive and finite, not {value!r}")
    return float(value)


class Component(Protocol):
    """Density with one color law; a summand of AnalyticField."""

    rgb: Any

    @property
    def bounds(self) -> Array: ...

    def sigma(self, positions: NDArray[Any]) -> Array: ...

    def optical_depth(self, origins: Array, directions: Array, near: Array, far: Array) -> Array: ...


@dataclass(frozen=True)
class UniformBox:
    """Constant sigma in an axis-aligned box; along a ray tau = sigma * (length of the ray inside)."""

    center: Array
    size: Array
    density: float
    rgb: Array

    def __init__(self, center: ArrayLike, size: ArrayLike, density: float, rgb: ArrayLike = 1.0) -> None:
        object.__setattr__(self, "center", _vector("center", center))
        object.__setattr__(self, "size", _vector("size", size, low=1e-12))
        object.__setattr__(self, "density", _positive("density", density))
        object.__setattr__(self, "rgb", _vector("rgb", rgb, low=0.0, high=1.0))

    @property
    def bounds(self) -> Array:
        return np.stack([self.center - self.size / 2, self.center + self.size / 2])

    def sigma(self, positions: NDArray[Any]) -> Array:
        inside = np.all(np.abs(positions - self.center) <= self.size / 2, axis=-1)
        return np.where(inside, self.density, 0.0)

    def optical_depth(self, origins: Array, directions: Array, near: Array, far: Array) -> Array:
        lower, upper = self.bounds
        with np.errstate(divide="ignore", invalid="ignore"):
            to_lower, to_upper = (lower - origins) / directions, (upper - origins) / directions
        enter = np.fmax.reduce(np.fmin(to_lower, to_upper), axis=-1)
        leave = np.fmin.reduce(np.fmax(to_lower, to_upper), axis=-1)
        return self.density * np.clip(np.minimum(leave, far) - np.maximum(enter, near), 0.0, None)


@dataclass(frozen=True)
class UniformSphere:
    """Constant sigma in a ball; along a ray tau = sigma * chord."""

    center: Array
    radius: float
    density: float
    rgb: Array

    def __init__(self, center: ArrayLike, radius: float, density: float, rgb: ArrayLike = 1.0) -> None:
        object.__setattr__(self, "center", _vector("center", center))
        object.__setattr__(self, "radius", _positive("radius", radius))
        object.__setattr__(self, "density", _positive("density", density))
        object.__setattr__(self, "rgb", _vector("rgb", rgb, low=0.0, high=1.0))

    @property
    def bounds(self) -> Array:
        return np.stack([self.center - self.radius, self.center + self.radius])

    def sigma(self, positions: NDArray[Any]) -> Array:
        inside = ((positions - self.center) ** 2).sum(-1) <= self.radius**2
        return self.density * inside.astype(np.float64)

    def optical_depth(self, origins: Array, directions: Array, near: Array, far: Array) -> Array:
        to_center = self.center - origins
        middle = (to_center * directions).sum(-1)
        half = np.sqrt(np.clip(self.radius**2 - (to_center**2).sum(-1) + middle**2, 0.0, None))
        length = np.minimum(middle + half, far) - np.maximum(middle - half, near)
        return self.density * np.clip(length, 0.0, None)


@dataclass(frozen=True)
class GaussianBlob:
    """sigma = density * exp(-|x - center|^2 / (2 scale^2)); tau is an error function."""

    center: Array
    scale: float
    density: float
    rgb: Array

    def __init__(self, center: ArrayLike, scale: float, density: float, rgb: ArrayLike = 1.0) -> None:
        object.__setattr__(self, "center", _vector("center", center))
        object.__setattr__(self, "scale", _positive("scale", scale))
        object.__setattr__(self, "density", _positive("density", density))
        object.__setattr__(self, "rgb", _vector("rgb", rgb, low=0.0, high=1.0))

    @property
    def bounds(self) -> Array:
        reach = GAUSSIAN_REACH_SIGMAS * self.scale
        return np.stack([self.center - reach, self.center + reach])

    def sigma(self, positions: NDArray[Any]) -> Array:
        squared: Array = ((positions - self.center) ** 2).sum(-1)
        return self.density * np.exp(-squared / (2 * self.scale**2))

    def optical_depth(self, origins: Array, directions: Array, near: Array, far: Array) -> Array:
        to_center = self.center - origins
        middle = (to_center * directions).sum(-1)
        distance2 = np.clip((to_center**2).sum(-1) - middle**2, 0.0, None)
        root = np.sqrt(2.0) * self.scale
        cumulative: Array = erf((far - middle) / root) - erf((near - middle) / root)
        peak = self.density * np.exp(-distance2 / root**2)
        return peak * np.sqrt(np.pi / 2) * self.scale * cumulative


@dataclass(frozen=True)
class AnalyticField:
    """Sum of components: sigma adds up, rgb is the sigma-weighted mean of the components' colors.

    rgb of a component may vary linearly: rgb + position_slope @ x + view_slope @ d, clipped to [0,1].
    Slopes are [3,3] (color channel, axis) and shared by all components.
    """

    components: tuple[Component, ...]
    position_slope: Array = field(default_factory=lambda: np.zeros((3, 3)))
    view_slope: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def __init__(
        self,
        components: Iterable[Component],
        *,
        position_slope: ArrayLike = 0.0,
        view_slope: ArrayLike = 0.0,
    ) -> None:
        components = tuple(components)
        if not components:
            raise FieldError(
                "components must hold at least one component; AnalyticField([UniformSphere(...)])"
            )
        object.__setattr__(self, "components", components)
        for name, value in (("position_slope", position_slope), ("view_slope", view_slope)):
            slope = np.asarray(value, np.float64)
            if slope.shape not in ((), (3, 3)) or not np.isfinite(slope).all():
                raise FieldError(f"{name} must be a finite [3,3] array, not shape {list(slope.shape)}")
            slope = np.array(np.broadcast_to(slope, (3, 3)))
            slope.flags.writeable = False
            object.__setattr__(self, name, slope)

    @property
    def bounds(self) -> Array:
        """Box [2,3] that holds every component (a blob up to GAUSSIAN_REACH_SIGMAS standard deviations)."""
        boxes = np.stack([component.bounds for component in self.components])
        return np.stack([boxes[:, 0].min(0), boxes[:, 1].max(0)])

    def __call__(self, positions: Float32, viewdirs: Float32) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,3]) float32; evaluated in float64."""
        points = np.asarray(positions, np.float64)
        sigmas = np.stack([component.sigma(points) for component in self.components])
        total = sigmas.sum(0)
        share = sigmas / np.where(total > 0, total, 1.0)
        rgb = share.T @ np.stack([component.rgb for component in self.components])
        rgb = rgb + points @ self.position_slope.T + np.asarray(viewdirs, np.float64) @ self.view_slope.T
        return total.astype(np.float32), np.clip(rgb, 0.0, 1.0).astype(np.float32)

    def optical_depth(
        self, origins: ArrayLike, directions: ArrayLike, near: ArrayLike = 0.0, far: ArrayLike = np.inf
    ) -> Array:
        """Exact integral [N] of sigma over o + t d, t in [near, far]; directions are unit."""
        o, d = np.asarray(origins, np.float64), np.asarray(directions, np.float64)
        o, d = np.broadcast_arrays(o, d)
        lo, hi = np.asarray(near, np.float64), np.asarray(far, np.float64)
        return np.sum([part.optical_depth(o, d, lo, hi) for part in self.components], axis=0)
