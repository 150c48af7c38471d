"""Elements of a field, the units of selections: its splats, or occupied cells of a grid over its density.

Every element lies in a cell of the *occupancy grid*, which has the opacity of each cell: neighborhoods,
clouds and floods are found there. Of voxels the elements are the cells themselves. The grid of a contracted
field is even in contracted space.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cagefield.errors import CagefieldError
from cagefield.typing import Array, Float32, Mask

Attribute: TypeAlias = Literal["size", "opacity", "red", "green", "blue", "hue", "saturation", "value"]

ATTRIBUTES: tuple[Attribute, ...] = get_args(Attribute)

HISTOGRAM_BINS = 48
"""Bins of a histogram."""


@dataclass(frozen=True, eq=False)
class Elements:
    """N elements of a field, canonical space, world units.

    Attributes:
        kind: "splats" or "cells".
        positions: [N,3] float32, means of splats or centers of cells.
        radii: [N] float32, distance from the position within which nearly all of the element's opacity is.
        sizes: [N] float32, largest standard deviation of a splat, or edge of a cell.
        opacities: [N] float32 in [0,1], of a splat at its mean, or of a ray across a cell.
        rgb: [N,3] float32 in [0,1], the harmonics' mean over all directions.
        cells: [N,3] int32, indices into `occupancy`; -1 for splats beyond it.
        occupancy: [X,Y,Z] float32 in [0,1], opacity of each cell.
        cell_edge: edge of a cell; in the box of interest where the field is contracted.
    """

    kind: Literal["splats", "cells"]
    positions: Float32
    radii: Float32
    sizes: Float32
    opacities: Float32
    rgb: Float32
    cells: NDArray[np.int32]
    occupancy: Float32
    cell_edge: float

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def in_grid(self) -> Mask:
        """[N], True where an element lies in a cell of `occupancy`."""
        return np.asarray((self.cells >= 0).all(axis=1))

    @cached_property
    def tree(self) -> cKDTree:
        """Spatial index of the positions, of many queries."""
        return cKDTree(self.positions)

    def nearest(self, point: Array) -> int:
        """Number of the element nearest to a canonical point [3]. Raises CagefieldError without elements."""
        if not len(self):
            raise CagefieldError("the field has nothing to select: all of it is transparent")
        return int(np.argmin(((self.positions - point) ** 2).sum(axis=1)))

    def attribute(self, name: Attribute) -> Float32:
        """Values [N] of an attribute: "size" in world units, all others in [0,1].

        Hue, saturation and value are those of HSV; hue 0 and 1 are red.

        Raises CagefieldError for another name.
        """
        if name == "size":
            return self.sizes
        if name == "opacity":
            return self.opacities
        if name in ("red", "green", "blue"):
            return self.rgb[:, ("red", "green", "blue").index(name)]
        if name in ("hue", "saturation", "value"):
            return self._hsv[:, ("hue", "saturation", "value").index(name)]
        raise CagefieldError(f'attribute "{name}" must be one of {", ".join(ATTRIBUTES)}')

    def in_range(self, name: Attribute, low: float, high: float) -> Mask:
        """[N], True where an attribute lies in [low, high]. Raises CagefieldError for low > high or NaN."""
        if not low <= high:
            raise CagefieldError(f"the range of {name} must have low <= high, got {low:g} to {high:g}")
        values = self.attribute(name)
        # The ends of a histogram are float32 values that a page has written as decimals.
        slack = 1e-6 * max(abs(low), abs(high))
        return np.asarray((values >= low - slack) & (values <= high + slack))

    @cached_property
    def _hsv(self) -> Float32:
        high, low = self.rgb.max(axis=1), self.rgb.min(axis=1)
        chroma = high - low
        some = np.where(chroma > 0.0, chroma, 1.0)
        red, green, blue = self.rgb.T
        sector = np.select(
            [high == red, high == green],
            [(green - blue) / some, 2.0 + (blue - red) / some],
            4.0 + (red - green) / some,
        )
        hue = np.where(chroma > 0.0, (sector / 6.0) % 1.0, 0.0)
        saturation = np.where(high > 0.0, chroma / np.where(high > 0.0, high, 1.0), 0.0)
        return np.stack([hue, saturation, high], axis=1).astype(np.float32)


@dataclass(frozen=True)
class Histogram:
    """Counts of an attribute's values in even bins from `low` to `high`; of sizes, even in their logarithm.

    counts: all elements; selected: those of a selection.
    """

    low: float
    high: float
    counts: tuple[int, ...]
    selected: tuple[int, ...]


def histogram(elements: Elements, name: Attribute, selected: Mask) -> Histogram:
    """Histogram of an attribute, with the elements that a mask [N] selects.

    Raises CagefieldError for an unknown attribute.
    """
    values = elements.attribute(name).astype(np.float64)
    low, high = 0.0, 1.0
    if name == "size":
        low, high = (float(values.min()), float(values.max())) if len(values) else (1.0, 1.0)
        values, ends = np.log(values), (np.log(low), np.log(high))
    else:
        ends = (low, high)
    if ends[0] == ends[1]:
        ends = (ends[0] - 0.5, ends[1] + 0.5)
    counts = np.histogram(values, HISTOGRAM_BINS, ends)[0]
    chosen = np.histogram(values[selected], HISTOGRAM_BINS, ends)[0]
    return Histogram(low, high, tuple(counts.tolist()), tuple(chosen.tolist()))
