"""Meshes of voxel fields: marching cubes on the density, with colors of the field's harmonics.

The surface is the level set sigma = ln 2 / edge, where a voxel absorbs half of the light. Each vertex has the
density's normal, and the field's color along the normal, seen from outside.

Source: Lewiner et al., "Efficient Implementation of Marching Cubes' Cases with Topological Guarantees"
(2003), implemented by scikit-image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Float32

SURFACE_OPTICAL_DEPTH = float(np.log(2.0))
"""Optical depth of a voxel at the surface."""

BLOCK_VERTICES = 1 << 18
"""Number of vertices colored at a time."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangle mesh in world units.

    positions [V,3] float32; normals [V,3] float32, unit, outward; rgb [V,3] float32 in [0,1];
    faces [F,3] int32, counter-clockwise seen from outside.
    """

    positions: Float32
    normals: Float32
    rgb: Float32
    faces: NDArray[np.int32]

    def select_vertices(self, mask: NDArray[np.bool_]) -> Mesh:
        """Mesh of the faces whose vertices are all in `mask` [V]."""
        faces = self.faces[mask[self.faces].all(axis=1)]
        used = np.unique(faces)
        number = np.zeros(len(self.positions), np.int32)
        number[used] = np.arange(len(used), dtype=np.int32)
        return Mesh(self.positions[used], self.normals[used], self.rgb[used], number[faces])


def extract_mesh(field: VoxelField, level: float | None = None) -> Mesh:
    """Level set of the field's density at `level` per world unit; None takes ln 2 / edge.

    Raises:
        FieldError: scikit-image is missing, or a contracted field, or one without a surface.
    """
    try:
        from skimage.measure import marching_cubes
    except ImportError as error:
        raise FieldError(
            "a mesh needs scikit-image, which is not installed; pip install 'cagefield[mesh]'"
        ) from error
    if field.contracted:
        raise FieldError("a contracted field is no even grid; bake its box of interest first")
    edges = field.voxel_size
    level = SURFACE_OPTICAL_DEPTH / float(edges.min()) if level is None else level
    # A border of empty vertices closes the surface at the grid's sides.
    density = np.zeros(tuple(n + 2 for n in field.resolution), np.float32)
    i, j, k = np.unravel_index(field.vertices, field.resolution)
    density[i + 1, j + 1, k + 1] = field.density
    if not float(density.max()) > level:
        raise FieldError(f"the field has no surface: its density is {density.max():.3g} at most")
    vertices, faces, normals, _ = marching_cubes(  # type: ignore[no-untyped-call]
        density, level, spacing=tuple(edges), gradient_direction="descent", allow_degenerate=False
    )
    positions = (vertices - edges + field.grid_bounds[0]).astype(np.float32)
    normals = np.ascontiguousarray(normals, np.float32)
    rgb = np.empty_like(positions)
    for start in range(0, len(positions), BLOCK_VERTICES):
        rows = slice(start, start + BLOCK_VERTICES)
        rgb[rows] = field(positions[rows], -normals[rows])[1]
    # The faces of scikit-image have the opposite orientation.
    return Mesh(positions, normals, rgb, np.ascontiguousarray(faces[:, ::-1], np.int32))
