"""Support planes: the plane of the surfaces that a part stands on, or hangs from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.surfaces.near_masks import distances_near
from cagefield.completion.surfaces.plane_snapping import snap_to_planes
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.compute.cancellation import check_cancelled
from cagefield.typing import Array, Mask

PLANE_TRIALS = 200
"""Number of RANSAC hypotheses."""

PLANE_DISTANCE_VOXELS = 1.5
"""Maximum distance of an inlier from its plane, voxels."""

MIN_PLANE_COSINE = 0.9
"""Minimum cosine between the normals of an inlier and of its plane."""

MIN_MEMBER_COSINE = 0.6
"""Minimum cosine between the normals of a member, which may be noisy, and of the support."""

MAX_CANDIDATE_PLANES = 4
"""Maximum number of planes that are examined."""

MIN_HALF_WIDTH_VOXELS = 3
"""Minimum half width of a support, voxels."""

MIN_SUPPORT_SURFELS = 60
"""Minimum number of surfels of a support."""


@dataclass(frozen=True)
class Support:
    """Plane with a normal [3] and axes u and v [2,3] through a point [3], in block coordinates (voxels).

    members [N,3]: block coordinates of the surfels on the plane.
    """

    point: Array
    normal: Array
    axes: Array
    members: Array

    def to_local(self, coordinates: Array) -> tuple[Array, Array]:
        """(u and v [N,2], height over the plane [N]) of block coordinates [N,3]."""
        offset = coordinates - self.point
        return offset @ self.axes.T, offset @ self.normal


def find_support(
    part: Mask, surface: Surfels, coordinates: Array, is_near: NDArray[np.bool_], voxel: float
) -> Support | None:
    """Support of a part [X,Y,Z] on the planes among the surfels [N] that are near the part; None without one.

    coordinates [N,3]: block coordinates of the surfels; is_near [N]: candidates; voxel: world units.
    """
    check_cancelled()
    flat, on = snap_to_planes(surface.take(is_near), voxel)
    normals, ring = surface.normals.copy(), np.zeros(len(coordinates), bool)
    normals[is_near], ring[is_near] = flat.normals, on
    return fit_support(part, coordinates, normals, ring)


def fit_support(
    part: Mask, coordinates: Array, normals: Array, ring: NDArray[np.bool_], *, seed: int = 0
) -> Support | None:
    """Plane through the surfels of the ring [N] that the part [X,Y,Z] stands on, or hangs just over.

    coordinates, normals [N,3]: block coordinates and normals of all surfels. RANSAC weights each surfel by
    its distance from the part along the normal. All surfels on the plane become its members.
    """
    check_cancelled()
    ring, vertices = ring.copy(), np.argwhere(part).astype(np.float64)
    for _ in range(MAX_CANDIDATE_PLANES):
        if ring.sum() < MIN_SUPPORT_SURFELS or not len(vertices):
            break
        plane = _fit_plane(part, vertices, coordinates[ring], normals[ring], seed)
        if plane is None:
            break
        is_near = np.abs((coordinates - plane[0]) @ plane[1]) < PLANE_DISTANCE_VOXELS
        support = _build_support(*plane, coordinates, normals)
        if _is_wide(support.to_local(coordinates[is_near & (normals @ plane[1] > MIN_MEMBER_COSINE)])[0]):
            return support
        ring &= ~is_near
    return None


def _fit_plane(
    part: Mask, vertices: Array, coordinates: Array, normals: Array, seed: int
) -> tuple[Array, Array] | None:
    """(point [3], normal [3]) of the plane of surfels [N] under the vertices [M,3] of a part, or None."""
    size = float(np.median(np.ptp(vertices, axis=0))) + 1.0
    probe = max(4.0, 0.25 * size)
    distance = distances_near(part, coordinates + probe * normals, 2.0 * probe)
    weight = np.clip(1.0 - distance / (2.0 * probe), 0.02, 1.0)
    rng = np.random.default_rng(seed)
    sample = rng.choice(len(coordinates), min(len(coordinates), 6000), replace=False)
    probes = vertices[rng.choice(len(vertices), min(len(vertices), 2000), replace=False)]
    best, best_score = None, 0.0
    for row in rng.choice(
        len(coordinates), min(PLANE_TRIALS, len(coordinates)), replace=False, p=weight / weight.sum()
    ):
        n = normals[row].astype(np.float64)
        height = (coordinates[sample] - coordinates[row]) @ n
        is_inlier = (np.abs(height) < PLANE_DISTANCE_VOXELS) & (normals[sample] @ n > MIN_PLANE_COSINE)
        score = float(weight[sample][is_inlier].sum())
        if score <= best_score:
            continue
        probe_height = (probes - coordinates[row]) @ n
        if (probe_height < -PLANE_DISTANCE_VOXELS - 1.0).mean() < 0.05 and np.percentile(
            probe_height, 3
        ) < max(4.0, 0.3 * size):
            best, best_score = row, score
    if best is None:
        return None
    n, center = normals[best].astype(np.float64), coordinates[best]
    for _ in range(3):
        member = np.flatnonzero(
            (np.abs((coordinates - center) @ n) < PLANE_DISTANCE_VOXELS) & (normals @ n > MIN_PLANE_COSINE)
        )
        if len(member) < MIN_SUPPORT_SURFELS:
            return None
        center = coordinates[member].mean(axis=0)
        axis = np.linalg.eigh(np.cov((coordinates[member] - center).T))[1][:, 0]
        n = axis if axis @ n > 0.0 else -axis
    return center, n


def _build_support(center: Array, n: Array, coordinates: Array, normals: Array) -> Support:
    """Support on the plane through `center` [3] with normal n [3], of surfels [N]."""
    aside = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    aside /= np.linalg.norm(aside)
    is_member = (np.abs((coordinates - center) @ n) < 2.0 * PLANE_DISTANCE_VOXELS) & (
        normals @ n > MIN_MEMBER_COSINE
    )
    # Columns begin at a vertex: between two of them, half of the vertices would share a column.
    vertex = np.round(center)
    point = vertex + ((center - vertex) @ n) * n
    return Support(point, n, np.stack([aside, np.cross(n, aside)]), coordinates[is_member])


def _is_wide(uv: Array) -> bool:
    """Whether columns [N,2] contain a square of half width MIN_HALF_WIDTH_VOXELS.

    A plane that touches mere edges contains only strips.
    """
    cell = np.round(uv).astype(np.int64)
    cell -= cell.min(axis=0)
    columns = np.zeros(cell.max(axis=0) + 2 * MIN_HALF_WIDTH_VOXELS + 1, bool)
    columns[tuple((cell + MIN_HALF_WIDTH_VOXELS).T)] = True
    columns = ndimage.binary_closing(columns, iterations=2)
    return int(ndimage.binary_opening(columns, iterations=MIN_HALF_WIDTH_VOXELS).sum()) >= MIN_SUPPORT_SURFELS
