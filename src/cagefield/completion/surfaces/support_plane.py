"""What a thing stood on, or hung from: the plane of surfaces around it that it touches from above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.surfaces.plane_snapping import flattened
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.typing import Array, Mask

PLANE_TRIALS = 200
"""Planes that are tried."""

PLANE_DISTANCE_VOXELS = 1.5
"""A surface vertex belongs to a plane within this distance, voxels."""

MIN_PLANE_COSINE = 0.9
"""Least cosine between its normal and the plane's."""

MIN_MEMBER_COSINE = 0.6
"""The same of all that lie on it, where normals may be noise."""

MAX_CANDIDATE_PLANES = 4
"""Planes that are looked at."""

MIN_HALF_WIDTH_VOXELS = 3
"""Half the least width of a support, voxels."""

MIN_SUPPORT_SURFELS = 60
"""Vertices of a support, at least."""


@dataclass(frozen=True)
class Support:
    """A plane with normal [3], u and v axes [2,3], through a point, in units of voxels of a block."""

    point: Array
    normal: Array
    axes: Array
    members: Array

    def local(self, at: Array) -> tuple[Array, Array]:
        """(u and v [N,2], height [N]) of block coordinates [N,3]."""
        away = at - self.point
        return away @ self.axes.T, away @ self.normal


def find_support(
    part: Mask, surface: Surfels, at: Array, near: NDArray[np.bool_], voxel: float
) -> Support | None:
    """The support of a part [X,Y,Z] among those of a surface's elements [N], `at` [N,3], that are near.

    Large planes among these have one normal, and only what lies on one is a support.
    """
    flat, on = flattened(surface.take(near), voxel)
    normals, ring = surface.normals.copy(), np.zeros(len(at), bool)
    normals[near], ring[near] = flat.normals, on
    return fit_support(part, at, normals, ring)


def fit_support(
    part: Mask, at: Array, normals: Array, ring: NDArray[np.bool_], *, seed: int = 0
) -> Support | None:
    """The plane through surfaces of the ring [N] that the part [X,Y,Z] stands on, or just over.

    at, normals [N,3]: block coordinates of all surfaces, and their normals. Each counts by how near the part
    comes to it from above. All that are on the plane are its members.
    """
    ring, content = ring.copy(), np.argwhere(part).astype(np.float64)
    for _ in range(MAX_CANDIDATE_PLANES):
        if ring.sum() < MIN_SUPPORT_SURFELS or not len(content):
            break
        found = _fit_plane(part, content, at[ring], normals[ring], seed)
        if found is None:
            break
        on = np.abs((at - found[0]) @ found[1]) < PLANE_DISTANCE_VOXELS
        support = _build_support(*found, at, normals)
        if _is_wide(support.local(at[on & (normals @ found[1] > MIN_MEMBER_COSINE)])[0]):
            return support
        ring &= ~on
    return None


def _fit_plane(
    part: Mask, content: Array, at: Array, normals: Array, seed: int
) -> tuple[Array, Array] | None:
    """(a point [3], the normal [3]) of the plane of surfaces [N] that the part's content [M,3] stands on."""
    size = float(np.median(np.ptp(content, axis=0))) + 1.0
    reach = max(4.0, 0.25 * size)
    from_part = ndimage.distance_transform_edt(~part)
    near = ndimage.map_coordinates(from_part, (at + reach * normals).T, order=1, mode="nearest")
    shade = np.clip(1.0 - near / (2.0 * reach), 0.02, 1.0)
    chance = np.random.default_rng(seed)
    some = chance.choice(len(at), min(len(at), 6000), replace=False)
    probes = content[chance.choice(len(content), min(len(content), 2000), replace=False)]
    best, most = None, 0.0
    for row in chance.choice(len(at), min(PLANE_TRIALS, len(at)), replace=False, p=shade / shade.sum()):
        n = normals[row].astype(np.float64)
        height = (at[some] - at[row]) @ n
        found = (np.abs(height) < PLANE_DISTANCE_VOXELS) & (normals[some] @ n > MIN_PLANE_COSINE)
        score = float(shade[some][found].sum())
        if score <= most:
            continue
        above = (probes - at[row]) @ n
        if (above < -PLANE_DISTANCE_VOXELS - 1.0).mean() < 0.05 and np.percentile(above, 3) < max(
            4.0, 0.3 * size
        ):
            best, most = row, score
    if best is None:
        return None
    n, centre = normals[best].astype(np.float64), at[best]
    for _ in range(3):
        member = np.flatnonzero(
            (np.abs((at - centre) @ n) < PLANE_DISTANCE_VOXELS) & (normals @ n > MIN_PLANE_COSINE)
        )
        if len(member) < MIN_SUPPORT_SURFELS:
            return None
        centre = at[member].mean(axis=0)
        spread = np.linalg.eigh(np.cov((at[member] - centre).T))[1][:, 0]
        n = spread if spread @ n > 0.0 else -spread
    return centre, n


def _build_support(centre: Array, n: Array, at: Array, normals: Array) -> Support:
    """The support on a plane with normal n [3], of surfaces [N]."""
    aside = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    aside /= np.linalg.norm(aside)
    member = (np.abs((at - centre) @ n) < 2.0 * PLANE_DISTANCE_VOXELS) & (normals @ n > MIN_MEMBER_COSINE)
    # Columns begin at a vertex: between two of them, half of the vertices would share a column.
    vertex = np.round(centre)
    point = vertex + ((centre - vertex) @ n) * n
    return Support(point, n, np.stack([aside, np.cross(n, aside)]), at[member])


def _is_wide(uv: Array) -> bool:
    """False for columns [N,2] that form nothing but strips: a plane that leans on edges."""
    cell = np.round(uv).astype(np.int64)
    cell -= cell.min(axis=0)
    found = np.zeros(cell.max(axis=0) + 2 * MIN_HALF_WIDTH_VOXELS + 1, bool)
    found[tuple((cell + MIN_HALF_WIDTH_VOXELS).T)] = True
    found = ndimage.binary_closing(found, iterations=2)
    return int(ndimage.binary_opening(found, iterations=MIN_HALF_WIDTH_VOXELS).sum()) >= MIN_SUPPORT_SURFELS
