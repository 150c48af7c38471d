"""New splats where a voxel grid of others was filled.

What was filled has surfaces, ridges of density, on which new splats are laid a voxel apart: each is a copy of
a splat beside the hole that lies on a surface and is of that colour, turned to the ridge's normal and made a
voxel wide, with its colour multiplied so that it is that of the grid. What a cloned cage brings are copies of
its own splats.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from cagefield.completion.surfaces.footprint import MAX_SPLINE_KNOTS
from cagefield.completion.surfaces.grid_block import GridBlock, interpolate_field, world_positions
from cagefield.completion.surfaces.support_plane import Support
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
"""Standard deviation along the surface of a splat that fills, voxels."""

MAX_THICKNESS_VOXELS = 0.35
"""Most of it across the surface, voxels."""

MIN_FLAT_COSINE = 0.8
"""Least cosine between the axis of a splat that lies flat and the surface's normal."""

MIN_UPPER_COSINE = 0.3
"""Least cosine between the normals of what was filled and of the support."""

MIN_FLAT_SPLATS = 8
"""Splats that lie flat, from which on others are not copied."""

HEIGHT_RADIUS_VOXELS = 12.0
"""Radius around the new splats in which known splats give the height of the surface, voxels."""

MAX_HEIGHT_CHANGE_VOXELS = 1.0
"""Maximum change of height of a new splat, voxels."""

VIEW_DEPENDENCE_WEIGHT = 1.0
"""How much a copied splat's dependence on the view counts, over what its colour is off (log)."""

MIN_DIVISOR_COLOR = 0.02
"""Colours that are darker than this count as this where they divide."""

MIN_COPIED_OPACITY = 0.6
"""Opacity of splats that are copied to fill, at least."""

COLOR_GAIN_RANGE = (0.1, 10.0)
"""What colours are multiplied by, at least and at most."""


NewSplats: TypeAlias = tuple[NDArray[np.int64], Array, Array, Array]
"""New splats: rows [A] of those that they are copies of, where they are [A,3], what their shapes are
multiplied by [A,3,3], and what their colours are [A,3]."""

NO_SPLATS: NewSplats = (np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))


@dataclass(frozen=True, eq=False)
class KnownSplats:
    """The splats [N] that the edits below make of a field, and the grid that they are on.

    rows [N]: those of the field that they are from; turns [N,3,3] and gains [N,3]: what their shapes and
    colours were multiplied by.
    """

    splats: SplatField
    grid: VoxelField
    rows: NDArray[np.int64]
    turns: Array
    gains: Array

    @classmethod
    def of(cls, field: SplatField, splats: SplatField, grid: VoxelField, moved: MovedSplats) -> KnownSplats:
        still = np.flatnonzero(~moved.left)
        gains = np.ones((len(moved.source), 3)) if moved.gains is None else moved.gains
        return cls(
            splats,
            grid,
            np.concatenate([still, moved.source]),
            np.concatenate([np.broadcast_to(np.eye(3), (len(still), 3, 3)), moved.jacobian]),
            np.concatenate([np.ones((len(still), 3)), gains]),
        )

    def filled(self, under: GridBlock, fresh: Mask, region: Cage, inner: Cage, support: Support) -> NewSplats:
        """Splats on the surface of what was filled, the support's upper side: `fresh` [X,Y,Z] of a block."""
        at, normals = _upper_surface(under, fresh, support.normal)
        kept = self._beside(under, region, inner, fresh, support.normal)
        if not len(at) or not len(kept):
            return NO_SPLATS
        at = self._levelled(kept, under, support, at)
        points = world_positions(under.field, at + under.low)
        frames = rotation_matrices(self.splats.quaternions[kept].astype(np.float64))
        scales = np.exp(self.splats.log_scales[kept].astype(np.float64))
        colours = _interpolate_colors(under, at)
        nearest = self._alike(kept, colours)
        frames, scales = frames[nearest], scales[nearest]
        each, thin = np.arange(len(at)), np.argmin(scales, axis=1)
        across = frames[each, :, thin]
        across = across * np.where(np.einsum("ni,ni->n", across, normals) < 0.0, -1.0, 1.0)[:, None]
        voxel = float(under.field.voxel_size.max())
        wanted = np.full(scales.shape, SPLAT_WIDTH_VOXELS * voxel)
        wanted[each, thin] = np.minimum(scales[each, thin], MAX_THICKNESS_VOXELS * voxel)
        shapes = (frames * (wanted / scales)[:, None]) @ np.swapaxes(frames, 1, 2)
        return kept[nearest], points, _smallest_rotations(np.asarray(across), normals) @ shapes, colours

    def _levelled(self, kept: NDArray[np.int64], under: GridBlock, support: Support, at: Array) -> Array:
        """Block coordinates [A,3] taken, by OFF at most, to where some splats' surface goes on."""
        g = self.grid.grid_coordinates(self.splats.means[kept].astype(np.float64)) - under.low
        (uv, height), (to, now) = support.local(g), support.local(at)
        members = np.flatnonzero(
            cKDTree(at).query(g, distance_upper_bound=HEIGHT_RADIUS_VOXELS)[0] < HEIGHT_RADIUS_VOXELS
        )
        members = members[np.abs(height[members] - np.median(now)) < HEIGHT_RADIUS_VOXELS]
        if len(members) < MIN_FLAT_SPLATS:
            return at
        _, first = np.unique(np.round(uv[members], 3), axis=0, return_index=True)
        members = members[first][:MAX_SPLINE_KNOTS]
        spline = RBFInterpolator(uv[members], height[members], neighbors=32, smoothing=1.0)
        off = np.clip(spline(to) - now, -MAX_HEIGHT_CHANGE_VOXELS, MAX_HEIGHT_CHANGE_VOXELS)
        return np.asarray(at + off[:, None] * support.normal)

    def _alike(self, kept: NDArray[np.int64], colours: Array) -> NDArray[np.int64]:
        """Which [A] of some splats to copy: those of colours nearest to [A,3], and the same all around.

        Where they are and how they lie makes no difference to copies.
        """
        own, wanted = (np.log(np.maximum(rgb, MIN_DIVISOR_COLOR)) for rgb in (self.colours(kept), colours))
        turning = np.sqrt((self.splats.sh[kept, 1:].astype(np.float64) ** 2).sum(axis=(1, 2)) / (4.0 * np.pi))
        turning /= np.maximum(self.colours(kept).mean(axis=1), MIN_DIVISOR_COLOR)
        near = cKDTree(np.c_[own, VIEW_DEPENDENCE_WEIGHT * turning]).query(
            np.c_[wanted, np.zeros(len(wanted))]
        )[1]
        return np.asarray(near)

    def _beside(
        self, under: GridBlock, region: Cage, inner: Cage, fresh: Mask, normal: Array
    ) -> NDArray[np.int64]:
        """Splats beside the hole that lie flat on what it was filled with."""
        splats = self.splats
        means = splats.means.astype(np.float64)
        found = region.contains(means) & ~inner.contains(means) & (splats.opacities > MIN_COPIED_OPACITY)
        kept = np.flatnonzero(found)
        g = np.round(self.grid.grid_coordinates(means[kept]) - under.low).astype(np.int64)
        g = np.clip(g, 0, np.array(fresh.shape) - 1)
        kept = kept[~fresh[tuple(g.T)]]
        axes = rotation_matrices(splats.quaternions[kept].astype(np.float64))
        thin = np.argmin(splats.log_scales[kept], axis=1)
        flat = np.abs(axes[np.arange(len(kept)), :, thin] @ normal) > MIN_FLAT_COSINE
        return kept[flat] if flat.sum() >= MIN_FLAT_SPLATS else kept

    def cloned(self, under: GridBlock, inner: Cage, source: Cage) -> NewSplats:
        """Copies of the splats of the source cage, in colours that go with V^c's surroundings."""
        means = self.splats.means.astype(np.float64)
        rows = np.flatnonzero(source.contains(means))
        within, there, shapes = HexahedronMap(inner, source)(means[rows])
        rows = rows[within]
        now = _interpolate_colors(under, under.field.grid_coordinates(there) - under.low)
        before = 0.5 + C0 * interpolate_field(self.grid, means[rows])[1][:, 0].astype(np.float64)
        own = self.colours(rows)
        known = np.asarray((now > 0.0).all(axis=1) & (before > MIN_DIVISOR_COLOR).all(axis=1))
        return (
            rows,
            there,
            shapes,
            np.where(known[:, None], own * now / np.maximum(before, MIN_DIVISOR_COLOR), own),
        )

    def colours(self, rows: NDArray[np.int64]) -> Array:
        """Colours [N,3] of splats, the mean over directions."""
        return np.maximum(0.5 + C0 * self.splats.sh[rows, 0].astype(np.float64), 0.0)

    def patch(
        self,
        field: SplatField,
        region: Cage,
        gone: Mask,
        light: NewLight,
        part: NewLight | None,
        new: NewSplats,
    ) -> SplatPatch:
        """The patch with new splats of the field's edit; its other arguments are the patch's."""
        rows, points, shapes, colours = new
        gains = self.gains[rows] * colours / np.maximum(self.colours(rows), MIN_DIVISOR_COLOR)
        return SplatPatch(
            field,
            region,
            gone,
            light,
            part,
            self.rows[rows],
            points,
            shapes @ self.turns[rows],
            np.clip(gains, *COLOR_GAIN_RANGE),
        )


def _upper_surface(block: GridBlock, fresh: Mask, up: Array) -> tuple[Array, Array]:
    """(block coordinates [A,3], unit normals [A,3]) of the upper side of what is fresh [X,Y,Z]."""
    solid = block.solid
    found = fresh & solid & ndimage.binary_dilation(~solid) & (block.normals @ up > MIN_UPPER_COSINE)
    vertices, normals = np.argwhere(found).astype(np.float64), block.normals[found].astype(np.float64)
    steps = np.arange(-2.0, 2.25, 0.25)
    along = [
        ndimage.map_coordinates(block.depth, (vertices + step * normals).T, order=1, mode="nearest")
        for step in steps
    ]
    depth = np.stack(along)
    # Splats lie where the surface is densest, which goes on below as if it were solid.
    dense = depth >= 0.9 * np.minimum(depth.max(axis=0), depth[: len(steps) // 2 + 1].max(axis=0))
    last = len(steps) - 1 - np.argmax(dense[::-1], axis=0)
    at = vertices + steps[last][:, None] * normals
    # Vertices above each other lead to the same point.
    _, first = np.unique(np.round(at / 0.8).astype(np.int64), axis=0, return_index=True)
    return at[first], normals[first]


def _interpolate_colors(block: GridBlock, at: Array) -> Array:
    """Colours [N,3] of a block at block coordinates [N,3], of what is dense there; 0 where nothing is."""
    weight = np.where(block.slot >= 0, block.depth + 1e-3, 0.0)
    total = ndimage.map_coordinates(weight, at.T, np.float64, order=1)
    rgb = np.zeros((len(at), 3))
    for channel in range(3):
        values = np.zeros(block.shape)
        where = block.slot >= 0
        values[where] = 0.5 + C0 * block.sh[block.slot[where], 0, channel]
        rgb[:, channel] = ndimage.map_coordinates(values * weight, at.T, np.float64, order=1)
    return np.maximum(rgb / np.maximum(total, 1e-6)[:, None], 0.0)


def _smallest_rotations(start: Array, end: Array) -> Array:
    """The smallest rotations [N,3,3] that take unit vectors [N,3] to others, at most a right angle away."""
    axis = np.cross(start, end)
    cosine = np.einsum("ni,ni->n", start, end)
    skew = np.zeros((len(start), 3, 3))
    skew[:, [2, 0, 1], [1, 2, 0]] = axis
    skew[:, [1, 2, 0], [2, 0, 1]] = -axis
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine)[:, None, None])
