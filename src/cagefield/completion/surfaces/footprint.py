"""Where a support goes on under what stood on it: the columns of a part's footprint.

The height over its plane is a thin-plate spline through the surfaces around. Columns of the footprint
belong to the support where it closes around them: a table ends at its edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import RBFInterpolator

from cagefield.completion.surfaces.grid_block import GridBlock, world_positions
from cagefield.completion.surfaces.support_plane import MIN_SUPPORT_SURFELS, PLANE_DISTANCE_VOXELS, Support
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.typing import Array, Mask

MAX_SUPPORT_HEIGHT_VOXELS = 3.0
"""Height over a support, voxels, up to which it is made anew."""

HOLE_MARGIN_COLUMNS = 2
"""Columns beside those that no camera sees that are filled too."""

GAP_HALF_WIDTH_COLUMNS = 3
"""Half the width of a gap amid a support from which on it is one; columns."""

MIN_SHADED_COSINE = 0.8
"""Least cosine between a support's normal and those of its surface in deep shade."""

CONTACT_DISTANCE_VOXELS = 3.0
"""Surfaces are hidden by what comes this near to them, voxels."""

MAX_SPLINE_KNOTS = 1500
"""Vertices through which the spline goes, at most."""


@dataclass(frozen=True)
class Footprint:
    """Columns of a support on a grid [U,V] a voxel apart: those in the hole, and those around it.

    surfaced [U,V]: those where the support has a surface; height [U,V] of that, also where it goes on.
    changed [U,V]: the log of by how much light on the columns around was changed, None where it was not.
    """

    support: Support
    first: NDArray[np.int64]
    hole: Mask
    around: Mask
    surfaced: Mask
    height: Array
    changed: Array | None = None

    def points(self, block: GridBlock, columns: Mask | None = None) -> Array:
        """World positions [N,3] of some columns [U,V] on the surface, the hole's unless others are given."""
        cells = np.argwhere(self.hole if columns is None else columns)
        uv, height = cells + self.first, self.height[tuple(cells.T)]
        at = self.support.point + uv @ self.support.axes + height[:, None] * self.support.normal
        return world_positions(block.field, at + block.low)

    def without_air(self, air: NDArray[np.bool_]) -> Footprint:
        """The footprint whose hole lacks columns [N] where cameras see that no support goes on."""
        gone = np.zeros(self.hole.shape, bool)
        gone[tuple(np.argwhere(self.hole)[air].T)] = True
        # Single rays that pass are noise, and so are small gaps amid the support: dark corners are foggy.
        gone = ndimage.binary_opening(ndimage.binary_closing(gone)) & self.hole
        sure = ndimage.binary_opening(gone, iterations=GAP_HALF_WIDTH_COLUMNS) | ~(self.hole | self.around)
        gone = ndimage.binary_propagation(sure, mask=sure | gone) & gone
        return replace(self, hole=self.hole & ~gone)

    def without(self, known: NDArray[np.bool_], part: Mask) -> Footprint:
        """The footprint whose hole lacks what is known [N] of its columns.

        Only columns where the support has a surface can be. What a part [X,Y,Z] stands on, or comes close to,
        is not: its own crust is there.
        """
        kept = np.zeros(self.hole.shape, bool)
        kept[tuple(np.argwhere(self.hole)[known].T)] = True
        kept &= self.surfaced & ~self.stands(np.argwhere(part))
        # What shows through gaps, and right beside the part, is of no use.
        wide = np.pad(kept | self.around, HOLE_MARGIN_COLUMNS + 1, mode="edge")
        kept = ndimage.binary_opening(ndimage.binary_closing(wide), iterations=HOLE_MARGIN_COLUMNS)
        kept = kept[
            HOLE_MARGIN_COLUMNS + 1 : -HOLE_MARGIN_COLUMNS - 1,
            HOLE_MARGIN_COLUMNS + 1 : -HOLE_MARGIN_COLUMNS - 1,
        ]
        hole = ndimage.binary_dilation(self.hole & ~kept, iterations=HOLE_MARGIN_COLUMNS) & self.hole
        return replace(self, hole=hole, around=self.around | (self.hole & ~hole))

    def holds(self, at: Array) -> NDArray[np.bool_]:
        """Which block coordinates [N,3] lie at the surface of the hole's columns, or near it."""
        u, v, height = self.column(at)
        return np.asarray((u >= 0) & self.hole[u, v] & (np.abs(height) < MAX_SUPPORT_HEIGHT_VOXELS))

    def stands(self, at: NDArray[np.int64]) -> Mask:
        """Columns [U,V] that block coordinates [N,3] of a part stand on, or nearly."""
        u, v, height = self.column(at.astype(np.float64))
        low = (u >= 0) & (height < MAX_SUPPORT_HEIGHT_VOXELS + 2.0)
        out = np.zeros(self.hole.shape, bool)
        out[u[low], v[low]] = True
        return out

    def column(self, at: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        """(u [N], v [N], height over the support [N]) of block coordinates [N,3]; u is -1 outside."""
        uv, height = self.support.local(at)
        cell = np.round(uv).astype(np.int64) - self.first
        inside = ((cell >= 0) & (cell < self.hole.shape)).all(axis=1)
        cell[~inside] = 0
        height = height - self.height[cell[:, 0], cell[:, 1]]
        return np.where(inside, cell[:, 0], -1), cell[:, 1], height


def build_footprint(support: Support, part: Mask, close: Array, unsure: Surfels) -> Footprint | None:
    """The columns under the part, and those of the surfaces close to it, and of those in deep shade.

    close: block coordinates [N,3] of the former; unsure: the latter, at block coordinates. The sides of a
    support are no part of its columns.
    """
    uv, own = support.local(support.members)
    content = np.argwhere(part).astype(np.float64)
    where, above = support.local(content)
    tall = float(np.percentile(above, 98))
    low = where[above < max(4.0, 0.25 * tall)]
    dark = support.local(close)
    low = np.concatenate([low, dark[0][np.abs(dark[1]) < 2.0 * PLANE_DISTANCE_VOXELS]])
    if len(low) < 4:
        return None
    deep, above = support.local(unsure.points[unsure.normals @ support.normal > MIN_SHADED_COSINE])
    deep = deep[np.abs(above) < 2.0 * PLANE_DISTANCE_VOXELS]
    every = np.concatenate([uv, low, deep])
    first = np.floor(every.min(axis=0)).astype(np.int64) - 3
    size = np.ceil(every.max(axis=0)).astype(np.int64) + 4 - first
    hole, around = np.zeros(size, bool), np.zeros(size, bool)
    hole[tuple((np.round(low).astype(np.int64) - first).T)] = True
    # Parts are hollow.
    hole = ndimage.binary_fill_holes(ndimage.binary_closing(hole, iterations=2))
    hole = ndimage.binary_dilation(hole, iterations=2)
    shade = np.zeros(size, bool)
    shade[tuple((np.round(deep).astype(np.int64) - first).T)] = True
    around[tuple((np.round(uv).astype(np.int64) - first).T)] = True
    around = ndimage.binary_closing(np.pad(around, 2), iterations=2)[2:-2, 2:-2]
    surfaced = around
    hole |= ndimage.binary_closing(shade, iterations=2) & around
    # What the support closes around belongs to it: a disc as wide as the hole is deep decides. Its own
    # surface in the hole counts: beside an edge of the support there may be none around.
    reach = int(np.ceil(ndimage.distance_transform_edt(np.pad(hole, 1)).max())) + 3
    wide = np.pad(around, reach)
    around = around & ~hole
    grown = ndimage.distance_transform_edt(~wide) <= reach
    closed = (ndimage.distance_transform_edt(grown) > reach)[reach:-reach, reach:-reach]
    hole &= closed
    if not hole.any() or not around.any():
        return None
    chance = np.random.default_rng(0)
    near = around[tuple((np.round(uv).astype(np.int64) - first).T)]
    knots = np.flatnonzero(near)
    if len(knots) < MIN_SUPPORT_SURFELS:
        return None
    knots = chance.choice(knots, min(MAX_SPLINE_KNOTS, len(knots)), replace=False)
    spline = RBFInterpolator(uv[knots], own[knots], neighbors=64, smoothing=4.0)
    cells = np.argwhere(hole | around)
    height = np.zeros(size)
    height[tuple(cells.T)] = spline((cells + first).astype(np.float64))
    return Footprint(support, first, hole, around, surfaced, height)
