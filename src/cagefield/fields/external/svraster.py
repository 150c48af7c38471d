"""SVRaster: sparse voxels of an octree with a trilinear density and one set of harmonics each.

Notation: the octree's root is a cube of edge E around c; a voxel of level l has the edge E / 2^l. Its path
holds the octant of level k in the bits 3 (16 - k) to 3 (16 - k) + 2, octant 4 x + 2 y + z. With the values
g_0 .. g_7 at its corners, in the order of octants, and the trilinear weights N_i,

    sigma(p) = 100 e(sum_i N_i(p) g_i) per world unit,   e(x) = x for x > 1.1, else 1.1 exp(x / 1.1 - 1)
    rgb(p, d) = max(0, 1/2 + Y(d) . k)

Values belong to grid points, shared by voxels; they are numbered in lexicographic order of their integer
coordinates (x, y, z) on the lattice of level 16. Space without a voxel is empty.

Differences from the program: it takes the direction from the camera to the voxel's center for d, the field
that of the ray; it takes one to three samples in a voxel, `ray_samples` one between two planes of the finest
level.

Source: Sun et al., "Sparse Voxels Rasterization" (2025), section 3; the layout of github.com/NVlabs/svraster.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import ExternalField, frozen_array, number

if TYPE_CHECKING:
    from cagefield.fields.external.torch_field import TorchField

MAX_LEVEL = 16
"""Finest level of the octree: 65,536 voxels along an edge."""
_LATTICE_POINTS = (1 << MAX_LEVEL) + 1
"""Lattice points of level 16 along an edge."""


@dataclass(frozen=True, eq=False)
class SvrasterField(ExternalField):
    """SVRaster model (canonical space, world units).

    Attributes:
        paths: [N] int64 paths of the voxels, ascending.
        levels: [N] int8, 1 to 16.
        corners: [G] float32 values g at the grid points.
        sh: [N,K,3] float32 harmonics of each voxel, K = 1, 4, 9 or 16.
        center: [3] c. extent: E. inside: edge of the cube of interest around c, E / 2^m.

    Raises:
        FieldError: arrays that do not fit each other, voxels within others.
    """

    paths: NDArray[np.int64]
    levels: NDArray[np.int8]
    corners: NDArray[np.float32]
    sh: NDArray[np.float32]
    center: NDArray[np.float64]
    extent: float
    inside: float

    KIND: ClassVar[str] = "SvrasterField"

    def __post_init__(self) -> None:
        def fix(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        fix("paths", frozen_array("octpath", self.paths, np.int64, (None,)))
        count = len(self.paths)
        fix("levels", frozen_array("octlevel", self.levels, np.int8, (count,)))
        fix("corners", frozen_array("_geo_grid_pts", self.corners, np.float32, (None,)))
        fix("sh", frozen_array("_sh0 and _shs", self.sh, np.float32, (count, None, 3)))
        if self.sh.shape[1] not in (1, 4, 9, 16):
            raise FieldError(f"a voxel has {self.sh.shape[1]} harmonics; expected 1, 4, 9 or 16")
        fix("center", frozen_array("scene_center", self.center, np.float64, (3,)))
        fix("extent", number("scene_extent", self.extent, 1e-9, 1e9))
        fix("inside", number("inside_extent", self.inside, self.extent / 2**MAX_LEVEL, self.extent))
        self._check_voxels()
        if len(self.corners) != (points := int(self.voxel_corners.max()) + 1):
            raise FieldError(
                f"_geo_grid_pts has {len(self.corners)} values, the voxels have {points} corners; the file "
                "may be damaged"
            )

    def _check_voxels(self) -> None:
        if self.levels.min() < 1 or self.levels.max() > MAX_LEVEL:
            raise FieldError(
                f"octlevel must be 1 to {MAX_LEVEL}, got {self.levels.min()} to {self.levels.max()}"
            )
        spans = self.spans
        if self.paths[0] < 0 or self.paths[-1] >= 1 << (3 * MAX_LEVEL) or (self.paths % spans != 0).any():
            raise FieldError("octpath and octlevel do not fit each other; the file may be damaged")
        if (np.diff(self.paths) < spans[:-1]).any():
            raise FieldError("octpath has voxels within others, or out of order; the file may be damaged")

    @property
    def spans(self) -> NDArray[np.int64]:
        """Number [N] of paths of level 16 in each voxel."""
        return np.int64(1) << (3 * (MAX_LEVEL - self.levels.astype(np.int64)))

    @cached_property
    def voxel_corners(self) -> NDArray[np.int64]:
        """Grid point [N,8] of each voxel's corners, in the order of octants."""
        low = path_coordinates(self.paths)
        edges = np.int64(1) << (MAX_LEVEL - self.levels.astype(np.int64))
        octants = np.array(list(np.ndindex(2, 2, 2)), np.int64)
        at = low[:, None] + edges[:, None, None] * octants
        keys = (at[..., 0] * _LATTICE_POINTS + at[..., 1]) * _LATTICE_POINTS + at[..., 2]
        return np.unique(keys, return_inverse=True)[1].reshape(keys.shape).astype(np.int64)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Corners [2,3] of the cube of interest."""
        return np.stack([self.center - 0.5 * self.inside, self.center + 0.5 * self.inside])

    @property
    def unbounded(self) -> bool:  # type: ignore[override]
        """Whether voxels lie around the cube of interest."""
        return self.extent > 1.5 * self.inside

    def describe(self) -> str:
        """Voxels, levels and harmonics."""
        degree = round(self.sh.shape[1] ** 0.5) - 1
        low, high = int(self.levels.min()), int(self.levels.max())
        levels = f"the levels {low} to {high}" if low < high else f"level {low}"
        return f"SVRaster: {len(self.paths)} voxels of {levels}, SH degree {degree}"

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Voxels and values by name."""
        names = ("paths", "levels", "corners", "sh", "center")
        return {name: getattr(self, name) for name in names}

    def options(self) -> dict[str, Any]:
        """Edges of the two cubes."""
        return {"extent": self.extent, "inside": self.inside}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Any]) -> SvrasterField:
        """Field of the values of `arrays` and `options`. Raises FieldError where they do not fit."""
        names = ("paths", "levels", "corners", "sh", "center")
        if missing := [name for name in names if name not in arrays]:
            raise FieldError(f"tensor missing: {missing[0]}")
        paths, levels, corners, sh, center = (arrays[name] for name in names)
        return cls(paths, levels, corners, sh, center, options["extent"], options["inside"])

    def _torch_field(self) -> TorchField:
        from cagefield.fields.external.svraster_torch import TorchSvraster

        return TorchSvraster(
            self.paths,
            self.spans,
            self.levels,
            self.corners[self.voxel_corners],
            self.sh,
            self.center,
            (self.extent, self.inside),
        )


def path_coordinates(paths: NDArray[np.int64]) -> NDArray[np.int64]:
    """Coordinates [N,3] of the lowest corners of paths [N], on the lattice of level 16."""
    found = np.zeros((len(paths), 3), np.int64)
    for bit in range(MAX_LEVEL):
        for axis in range(3):
            found[:, axis] |= (paths >> (3 * bit + 2 - axis) & 1) << bit
    return found
