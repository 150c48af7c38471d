"""Ways in which elements are picked, and highlights of them; plain picklable values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from cagefield.cameras.camera import Camera
from cagefield.selection.brush_and_lasso import Lasso, Rectangle, Stroke
from cagefield.selection.element_selection import Selection
from cagefield.selection.elements import Attribute


@dataclass(frozen=True)
class RegionPick:
    """Elements in a region of a camera's image; `tolerance` in cells, None for all behind the region."""

    region: Rectangle | Lasso | Stroke
    camera: Camera
    tolerance: float | None


@dataclass(frozen=True)
class FloodPick:
    """Elements connected to the surface at a pixel (x, y in [0,1]); `reach` in world units."""

    camera: Camera
    x: float
    y: float
    threshold: float
    reach: float | None


@dataclass(frozen=True)
class RangePick:
    """Elements by an attribute."""

    attribute: Attribute
    low: float
    high: float


@dataclass(frozen=True)
class FloaterPick:
    """Probable floaters."""

    strength: float


@dataclass(frozen=True)
class EveryPick:
    """All elements."""


@dataclass(frozen=True)
class NeighborPick:
    """Elements after growing a selection, or shrinking it where `steps` < 0, by some cells."""

    selection: Selection
    steps: int


Pick: TypeAlias = RegionPick | FloodPick | RangePick | FloaterPick | EveryPick | NeighborPick


@dataclass(frozen=True)
class Highlight:
    """Positions of selected elements, quantized to 16 bits in a box.

    Attributes:
        low, high: corners of the box.
        points: uint16 (little endian) x, y, z of each position; 0 at `low`, 65535 at `high`.
        count: number of positions in `points`; a sample where there are too many.
        size: edge of the square that shows an element, world units: of a cell or a typical selected splat.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    points: bytes
    count: int
    size: float
