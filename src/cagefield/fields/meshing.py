"""Surfaces of voxel fields as meshes: marching cubes on the density, coloured by the field's harmonics.

The surface is where a voxel takes half of the light: sigma = ln 2 / edge. Each vertex has the normal of the
density there and the colour that the field shows along it, seen from outside.

Source: Lewiner et al., "Efficient Implementation of Marching Cubes' Cases with Topological Guarantees"
(2003), as scikit-image has it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Float32

HALF = float(np.log(2.0))
"""Optical depth of a voxel that the surface goes through."""

BLOCK = 1 << 18
"""Vertices that are coloured at a time."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in world units.

    positions [V,3] float32; normals [V,3] float32, unit, outwards; rgb [V,3] float32 in [0,1];
    faces [F,3] int32, counter-clockwise seen from outside.
    """

    positions: Float32
    normals: Float32
    rgb: Float32
    faces: NDArray[np.int32]

    def kept(self, mask: NDArray[np.bool_]) -> Mesh:
        """The faces whose vertices are all kept [V], and their vertices."""
        faces = self.faces[mask[self.faces].all(axis=1)]
        used = np.unique(faces)
        number = np.zeros(len(self.positions), np.int32)
        number[used] = np.arange(len(used), dtype=np.int32)
        return Mesh(self.positions[used], self.normals[used], self.rgb[used], number[faces])


def mesh_of(field: VoxelField, level: float | None = None) -> Mesh:
    """The field's surface where its density is `level`, per world unit; see the module where left out.

    Raises:
        FieldError: scikit-image is not installed, a contracted field, one without a surface.
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
    level = HALF / float(edges.min()) if level is None else level
    # A frame of empty vertices closes what the grid's sides cut.
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
    for start in range(0, len(positions), BLOCK):
        rows = slice(start, start + BLOCK)
        rgb[rows] = field(positions[rows], -normals[rows])[1]
    # Its faces turn the other way.
    return Mesh(positions, normals, rgb, np.ascontiguousarray(faces[:, ::-1], np.int32))
