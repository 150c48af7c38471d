"""Inpainting with splats: new splats on the surfaces of an inpainted voxel grid.

Inpainted surfaces are ridges of density. New splats are laid on them a voxel apart: each is a copy of a
splat beside the hole that lies flat on a surface and has the grid's color, rotated to the ridge's normal,
scaled to a voxel, with its color multiplied to match. A cloned cage brings copies of its own splats.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from cagefield.completion.surfaces.block_extraction import interpolate_field
from cagefield.completion.surfaces.footprint import MAX_SPLINE_KNOTS
from cagefield.completion.surfaces.grid_block import GridBlock, world_positions
from cagefield.completion.surfaces.support_plane import Support
from cagefield.compute.cancellation import check_cancelled
from cagefield.edits.patch import NewLight, SplatPatch
from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.rendering.splats.splat_motion import MovedSplats
from cagefield.typing import Array, Mask
from cagefield.warps.hexahedron_map import HexahedronMap

SPLAT_WIDTH_VOXELS = 0.7
"""Standard deviation of a new splat along the surface, voxels."""

MAX_THICKNESS_VOXELS = 0.35
"""Maximum standard deviation of a new splat across the surface, voxels."""

MIN_FLAT_COSINE = 0.8
"""Minimum cosine between the shortest axis of a flat splat and the surface's normal."""

MIN_UPPER_COSINE = 0.3
"""Minimum cosine between the normals of an inpainted surface and of the support."""

MIN_FLAT_SPLATS = 8
"""Minimum number of flat splats; with fewer, all splats beside the hole are copied."""

HEIGHT_RADIUS_VOXELS = 12.0
"""Radius around the new splats in which known splats give the height of the surface, voxels."""

MAX_HEIGHT_CHANGE_VOXELS = 1.0
"""Maximum change of height of a new splat, voxels."""

VIEW_DEPENDENCE_WEIGHT = 1.0
"""Weight of a splat's view dependence against its log color difference when a splat is chosen for a copy."""

MIN_DIVISOR_COLOR = 0.02
"""Minimum color as a divisor."""

MIN_COPIED_OPACITY = 0.6
"""Minimum opacity of copied splats."""

COLOR_GAIN_RANGE = (0.1, 10.0)
"""Minimum and maximum factor of colors."""


NewSplats: TypeAlias = tuple[NDArray[np.int64], Array, Array, Array]
"""New splats: rows [A] of the splats they copy, means [A,3], factors of shapes [A,3,3], colors [A,3]."""

NO_SPLATS: NewSplats = (np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
"""No new splats."""


@dataclass(frozen=True, eq=False)
class KnownSplats:
    """Splats [N] of a field under the edits below, and their voxel grid.

    rows [N]: their rows in the field; turns [N,3,3], gains [N,3]: factors of their shapes and colors.
    """

    splats: SplatField
    grid: VoxelField
    rows: NDArray[np.int64]
    turns: Array
    gains: Array

    @classmethod
    def from_moved(
        cls, field: SplatField, splats: SplatField, grid: VoxelField, moved: MovedSplats
    ) -> KnownSplats:
        """Splats of a field that some edits moved, in `splats`, and stayed."""
        check_cancelled()
        still = np.flatnonzero(~moved.left)
        gains = np.ones((len(moved.source), 3)) if moved.gains is None else moved.gains
        if moved.grade is not None:
            # A grade as factors of each splat's mean color.
            mean = np.maximum(0.5 + C0 * field.sh[moved.source, 0], MIN_DIVISOR_COLOR)
            graded = np.einsum("nij,nj->ni", moved.grade.colors, gains * mean)
            gains = np.maximum(graded, 0.0) / mean
        return cls(
            splats,
            grid,
            np.concatenate([still, moved.source]),
            np.concatenate([np.broadcast_to(np.eye(3), (len(still), 3, 3)), moved.jacobian]),
            np.concatenate([np.ones((len(still), 3)), gains]),
        )

    def fill_surface(
        self, under: GridBlock, is_new: Mask, region: Cage, inner: Cage, support: Support
    ) -> NewSplats:
        """New splats on the upper side of an inpainted support, at the new vertices [X,Y,Z] of a block."""
        check_cancelled()
        coordinates, normals = _upper_surface(under, is_new, support.normal)
        candidates = self._flat_neighbors(under, region, inner, is_new, support.normal)
        if not len(coordinates) or not len(candidates):
            return NO_SPLATS
        coordinates = self._align_heights(candidates, under, support, coordinates)
        points = world_positions(under.field, coordinates + under.low)
        frames = rotation_matrices(self.splats.quaternions[candidates].astype(np.float64))
        scales = np.exp(self.splats.log_scales[candidates].astype(np.float64))
        colors = _interpolate_colors(under, coordinates)
        match = self._match_colors(candidates, colors)
        frames, scales = frames[match], scales[match]
        numbers, shortest = np.arange(len(coordinates)), np.argmin(scales, axis=1)
        normal = frames[numbers, :, shortest]
        normal = normal * np.where(np.einsum("ni,ni->n", normal, normals) < 0.0, -1.0, 1.0)[:, None]
        voxel = float(under.field.voxel_size.max())
        target_scales = np.full(scales.shape, SPLAT_WIDTH_VOXELS * voxel)
        target_scales[numbers, shortest] = np.minimum(scales[numbers, shortest], MAX_THICKNESS_VOXELS * voxel)
        shapes = (frames * (target_scales / scales)[:, None]) @ np.swapaxes(frames, 1, 2)
        return candidates[match], points, _smallest_rotations(np.asarray(normal), normals) @ shapes, colors

    def _align_heights(
        self, candidates: NDArray[np.int64], under: GridBlock, support: Support, coordinates: Array
    ) -> Array:
        """Block coordinates [A,3] moved along the support's normal to the height of known splats."""
        g = self.grid.grid_coordinates(self.splats.means[candidates].astype(np.float64)) - under.low
        (uv, height), (target_uv, target_height) = support.to_local(g), support.to_local(coordinates)
        members = np.flatnonzero(
            cKDTree(coordinates).query(g, distance_upper_bound=HEIGHT_RADIUS_VOXELS)[0] < HEIGHT_RADIUS_VOXELS
        )
        members = members[np.abs(height[members] - np.median(target_height)) < HEIGHT_RADIUS_VOXELS]
        if len(members) < MIN_FLAT_SPLATS:
            return coordinates
        _, first = np.unique(np.round(uv[members], 3), axis=0, return_index=True)
        members = members[first][:MAX_SPLINE_KNOTS]
        from scipy.interpolate import RBFInterpolator

        spline = RBFInterpolator(uv[members], height[members], neighbors=32, smoothing=1.0)
        change = np.clip(
            spline(target_uv) - target_height, -MAX_HEIGHT_CHANGE_VOXELS, MAX_HEIGHT_CHANGE_VOXELS
        )
        return np.asarray(coordinates + change[:, None] * support.normal)

    def _match_colors(self, rows: NDArray[np.int64], colors: Array) -> NDArray[np.int64]:
        """Rows [A], among `rows`, of the splats to copy.

        Copied splats are nearest in color to [A,3], with little view dependence.
        """
        check_cancelled()
        splat_log, target_log = (
            np.log(np.maximum(rgb, MIN_DIVISOR_COLOR)) for rgb in (self.mean_colors(rows), colors)
        )
        view_dependence = np.sqrt(
            (self.splats.sh[rows, 1:].astype(np.float64) ** 2).sum(axis=(1, 2)) / (4.0 * np.pi)
        )
        view_dependence /= np.maximum(self.mean_colors(rows).mean(axis=1), MIN_DIVISOR_COLOR)
        match = cKDTree(np.c_[splat_log, VIEW_DEPENDENCE_WEIGHT * view_dependence]).query(
            np.c_[target_log, np.zeros(len(target_log))]
        )[1]
        return np.asarray(match)

    def _flat_neighbors(
        self, under: GridBlock, region: Cage, inner: Cage, is_new: Mask, normal: Array
    ) -> NDArray[np.int64]:
        """Rows [M] of opaque splats beside the hole that lie flat on the inpainted surface."""
        splats = self.splats
        means = splats.means.astype(np.float64)
        is_candidate = (
            region.contains(means) & ~inner.contains(means) & (splats.opacities > MIN_COPIED_OPACITY)
        )
        rows = np.flatnonzero(is_candidate)
        g = np.round(self.grid.grid_coordinates(means[rows]) - under.low).astype(np.int64)
        g = np.clip(g, 0, np.array(is_new.shape) - 1)
        rows = rows[~is_new[tuple(g.T)]]
        axes = rotation_matrices(splats.quaternions[rows].astype(np.float64))
        shortest = np.argmin(splats.log_scales[rows], axis=1)
        is_flat = np.abs(axes[np.arange(len(rows)), :, shortest] @ normal) > MIN_FLAT_COSINE
        return rows[is_flat] if is_flat.sum() >= MIN_FLAT_SPLATS else rows

    def clone_cage(self, under: GridBlock, inner: Cage, source: Cage) -> NewSplats:
        """Copies of the splats in the source cage, with colors blended to the surroundings of V^c."""
        means = self.splats.means.astype(np.float64)
        rows = np.flatnonzero(source.contains(means))
        is_mapped, means_in_v, shapes = HexahedronMap(inner, source)(means[rows])
        rows = rows[is_mapped]
        grid_color = _interpolate_colors(under, under.field.grid_coordinates(means_in_v) - under.low)
        source_color = 0.5 + C0 * interpolate_field(self.grid, means[rows])[1][:, 0].astype(np.float64)
        colors = self.mean_colors(rows)
        is_known = np.asarray((grid_color > 0.0).all(axis=1) & (source_color > MIN_DIVISOR_COLOR).all(axis=1))
        return (
            rows,
            means_in_v,
            shapes,
            np.where(
                is_known[:, None], colors * grid_color / np.maximum(source_color, MIN_DIVISOR_COLOR), colors
            ),
        )

    def mean_colors(self, rows: NDArray[np.int64]) -> Array:
        """Colors [N,3] of splats, means over directions."""
        return np.maximum(0.5 + C0 * self.splats.sh[rows, 0].astype(np.float64), 0.0)

    def build_patch(
        self,
        field: SplatField,
        region: Cage,
        is_replaced: Mask,
        light: NewLight,
        part: NewLight | None,
        new: NewSplats,
    ) -> SplatPatch:
        """Patch with new splats; other arguments as in `SplatPatch`."""
        check_cancelled()
        rows, points, shapes, colors = new
        gains = self.gains[rows] * colors / np.maximum(self.mean_colors(rows), MIN_DIVISOR_COLOR)
        return SplatPatch(
            field,
            region,
            is_replaced,
            light,
            part,
            self.rows[rows],
            points,
            shapes @ self.turns[rows],
            np.clip(gains, *COLOR_GAIN_RANGE),
        )


def _upper_surface(block: GridBlock, is_new: Mask, up: Array) -> tuple[Array, Array]:
    """(block coordinates [A,3], unit normals [A,3]) of the upper side of the new vertices [X,Y,Z]."""
    solid = block.solid
    mask = is_new & solid & ndimage.binary_dilation(~solid)
    normals = block.normals_at(mask).astype(np.float64)
    is_upper = normals @ up > MIN_UPPER_COSINE
    vertices, normals = np.argwhere(mask)[is_upper].astype(np.float64), normals[is_upper]
    steps = np.arange(-2.0, 2.25, 0.25)
    samples = [
        ndimage.map_coordinates(block.depth, (vertices + step * normals).T, order=1, mode="nearest")
        for step in steps
    ]
    depth = np.stack(samples)
    # Place splats at the upper end of the dense layer, which continues below the surface.
    is_dense = depth >= 0.9 * np.minimum(depth.max(axis=0), depth[: len(steps) // 2 + 1].max(axis=0))
    last = len(steps) - 1 - np.argmax(is_dense[::-1], axis=0)
    coordinates = vertices + steps[last][:, None] * normals
    # Vertices above each other give the same point: keep one.
    _, first = np.unique(np.round(coordinates / 0.8).astype(np.int64), axis=0, return_index=True)
    return coordinates[first], normals[first]


def _interpolate_colors(block: GridBlock, coordinates: Array) -> Array:
    """Colors [N,3] of a block at block coordinates [N,3], weighted by density; 0 in empty space."""
    weight = np.where(block.slot >= 0, block.depth + 1e-3, 0.0)
    total = ndimage.map_coordinates(weight, coordinates.T, np.float64, order=1)
    rgb = np.zeros((len(coordinates), 3))
    for channel in range(3):
        values = np.zeros(block.shape)
        where = block.slot >= 0
        values[where] = 0.5 + C0 * block.sh[block.slot[where], 0, channel]
        rgb[:, channel] = ndimage.map_coordinates(values * weight, coordinates.T, np.float64, order=1)
    return np.maximum(rgb / np.maximum(total, 1e-6)[:, None], 0.0)


def _smallest_rotations(start: Array, end: Array) -> Array:
    """Smallest rotations [N,3,3] of unit vectors [N,3] to others, at most a right angle away."""
    axis = np.cross(start, end)
    cosine = np.einsum("ni,ni->n", start, end)
    skew = np.zeros((len(start), 3, 3))
    skew[:, [2, 0, 1], [1, 2, 0]] = axis
    skew[:, [1, 2, 0], [2, 0, 1]] = -axis
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine)[:, None, None])
