"""Sparse voxel grid of density and spherical-harmonic color.

Notation: a grid of nx x ny x nz *vertices* spans `bounds`; vertex (i, j, k) has the linear index
(i*ny + j)*nz + k. Only M vertices are stored; the others are empty (density 0, color 0.5 gray). Between
vertices, density and color coefficients are interpolated trilinearly:

    sigma(p) = max(0, sum_v b_v(p) density_v)
    rgb(p, d) = clip(0.5 + sum_l Y_l(d) sum_v b_v(p) sh_v,l , 0, 1)

With `contracted`, `bounds` is the box of interest and the grid spans the contracted cube (-2, 2)^3 of
`cagefield.fields.contraction`, hence all of space.

This module is the readable float64 reference. `cagefield.rendering.voxels.kernels.march` is the fused
version.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.fields.contraction import contract
from cagefield.fields.field_files import read_tensors, write_tensors

_MAX_DENSE_VERTICES, _MAX_VERTICES_PER_STORED = 1 << 27, 1000
"""Vertices of a grid without minimum occupancy (512^3), and maximum per stored vertex beyond."""
FORMAT_VERSION = "1"


@dataclass(frozen=True, eq=False)
class VoxelField:
    """Sparse voxel grid of density and SH color over `bounds` (canonical space, world units).

    Attributes:
        bounds: [2,3] float64, lower and upper corner; the box of interest when `contracted`.
        resolution: (nx, ny, nz) vertices along each axis, at least 2 each.
        vertices: [M] int64, strictly increasing linear indices of the stored vertices.
        density: [M] float32, per world unit; may be negative, clamped at 0 after the interpolation.
        sh: [M, (degree+1)^2, 3] float32 color coefficients.
        contracted: True for an unbounded scene.

    Raises:
        FieldError: mismatching shapes, indices out of range or order, NaN or infinity.
    """

    bounds: NDArray[np.float64]
    resolution: tuple[int, int, int]
    vertices: NDArray[np.int64]
    density: NDArray[np.float32]
    sh: NDArray[np.float32]
    contracted: bool = False

    def __post_init__(self) -> None:
        fix = object.__setattr__
        fix(self, "bounds", _frozen(self.bounds, np.float64))
        fix(self, "resolution", tuple(int(n) for n in self.resolution))
        fix(self, "vertices", _frozen(self.vertices, np.int64))
        fix(self, "density", _frozen(self.density, np.float32))
        fix(self, "sh", _frozen(self.sh, np.float32))
        self._validate()

    def _validate(self) -> None:
        if self.bounds.shape != (2, 3) or not np.isfinite(self.bounds).all():
            raise FieldError(f"bounds must be 2 finite corners [2,3], got shape {self.bounds.shape}")
        if not (self.bounds[1] > self.bounds[0]).all():
            raise FieldError(f"bounds must have lower < upper on every axis, got {self.bounds.tolist()}")
        if len(self.resolution) != 3 or min(self.resolution) < 2 or max(self.resolution) > 2048:
            raise FieldError(f"resolution must be 3 numbers from 2 to 2048, got {self.resolution}")
        count = len(self.vertices)
        if self.vertices.ndim != 1 or self.density.shape != (count,):
            raise FieldError(
                f"vertices and density must be [M], got {self.vertices.shape} and {self.density.shape}"
            )
        if (
            self.sh.ndim != 3
            or self.sh.shape[0] != count
            or self.sh.shape[1] not in (1, 4, 9)
            or self.sh.shape[2] != 3
        ):
            raise FieldError(f"sh must be [{count}, 1|4|9, 3] (degree 0 to 2), got {self.sh.shape}")
        total = int(np.prod(self.resolution))
        if count and (
            self.vertices[0] < 0 or self.vertices[-1] >= total or (np.diff(self.vertices) <= 0).any()
        ):
            raise FieldError(f"vertices must be strictly increasing and within [0, {total})")
        for name, values in (("density", self.density), ("sh", self.sh)):
            if not np.isfinite(values).all():
                bad = int(np.argwhere(~np.isfinite(values.reshape(count, -1)).all(axis=1))[0, 0])
                raise FieldError(
                    f"{name} must be finite, vertex {bad} of {count} is not; train or bake the field again"
                )

    @property
    def sh_degree(self) -> int:
        """Degree of the color's spherical harmonics, 0 to 2."""
        return {1: 0, 4: 1, 9: 2}[self.sh.shape[1]]

    @property
    def grid_bounds(self) -> NDArray[np.float64]:
        """Corners [2,3] of the vertex grid: world units, or contracted units when `contracted`."""
        if self.contracted:
            return np.array([[-2.0] * 3, [2.0] * 3])
        return self.bounds

    @property
    def voxel_size(self) -> NDArray[np.float64]:
        """Edge lengths [3] of a voxel: world units (inside the box of interest when `contracted`)."""
        size = (self.grid_bounds[1] - self.grid_bounds[0]) / (np.array(self.resolution) - 1)
        return size * self.half_size if self.contracted else size

    @property
    def sample_spacing(self) -> float:
        """World length between samples that resolve all detail: the smallest edge of a voxel."""
        return float(min(self.voxel_size))

    @property
    def unbounded(self) -> bool:
        """Whether the field extends beyond `bounds`, its box of interest."""
        return self.contracted

    @property
    def center(self) -> NDArray[np.float64]:
        """Center [3] of `bounds`."""
        return np.asarray(self.bounds.mean(axis=0))

    @property
    def half_size(self) -> NDArray[np.float64]:
        """Half of the edge lengths [3] of `bounds`."""
        return np.asarray((self.bounds[1] - self.bounds[0]) / 2)

    def grid_coordinates(self, positions: ArrayLike) -> NDArray[np.float64]:
        """Positions [N,3] in units of vertices: 0 at the first vertex, resolution - 1 at the last."""
        points: NDArray[np.float64] = np.asarray(positions, dtype=np.float64)
        if self.contracted:
            points = np.asarray(contract((points - self.center) / self.half_size), np.float64)
        lower, upper = self.grid_bounds
        return np.asarray((points - lower) / (upper - lower) * (np.array(self.resolution) - 1))

    def __call__(
        self, positions: ArrayLike, viewdirs: ArrayLike
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(sigma [N] per world unit, rgb [N,3]) at canonical positions [N,3] along unit viewdirs [N,3].

        Sigma is 0 outside the grid.
        """
        g = self.grid_coordinates(positions)
        n = np.array(self.resolution)
        inside = ((g >= 0) & (g <= n - 1)).all(axis=1)
        base = np.clip(np.floor(g).astype(np.int64), 0, n - 2)
        frac = g - base
        basis = spherical_harmonics.sh_basis(np.asarray(viewdirs), self.sh_degree)
        raw, color = np.zeros(len(g)), np.full((len(g), 3), 0.5)
        for corner in range(8):
            offset = (corner & 1, corner >> 1 & 1, corner >> 2 & 1)
            slot, stored = self.lookup(base + offset)
            rows = np.flatnonzero(stored)
            slot = slot[rows]
            x, y, z = (frac[rows, k] if offset[k] else 1.0 - frac[rows, k] for k in range(3))
            weight = x * y * z
            raw[rows] += weight * self.density[slot]
            color[rows] += weight[:, None] * np.einsum("nl,nlc->nc", basis[rows], self.sh[slot])
        rgb = np.clip(color, 0, 1)
        sigma = np.where(inside, np.maximum(raw, 0), 0)
        return sigma.astype(np.float32), rgb.astype(np.float32)

    def lookup(self, vertex: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """(slot [N], stored [N]) of grid vertices [N,3]; slot is 0 where the vertex is not stored."""
        if len(self.vertices) == 0:
            raise FieldError("the field is empty: it stores no vertex; train it longer or prune less")
        _, ny, nz = self.resolution
        linear = (vertex[:, 0] * ny + vertex[:, 1]) * nz + vertex[:, 2]
        slot = np.minimum(np.searchsorted(self.vertices, linear), len(self.vertices) - 1)
        stored = self.vertices[slot] == linear
        return np.where(stored, slot, 0), stored

    def take(self, rows: NDArray[Any]) -> VoxelField:
        """Field with the vertices of the given rows or mask."""
        return VoxelField(
            self.bounds,
            self.resolution,
            self.vertices[rows],
            self.density[rows],
            self.sh[rows],
            self.contracted,
        )

    def save(self, path: str | Path) -> None:
        """Write the field to a safetensors file (float32); the folder must exist."""
        tensors = {
            "bounds": self.bounds,
            "resolution": np.array(self.resolution, dtype=np.int64),
            "vertices": self.vertices,
            "density": self.density,
            "sh": self.sh,
        }
        metadata = {"kind": "VoxelField", "version": FORMAT_VERSION, "contracted": str(int(self.contracted))}
        write_tensors(path, tensors, metadata)

    @classmethod
    def load(cls, path: str | Path) -> VoxelField:
        """VoxelField of a safetensors file.

        Raises:
            FieldError: the file is missing, truncated, of another kind or a newer version.
        """
        cure = "train one with `cagefield train DATA -o SCENE`"
        metadata, tensors = read_tensors(path, "VoxelField", FORMAT_VERSION, cure)
        missing = {"bounds", "resolution", "vertices", "density", "sh"} - tensors.keys()
        if missing:
            raise FieldError(f"{path}: tensors missing: {', '.join(sorted(missing))}")
        try:
            resolution = tuple(int(n) for n in tensors["resolution"].reshape(-1).tolist())
            _check_grid(resolution, len(np.atleast_1d(tensors["vertices"])))
            return cls(
                bounds=tensors["bounds"],
                resolution=resolution,  # type: ignore[arg-type]
                vertices=tensors["vertices"],
                density=tensors["density"],
                sh=tensors["sh"],
                contracted=metadata.get("contracted") == "1",
            )
        except FieldError as error:
            raise FieldError(f"{path}: {error}") from error
        except (TypeError, ValueError, OverflowError) as error:
            raise FieldError(f"{path}: damaged tensors ({error}); write the field again") from error


def _check_grid(resolution: tuple[int, ...], stored: int) -> None:
    """Refuse a large grid of which the file stores next to nothing."""
    total = math.prod(resolution)
    if total > max(_MAX_DENSE_VERTICES, _MAX_VERTICES_PER_STORED * stored):
        raise FieldError(
            f"a grid of {' x '.join(map(str, resolution))} would take {4 * total / 1e9:.1f} GB for {stored} "
            f"stored vertices; a file has one in {_MAX_VERTICES_PER_STORED} or more, "
            "bake it with a lower resolution"
        )


def _frozen(values: ArrayLike, dtype: Any) -> NDArray[Any]:
    array = np.array(values, dtype=dtype, order="C")
    array.setflags(write=False)
    return array
