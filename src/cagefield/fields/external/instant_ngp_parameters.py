"""Instant-NGP: a hash grid with two small perceptrons in a cube, and an occupancy grid.

Notation: p world positions (the transforms.json of the capture), q positions in NGP's own space,

    q = P (scale p + offset),   P cycles the axes: q = (y, z, x); it is the identity of Mitsuba captures
    x = (q - 1/2) / aabb_scale + 1/2 in [0,1]^3 over the cube of edge aabb_scale around 1/2
    h = F(x),  sigma = scale exp(h_0) per world unit,  rgb = activation(G(h, Y(P d)))

F is a network over a hash grid (layout "tcnn") with 16 outputs, G a perceptron, Y spherical harmonics of
degree 3; the activation is the logistic function, or for captures of high dynamic range exp, whose linear
colors are clamped to [0,1] and encoded as sRGB, sample by sample.

Occupancy: cascade c covers the cube of edge 2^c around 1/2 with 128^3 cells; a position reads the finest
cascade whose cube holds it. sigma is 0 where its cell is empty, and outside the crop box.

Rays: lattice of step lengths STEP for a cube of edge 1, else STEP, growing with t / 256 up to 1024 STEP
(units of q); samples at points of the lattice, less those that lie in empty cells.

Source: Mueller et al., "Instant Neural Graphics Primitives" (2022), section 5.4 and appendix E; layout and
sampling of github.com/NVlabs/instant-ngp, nerf_device.cuh and testbed_nerf.cu.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import (
    ExternalField,
    frozen_array,
    frozen_box,
    number,
    whole_number,
)
from cagefield.fields.external.hash_network import (
    HashNetwork,
    Layers,
    checked_layers,
    describe_layers,
    layer_arrays,
    take_array,
    take_layers,
)

GRID_CELLS = 128
"""Cells of an occupancy cascade along each axis."""
CASCADE_BYTES = GRID_CELLS**3 // 8
MAX_CASCADES = 8
DIRECTION_TERMS = 16
STEP = math.sqrt(3.0) / 1024.0
"""Shortest distance of samples in NGP's space."""
NEAR = 0.05
"""Distance from the camera at which rays begin in NGP's space."""

_OPTIONS = ("aabb_scale", "scale", "offset", "cycled", "hdr")


@dataclass(frozen=True, eq=False)
class InstantNgpParameters(ExternalField):
    """Instant-NGP model (canonical space, world units: those of the capture's transforms.json).

    Attributes:
        base: network F with the layout "tcnn".
        head: layers of G: inputs are F's outputs, then 16 harmonics; three outputs.
        crop: [2,3] box of the picture in `crop_axes`, NGP's space.
        crop_axes: [3,3] rotation from NGP's space to the crop box's axes.
        occupancy: [C, 128^3/8] uint8, packed bits of the cascades' cells in x, y, z order; None without.
        aabb_scale: edge of the cube, a power of two. scale, offset: from world to NGP's space.
        cycled: axes are cycled. hdr: exponential colors, linear.

    Raises:
        FieldError: networks that do not fit each other, options out of range.
    """

    KIND: ClassVar[str] = "InstantNgpField"

    base: HashNetwork
    head: Layers
    crop: NDArray[np.float64]
    crop_axes: NDArray[np.float64]
    occupancy: NDArray[np.uint8] | None = None
    aabb_scale: int = 1
    scale: float = 0.33
    offset: tuple[float, float, float] = (0.5, 0.5, 0.5)
    cycled: bool = True
    hdr: bool = False

    def __post_init__(self) -> None:
        def fix(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        if self.base.grid.layout != "tcnn":
            raise FieldError('the hash grid of Instant-NGP must have the layout "tcnn"')
        fix("head", checked_layers("rgb_network layer", self.head, self.base.outputs + DIRECTION_TERMS, 3))
        fix("crop", frozen_box("render_aabb", self.crop))
        fix("crop_axes", frozen_array("render_aabb_to_local", self.crop_axes, np.float64, (3, 3)))
        if np.abs(self.crop_axes @ self.crop_axes.T - np.eye(3)).max() > 1e-3:
            raise FieldError("render_aabb_to_local must be a rotation [3,3]")
        edge = whole_number("aabb_scale", self.aabb_scale, 1, 1 << (MAX_CASCADES - 1))
        if edge & (edge - 1):
            raise FieldError(f"aabb_scale is {edge}; it must be a power of two")
        fix("aabb_scale", edge)
        fix("scale", number("scale", self.scale, 1e-9, 1e9))
        if not isinstance(self.offset, (tuple, list)) or len(self.offset) != 3:
            raise FieldError(f"offset must be three numbers, got {self.offset!r:.60}")
        fix("offset", tuple(number("offset", value, -1e9, 1e9) for value in self.offset))
        for name in ("cycled", "hdr"):
            fix(name, bool(getattr(self, name)))
        if self.occupancy is not None:
            shape = (self.cascades, CASCADE_BYTES)
            fix("occupancy", frozen_array("occupancy", self.occupancy, np.uint8, shape))

    @property
    def cascades(self) -> int:
        """Number of occupancy cascades."""
        return self.aabb_scale.bit_length()

    @property
    def near(self) -> float:  # type: ignore[override]
        """Distance from the cameras at which rays begin, world units."""
        return NEAR / self.scale

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Corners [2,3] of the box around the crop box within the cube, world units."""
        half = 0.5 * self.aabb_scale
        corners = np.array(np.meshgrid(*self.crop.T)).reshape(3, -1).T @ self.crop_axes
        lower = np.maximum(corners.min(axis=0), 0.5 - half)
        upper = np.minimum(corners.max(axis=0), 0.5 + half)
        if not (lower < upper).all():  # the crop box is outside the cube
            lower, upper = np.full(3, 0.5 - half), np.full(3, 0.5 + half)
        return np.stack([self.to_world(lower), self.to_world(upper)])

    def to_world(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """World positions [...,3] of positions in NGP's space."""
        axes = positions[..., [2, 0, 1]] if self.cycled else positions
        moved: NDArray[np.float64] = (axes - np.array(self.offset)) / self.scale
        return moved

    def describe(self) -> str:
        """Grid, networks, cube, occupancy."""
        masked = "no occupancy grid" if self.occupancy is None else f"{self.cascades} occupancy cascades"
        return (
            f"Instant-NGP: {self.base.grid}, MLPs {describe_layers(self.base.layers)} and "
            f"{describe_layers(self.head)}, aabb_scale {self.aabb_scale}, {masked}"
        )

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Table, layers, crop box, occupancy by name."""
        found: dict[str, NDArray[Any]] = {
            **self.base.arrays("base"),
            **layer_arrays("head", self.head),
            "crop": self.crop,
            "crop_axes": self.crop_axes,
        }
        if self.occupancy is not None:
            found["occupancy"] = self.occupancy
        return found

    def options(self) -> dict[str, Any]:
        """Space, colors, and the grid's options."""
        return {**{name: getattr(self, name) for name in _OPTIONS}, "grid": self.base.grid.options()}

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Any]
    ) -> InstantNgpParameters:
        """Field of the values of `arrays` and `options`. Raises FieldError where they do not fit."""
        return cls(
            HashNetwork.from_arrays("base", arrays, options["grid"]),
            take_layers(arrays, "head"),
            take_array(arrays, "crop"),
            take_array(arrays, "crop_axes"),
            arrays.get("occupancy"),
            **{name: options[name] for name in _OPTIONS},
        )
