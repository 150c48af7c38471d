"""Footprint of a part on its support: the columns of the support under the part.

The height of the support over its plane is a thin-plate spline through the surfaces around. A column of the
footprint belongs to the support where the support closes around the column: a table ends at its edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.surfaces.grid_block import GridBlock, world_positions
from cagefield.completion.surfaces.support_plane import MIN_SUPPORT_SURFELS, PLANE_DISTANCE_VOXELS, Support
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.typing import Array, Mask

MAX_SUPPORT_HEIGHT_VOXELS = 3.0
"""Maximum height over a support at which densities are rebuilt, voxels."""

HOLE_MARGIN_COLUMNS = 2
"""Margin of columns around invisible ones that are filled as well."""

GAP_HALF_WIDTH_COLUMNS = 3
"""Minimum half width of a gap in a support, columns."""

MIN_SHADED_COSINE = 0.8
"""Minimum cosine between the normals of a support and of a surfel of it in deep shade."""

CONTACT_DISTANCE_VOXELS = 3.0
"""Distance from a part within which the part hides a surface, voxels."""

MAX_SPLINE_KNOTS = 1500
"""Maximum number of knots of the spline."""


@dataclass(frozen=True)
class Footprint:
    """Columns of a support on a grid [U,V] with a spacing of one voxel.

    Attributes:
        support: the support.
        first: [2], u and v of column (0, 0).
        hole: [U,V], columns to be filled.
        surroundings: [U,V], columns with a known surface.
        has_surface: [U,V], columns in which the support has a surface.
        height: [U,V], height of the surface over the plane, extrapolated into the hole; voxels.
        log_light_change: [U,V], log of the ratio of light in the surroundings; None where light stays.
    """

    support: Support
    first: NDArray[np.int64]
    hole: Mask
    surroundings: Mask
    has_surface: Mask
    height: Array
    log_light_change: Array | None = None

    def points(self, block: GridBlock, columns: Mask | None = None) -> Array:
        """World positions [N,3] on the surface of some columns [U,V], by default those of the hole."""
        cells = np.argwhere(self.hole if columns is None else columns)
        uv, height = cells + self.first, self.height[tuple(cells.T)]
        block_points = self.support.point + uv @ self.support.axes + height[:, None] * self.support.normal
        return world_positions(block.field, block_points + block.low)

    def remove_free_space(self, is_free: NDArray[np.bool_]) -> Footprint:
        """Footprint without the hole columns of a mask [N] where cameras see past the support."""
        free = np.zeros(self.hole.shape, bool)
        free[tuple(np.argwhere(self.hole)[is_free].T)] = True
        # Drop single rays past the support, and small gaps in the support: dark corners are foggy.
        free = ndimage.binary_opening(ndimage.binary_closing(free)) & self.hole
        seeds = ndimage.binary_opening(free, iterations=GAP_HALF_WIDTH_COLUMNS) | ~(
            self.hole | self.surroundings
        )
        free = ndimage.binary_propagation(seeds, mask=seeds | free) & free
        return replace(self, hole=self.hole & ~free)

    def remove_known(self, is_known: NDArray[np.bool_], part: Mask) -> Footprint:
        """Footprint without the hole columns of a mask [N] with known colors.

        Columns without a surface of the support remain, and those under or beside the part [X,Y,Z]: the
        surface there is the part's own.
        """
        resolved = np.zeros(self.hole.shape, bool)
        resolved[tuple(np.argwhere(self.hole)[is_known].T)] = True
        resolved &= self.has_surface & ~self.columns_under(np.argwhere(part))
        # Surfaces that show through gaps, and right beside the part, are unreliable.
        padded = np.pad(resolved | self.surroundings, HOLE_MARGIN_COLUMNS + 1, mode="edge")
        resolved = ndimage.binary_opening(ndimage.binary_closing(padded), iterations=HOLE_MARGIN_COLUMNS)
        resolved = resolved[
            HOLE_MARGIN_COLUMNS + 1 : -HOLE_MARGIN_COLUMNS - 1,
            HOLE_MARGIN_COLUMNS + 1 : -HOLE_MARGIN_COLUMNS - 1,
        ]
        hole = ndimage.binary_dilation(self.hole & ~resolved, iterations=HOLE_MARGIN_COLUMNS) & self.hole
        return replace(self, hole=hole, surroundings=self.surroundings | (self.hole & ~hole))

    def contains(self, coordinates: Array) -> NDArray[np.bool_]:
        """Mask [N] of block coordinates [N,3] at the surface of a hole column, or near it."""
        u, v, height = self.locate(coordinates)
        return np.asarray((u >= 0) & self.hole[u, v] & (np.abs(height) < MAX_SUPPORT_HEIGHT_VOXELS))

    def columns_under(self, vertices: NDArray[np.int64]) -> Mask:
        """Mask [U,V] of the columns on which block coordinates [N,3] of a part stand, or almost."""
        u, v, height = self.locate(vertices.astype(np.float64))
        is_low = (u >= 0) & (height < MAX_SUPPORT_HEIGHT_VOXELS + 2.0)
        columns = np.zeros(self.hole.shape, bool)
        columns[u[is_low], v[is_low]] = True
        return columns

    def locate(self, coordinates: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        """(u [N], v [N], height over the surface [N]) of block coordinates [N,3].

        u is -1 outside the grid.
        """
        uv, height = self.support.to_local(coordinates)
        cell = np.round(uv).astype(np.int64) - self.first
        is_inside = ((cell >= 0) & (cell < self.hole.shape)).all(axis=1)
        cell[~is_inside] = 0
        height = height - self.height[cell[:, 0], cell[:, 1]]
        return np.where(is_inside, cell[:, 0], -1), cell[:, 1], height


def build_footprint(support: Support, part: Mask, contact: Array, shaded: Surfels) -> Footprint | None:
    """Footprint of a part [X,Y,Z]: columns under it, hidden by it, or in deep shade; None without one.

    contact: block coordinates [N,3] of hidden surfaces; shaded: surfels in deep shade, at block
    coordinates. The sides of a support have no columns.
    """
    uv, member_height = support.to_local(support.members)
    vertices = np.argwhere(part).astype(np.float64)
    part_uv, heights = support.to_local(vertices)
    part_height = float(np.percentile(heights, 98))
    base = part_uv[heights < max(4.0, 0.25 * part_height)]
    contact_local = support.to_local(contact)
    base = np.concatenate([base, contact_local[0][np.abs(contact_local[1]) < 2.0 * PLANE_DISTANCE_VOXELS]])
    if len(base) < 4:
        return None
    shaded_uv, heights = support.to_local(shaded.points[shaded.normals @ support.normal > MIN_SHADED_COSINE])
    shaded_uv = shaded_uv[np.abs(heights) < 2.0 * PLANE_DISTANCE_VOXELS]
    all_uv = np.concatenate([uv, base, shaded_uv])
    first = np.floor(all_uv.min(axis=0)).astype(np.int64) - 3
    size = np.ceil(all_uv.max(axis=0)).astype(np.int64) + 4 - first
    hole, surroundings = np.zeros(size, bool), np.zeros(size, bool)
    hole[tuple((np.round(base).astype(np.int64) - first).T)] = True
    # Close the footprint: parts are hollow.
    hole = ndimage.binary_fill_holes(ndimage.binary_closing(hole, iterations=2))
    hole = ndimage.binary_dilation(hole, iterations=2)
    shaded_columns = np.zeros(size, bool)
    shaded_columns[tuple((np.round(shaded_uv).astype(np.int64) - first).T)] = True
    surroundings[tuple((np.round(uv).astype(np.int64) - first).T)] = True
    surroundings = ndimage.binary_closing(np.pad(surroundings, 2), iterations=2)[2:-2, 2:-2]
    has_surface = surroundings
    hole |= ndimage.binary_closing(shaded_columns, iterations=2) & surroundings
    # Morphological closing of the support with a disc as wide as the hole is deep. The support's own
    # surface in the hole counts: beside an edge of the support the surroundings may have no column.
    disc_radius = int(np.ceil(ndimage.distance_transform_edt(np.pad(hole, 1)).max())) + 3
    padded = np.pad(surroundings, disc_radius)
    surroundings = surroundings & ~hole
    dilated = ndimage.distance_transform_edt(~padded) <= disc_radius
    closing = (ndimage.distance_transform_edt(dilated) > disc_radius)[
        disc_radius:-disc_radius, disc_radius:-disc_radius
    ]
    hole &= closing
    if not hole.any() or not surroundings.any():
        return None
    rng = np.random.default_rng(0)
    is_known = surroundings[tuple((np.round(uv).astype(np.int64) - first).T)]
    knots = np.flatnonzero(is_known)
    if len(knots) < MIN_SUPPORT_SURFELS:
        return None
    knots = rng.choice(knots, min(MAX_SPLINE_KNOTS, len(knots)), replace=False)
    from scipy.interpolate import RBFInterpolator

    spline = RBFInterpolator(uv[knots], member_height[knots], neighbors=64, smoothing=4.0)
    cells = np.argwhere(hole | surroundings)
    height = np.zeros(size)
    height[tuple(cells.T)] = spline((cells + first).astype(np.float64))
    return Footprint(support, first, hole, surroundings, has_surface, height)
