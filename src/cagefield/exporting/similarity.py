"""Splats, meshes and points under a similarity: aligned with the world, or as the reconstruction had them.

Notation: a scene's `source_to_world` is x' = M x + t, M a similarity's matrix (rotation times scale, perhaps
mirrored); its inverse leads to the coordinates of the reconstruction that the cameras came from. A scene's
`alignment` leads to meters and to an axis that is up. Both are applied in float64. The distance of the result
from the origin, too large for float32, becomes an offset.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import CagefieldError
from cagefield.fields.meshing import Mesh
from cagefield.fields.splat_field import NO_OFFSET, Offset, SplatField
from cagefield.formats.splats.splat_table import SplatBatch
from cagefield.formats.splats.transform import transform_splats
from cagefield.scene.scene import Scene

if TYPE_CHECKING:
    from cagefield.training.splats.fit_splats import SurfacePoints

FloatArray = NDArray[np.float64]

MAX_DISTANCE = 1000.0
"""Distance of a shape's middle from the origin, over its size, from which on it gets an offset."""

MAX_STRETCH = 1e-3
"""Difference of the axes' scales, as a share, that a similarity may have by rounding."""


def world_to_source(scene: Scene) -> FloatArray:
    """The similarity [4,4] from the scene's coordinates, without its offset, to the reconstruction's.

    Raises CagefieldError where the scene's `source_to_world` is no similarity.
    """
    matrix = scene.source_to_world
    if np.array_equal(matrix, np.eye(4)):
        back = np.eye(4)
        back[:3, 3] = scene.offset
        return back
    stretch = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if stretch[0] - stretch[2] > MAX_STRETCH * stretch[0]:
        raise CagefieldError(
            f"the scene's source_to_world scales axes by {stretch[0]:.4g} to {stretch[2]:.4g}, which is no "
            "similarity; leave out --source-coordinates"
        )
    return np.asarray(np.linalg.inv(matrix), np.float64)


def world_to_aligned(scene: Scene) -> FloatArray:
    """The similarity [4,4] from the scene's coordinates, without its offset, to aligned ones."""
    matrix = scene.alignment.matrix
    matrix[:3, 3] = matrix[:3, :3] @ np.array(scene.offset)
    return matrix


def aligned_splats(splats: SplatField, scene: Scene) -> SplatField:
    """Splats of a scene in aligned coordinates, as their offset is; themselves without alignment."""
    if not scene.alignment:
        return splats
    matrix = scene.alignment.matrix
    means, found = _transformed(splats, matrix)
    x, y, z = (matrix[:3, :3] @ np.array(splats.offset) + 0.0).tolist()
    return replace(found, means=means.astype(np.float32), offset=(x, y, z))


def transform_field(splats: SplatField, back: FloatArray) -> SplatField:
    """The splats under a similarity [4,4]: means moved, scales scaled, harmonics turned.

    The field's own offset is left out of it: `back` has it.
    """
    means, found = _transformed(splats, back)
    means, offset = _near_origin(means)
    return replace(found, means=means.astype(np.float32), bounds=found.bounds - offset, offset=offset)


def _transformed(splats: SplatField, matrix: FloatArray) -> tuple[FloatArray, SplatField]:
    """(means [N,3] under a similarity [4,4], splats with all but their means and offset under it)."""
    batch = SplatBatch(splats.means, splats.log_scales, splats.quaternions, splats.opacities, splats.sh)
    found = transform_splats(batch, matrix)
    field = replace(
        splats,
        log_scales=found.log_scales.astype(np.float32),
        quaternions=found.quaternions.astype(np.float32),
        sh=found.sh,
        bounds=_box(splats.bounds, matrix),
    )
    return found.means.astype(np.float64), field


def transform_mesh(mesh: Mesh, back: FloatArray) -> tuple[Mesh, Offset]:
    """(the mesh under a similarity [4,4] less an offset, the offset)."""
    positions, offset = _near_origin(_moved(mesh.positions, back))
    is_mirrored = np.linalg.det(back[:3, :3]) < 0.0
    faces = mesh.faces[:, ::-1] if is_mirrored else mesh.faces
    moved = Mesh(positions.astype(np.float32), _turned(mesh.normals, back), mesh.rgb, faces)
    return moved, offset


def transform_points(points: SurfacePoints, back: FloatArray) -> tuple[SurfacePoints, Offset]:
    """(the points under a similarity [4,4] less an offset, the offset)."""
    positions, offset = _near_origin(_moved(points.positions, back))
    return replace(points, positions=positions, normals=_turned(points.normals, back)), offset


def _near_origin(positions: FloatArray) -> tuple[FloatArray, Offset]:
    """(positions [N,3] less an offset, the offset): none where they are near the origin for their size."""
    if not len(positions):
        return positions, NO_OFFSET
    middle = np.median(positions, axis=0)
    size = float(np.median(np.abs(positions - middle).max(axis=1)))
    if np.linalg.norm(middle) <= MAX_DISTANCE * size:
        return positions, NO_OFFSET
    step = 10.0 ** np.floor(np.log10(size)) if size > 0.0 else 1.0
    x, y, z = (np.round(middle / step) * step + 0.0).tolist()
    return positions - (x, y, z), (x, y, z)


def _moved(positions: NDArray[np.floating], matrix: FloatArray) -> FloatArray:
    return np.asarray(positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3])


def _turned(normals: NDArray[np.floating], matrix: FloatArray) -> NDArray[np.float32]:
    turned = normals.astype(np.float64) @ matrix[:3, :3].T
    return np.asarray(turned / np.cbrt(abs(np.linalg.det(matrix[:3, :3]))), np.float32)


def _box(bounds: FloatArray, matrix: FloatArray) -> FloatArray:
    """The box [2,3] around the corners of another, moved."""
    moved = _moved(np.stack(np.meshgrid(*bounds.T), axis=-1).reshape(-1, 3), matrix)
    return np.stack([moved.min(axis=0), moved.max(axis=0)])
