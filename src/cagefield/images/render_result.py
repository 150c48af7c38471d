"""Result of rendering one camera: color, opacity, depth and normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import CagefieldError
from cagefield.typing import Float32

Background = str | Sequence[float] | NDArray[Any] | None
"""Background of a rendered image: "white", "black", three numbers in [0,1], or None (also "none") for
straight color with opacity, nothing behind it. None has this meaning in every function and class."""

_NAMED_BACKGROUNDS = {"white": (1.0, 1.0, 1.0), "black": (0.0, 0.0, 0.0)}


def background_rgb(background: Background) -> tuple[float, float, float] | None:
    """Background as three floats in [0,1], or None for None and "none" (nothing behind the field).

    Raises:
        CagefieldError: other than "white", "black", "none", None or three numbers in [0,1].
    """
    if background is None or (isinstance(background, str) and background == "none"):
        return None
    if isinstance(background, str):
        if background not in _NAMED_BACKGROUNDS:
            raise CagefieldError(
                f'background must be "white", "black", "none" or (r, g, b), not "{background}"'
            )
        return _NAMED_BACKGROUNDS[background]
    rgb = np.asarray(background, np.float64)
    if rgb.shape != (3,) or not ((rgb >= 0) & (rgb <= 1)).all():
        raise CagefieldError(f"background must be three numbers in [0, 1], not {np.round(rgb, 4).tolist()}")
    return float(rgb[0]), float(rgb[1]), float(rgb[2])


def to_uint8(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Values round(255 v) in uint8 of values v in [0,1]; values outside are clipped, uint8 is unchanged."""
    if values.dtype == np.uint8:
        return values
    return (np.clip(values, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


@dataclass(frozen=True)
class RenderResult:
    """Rendered image of one camera; arrays are read-only.

    rgb      [H,W,3] float32: over `background`; with background None the straight color (not premultiplied,
             0 where opacity is 0)
    opacity  [H,W] float32 in [0,1]
    depth    [H,W] float32: expected distance along the unit ray, weights normalized; inf where opacity is 0
    normals  [H,W,3] float32: unit, world space, 0 where opacity is 0; or None
    """

    rgb: Float32
    opacity: Float32
    depth: Float32
    normals: Float32 | None = None
    background: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        shape = self.opacity.shape
        expected = {"rgb": (*shape, 3), "opacity": shape, "depth": shape, "normals": (*shape, 3)}
        if len(shape) != 2:
            raise CagefieldError(f"opacity must be [H,W], not {list(shape)}")
        for name, want in expected.items():
            array = getattr(self, name)
            if array is None:
                continue
            if array.shape != want:
                raise CagefieldError(f"{name} must be {list(want)} like opacity, not {list(array.shape)}")
            view = np.asarray(array, np.float32).view()
            view.flags.writeable = False
            object.__setattr__(self, name, view)

    @classmethod
    def from_premultiplied(
        cls,
        premultiplied: NDArray[Any],
        opacity: NDArray[Any],
        depth: NDArray[Any],
        *,
        normals: NDArray[Any] | None = None,
        background: Background = None,
    ) -> RenderResult:
        """Result from the accumulated color sum(weights * rgb) [H,W,3] over a background."""
        background_color = background_rgb(background)
        opacity = np.clip(opacity, 0.0, 1.0)
        if background_color is None:
            rgb = premultiplied / np.where(opacity > 0, opacity, 1.0)[..., None]
        else:
            rgb = premultiplied + (1.0 - opacity)[..., None] * np.asarray(
                background_color, premultiplied.dtype
            )
        f32 = np.float32
        return cls(
            rgb=rgb.astype(f32),
            opacity=opacity.astype(f32),
            depth=depth.astype(f32),
            normals=None if normals is None else normals.astype(f32),
            background=background_color,
        )

    @property
    def width(self) -> int:
        return int(self.opacity.shape[1])

    @property
    def height(self) -> int:
        return int(self.opacity.shape[0])

    def premultiplied(self) -> Float32:
        """Accumulated color [H,W,3] without the background."""
        if self.background is None:
            return self.rgb * self.opacity[..., None]
        return self.rgb - (1.0 - self.opacity)[..., None] * np.asarray(self.background, np.float32)

    def over(self, background: Background) -> RenderResult:
        """Image over another background; straight color over nothing for None."""
        if background_rgb(background) == self.background:
            return self
        other = RenderResult.from_premultiplied(
            self.premultiplied(), self.opacity, self.depth, background=background
        )
        return replace(other, normals=self.normals)

    def rgb8(self) -> NDArray[np.uint8]:
        """Color rgb [H,W,3] uint8."""
        return to_uint8(self.rgb)

    def rgba8(self) -> NDArray[np.uint8]:
        """Straight color and opacity [H,W,4] uint8."""
        return to_uint8(np.concatenate([self.over(None).rgb, self.opacity[..., None]], axis=-1))
