"""Patches: content that a discrete edit shows in place of the field.

A patch belongs to an edit and to the field that it was made for (`cagefield.completion`); it is no part of an
edit file. It is read in deformed space of the edits before its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32, Mask


@dataclass(frozen=True, eq=False)
class Patch:
    """Layers (`fields.voxel_layers`) of the field that an edit was made for.

    Attributes:
        region: outside of V, samples in this cage read `under`; it holds V^c.
        under: content of the region without that of V^c: filled, and in its new light.
        part: content of V, at its place in V^c; None where it is the field itself.
    """

    region: Cage
    under: VoxelField
    part: VoxelField | None = None

    @property
    def read_instead(self) -> Cage | None:
        """Where, outside of V, layers are read and not the field."""
        return self.region


@dataclass(frozen=True, eq=False)
class NewLight:
    """Log ratio of new light to old at the vertices of a grid, values [X,Y,Z].

    Vertex (0, 0, 0) lies at `origin` [3], the next ones `spacing` [3] apart, world units; `known` [X,Y,Z] are
    those with a value.
    """

    origin: Array
    spacing: Array
    values: Float32
    known: Float32

    def at(self, points: Array) -> Array:
        """The log of the ratio [N] at points [N,3]: that of the known vertices around, 0 where none is."""
        g = ((points - self.origin) / self.spacing).T
        total = ndimage.map_coordinates(self.known, g, np.float64, order=1)
        values = ndimage.map_coordinates(self.values * self.known, g, np.float64, order=1)
        return np.asarray(np.where(total > 1e-3, values / np.maximum(total, 1e-3), 0.0))


@dataclass(frozen=True, eq=False)
class SplatPatch:
    """Infill and new light of a discrete edit of splats.

    Attributes:
        field: the field whose splats the new ones are copies of.
        region: outside of this cage and of V nothing changes.
        gone: [X,Y,Z], vertices of `light`'s grid around which splats outside of V^c are taken away.
        light: that of splats outside of V^c.
        part: that of the content of V^c, None where it stays.
        sources: [A] int64, rows of the field of the new splats; points: [A,3] where they are; jacobian:
            [A,3,3], factor of their shapes, d(deformed)/d(canonical); gains: [A,3], factors of their
            red, green and blue.
    """

    field: SplatField
    region: Cage
    gone: Mask
    light: NewLight
    part: NewLight | None
    sources: NDArray[np.int64]
    points: Array
    jacobian: Array
    gains: Array

    @property
    def read_instead(self) -> Cage | None:
        """None: splats have no layers."""
        return None

    @property
    def is_light_alone(self) -> bool:
        """Whether no splat is taken away and none is new."""
        return not len(self.sources) and not self.gone.any()

    def takes_away(self, points: Array) -> Mask:
        """[N], True for points [N,3] whose splats go."""
        if not self.gone.any():
            return np.zeros(len(points), bool)
        g = np.round((points - self.light.origin) / self.light.spacing).astype(np.int64)
        inside = ((g >= 0) & (g < self.gone.shape)).all(axis=1)
        g[~inside] = 0
        return np.asarray(self.gone[tuple(g.T)] & inside)


@dataclass(frozen=True, eq=False)
class Pasted:
    """Content of a paste (`edits.Paste`) in the field that it was made for.

    Attributes:
        part: of voxels, a layer, which has in `place` the content of V^c in the other scene; place: a cage in
            the field's grid.
        splats: of splats, those in V^c, in the other scene's space.
    """

    part: VoxelField | None = None
    place: Cage | None = None
    splats: SplatField | None = None
