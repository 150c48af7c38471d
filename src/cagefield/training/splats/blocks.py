"""Blocks of a capture: a partition of space by its sparse points, and the photos that see each block.

Space is divided by planes across the world's axes, each at a quantile of the points on both its sides, where
each photo's points weigh 1 together: the core cells of the blocks, each the content of as many photos. A core
is half-open, [low, high) along each axis, and the outer ones reach to infinity, so that every position is in
exactly one core; a position outside the points' box is in the core that is nearest to it. A block's region is
its core, grown by `OVERLAP` of its extent among the points at each inner plane. Its photos see enough points
of the region, as a share of all that they see, or are among the nearest ones of enough of its points: the
background of an object is a small part of all photos that see it. Neighbors share the photos of the overlap.

Content farther from all cameras than `FAR_DEPTHS` median depths, the sky for example, belongs to no block: it
is the scaffold's (`scaffold`), which all photos train. Each block is trained by itself (`train_blocks`), with
the scaffold's splats around it; of its splats those whose means lie in its core and near cameras are its own.
They are refined together with those of its neighbors and the far ones (`refinement`). The merged field has
each block's own splats, and the scaffold's in no block.

Source: the division follows VastGaussian (Lin et al. 2024, section 4), with visibility from the points of
the reconstruction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cagefield.datasets.views import Dataset, SparsePoints, View
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.typing import Array

OVERLAP = 0.15
"""Growth of a core at its inner planes, as a share of its extent among the points."""
MIN_BLOCK_POINTS = 10
"""Minimum number of a region's points that a photo of the block sees."""
MIN_PHOTO_SHARE = 0.25
"""Minimum share of the points that a photo sees which are the region's."""
NEAREST_PHOTOS = 4
"""Number of photos, the nearest of those that see a point, that a block of the point takes even so."""
FAR_DEPTHS = 3.0
"""Distance from the nearest camera beyond which content is far, in median distances of points from photos."""
MAX_BLOCKS = 10_000


@dataclass(frozen=True, eq=False)
class Block:
    """A core cell with its photos and points.

    Attributes:
        core: [2,3] half-open cell, world units; infinite on the outside.
        region: [2,3] the core grown at its inner planes.
        photos: numbers of the training photos, ascending.
        points: rows of the points that two of its photos see, ascending.
        core_points, region_points: numbers of points in the core and in the region.
        cameras: [V,3] origins of all the capture's photos; None where nothing is far.
        reach: distance from the nearest of them beyond which content is far, world units.
    """

    core: Array
    region: Array
    photos: tuple[int, ...]
    points: NDArray[np.int64]
    core_points: int
    region_points: int
    cameras: Array | None = None
    reach: float = float("inf")

    def contains(self, positions: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Mask [N] of positions [N,3] in the core and not far."""
        return self._near(inside_cell(self.core, positions), positions)

    def own(self, field: SplatField) -> SplatField:
        """The splats of a field whose means it contains."""
        return field.take(self.contains(field.means))

    def trains(self, positions: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Mask [N] of positions [N,3] in the region and not far."""
        return self._near(inside_cell(self.region, positions), positions)

    def is_far(self, positions: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Mask [N] of positions [N,3] that are far, in whichever core."""
        return ~self._near(np.ones(len(positions), bool), positions)

    def _near(self, mask: NDArray[np.bool_], positions: NDArray[np.floating]) -> NDArray[np.bool_]:
        if self.cameras is not None:
            rows = np.flatnonzero(mask)
            distances = cKDTree(self.cameras).query(positions[rows])[0]
            mask[rows] = distances < self.reach
        return mask

    def describe(self) -> str:
        """Photos and points."""
        more = self.region_points - self.core_points
        return f"{len(self.photos)} photos, {self.core_points} points and {more} around them"


def divide(dataset: Dataset, points: SparsePoints, count: int) -> tuple[Block, ...]:
    """`count` blocks of a capture's training photos; one block holds all photos and points.

    Raises:
        CagefieldError: a number of blocks that is out of range, blocks that no photo sees.
    """
    check_count(count)
    everything = np.array([[-np.inf] * 3, [np.inf] * 3])
    if count == 1:
        photos, rows = tuple(range(len(dataset.train))), np.arange(len(points))
        return (Block(everything, everything, photos, rows, len(points), len(points)),)
    if len(points) < count * MIN_BLOCK_POINTS:
        raise CagefieldError(
            f"{dataset.path}: {len(points)} points are too few for {count} blocks; give --blocks "
            f"{max(1, len(points) // MIN_BLOCK_POINTS)} or less"
        )
    seen = visible_points(dataset.train, points)
    totals = np.asarray(seen.sum(axis=1)).ravel()
    weights = np.asarray(seen.T @ (1.0 / np.maximum(totals, 1))).ravel()
    cores = partition(points.positions, count, weights)
    regions = [grown(core, points.positions, weights) for core in cores]
    members = np.stack([inside_cell(region, points.positions) for region in regions])
    counts = np.stack([seen @ rows.astype(np.int32) for rows in members])
    chosen = (counts >= MIN_BLOCK_POINTS) & (counts >= MIN_PHOTO_SHARE * totals)
    close = nearest_observations(dataset.train, points, seen)
    chosen |= np.stack([close @ rows.astype(np.int32) for rows in members]) >= MIN_BLOCK_POINTS
    most = counts.argmax(axis=0)
    chosen[most, np.arange(len(totals))] |= counts.max(axis=0) >= MIN_BLOCK_POINTS
    origins = np.stack([view.camera.origin for view in dataset.train])
    photos, rows = seen.nonzero()
    reach = FAR_DEPTHS * float(np.median(np.linalg.norm(origins[photos] - points.positions[rows], axis=1)))
    blocks = []
    for number, (core, region, rows) in enumerate(zip(cores, regions, members, strict=True)):
        own = tuple(int(n) for n in np.flatnonzero(chosen[number]))
        if len(own) < 2:
            raise CagefieldError(
                f"{dataset.path}: block {number + 1} of {count} is seen by {len(own)} photos; give fewer "
                "--blocks"
            )
        shared = np.flatnonzero(np.asarray(seen[list(own)].sum(axis=0)).ravel() >= 2)
        inside = int(inside_cell(core, points.positions).sum())
        blocks.append(Block(core, region, own, shared, inside, int(rows.sum()), origins, reach))
    return tuple(blocks)


def check_count(count: int) -> None:
    """Raises CagefieldError for a number of blocks that is out of range."""
    if not 1 <= count <= MAX_BLOCKS:
        raise CagefieldError(f"blocks is {count}; give a number from 1 to {MAX_BLOCKS}")


def partition(positions: Array, count: int, weights: Array | None = None) -> list[Array]:
    """Half-open cells [2,3] that tile space, with about equal weights [M] of the points [M,3] in each.

    A cell is divided across the axis along which its points spread most, 5th to 95th percentile. Points
    without `weights` count equally.
    """
    whole = np.array([[-np.inf] * 3, [np.inf] * 3])
    weights = np.ones(len(positions)) if weights is None else weights
    return _divided(whole, np.asarray(positions, np.float64), np.asarray(weights, np.float64), count)


def _divided(cell: Array, positions: Array, weights: Array, count: int) -> list[Array]:
    if count == 1:
        return [cell]
    low, high = _quantiles(positions, weights, (0.05, 0.95))
    axis = int(np.argmax(high - low))
    fewer = count // 2
    plane = _dividing_plane(positions[:, axis], weights, fewer / count)
    left, right = cell.copy(), cell.copy()
    left[1, axis] = right[0, axis] = plane
    below = positions[:, axis] < plane
    return _divided(left, positions[below], weights[below], fewer) + _divided(
        right, positions[~below], weights[~below], count - fewer
    )


def _dividing_plane(values: Array, weights: Array, share: float) -> float:
    """Midway between the neighboring values [M] below which nearest to this share of the weights lies."""
    order = np.argsort(values, kind="stable")
    sums = np.cumsum(weights[order])
    rank = int(np.argmin(np.abs(sums[:-1] - share * sums[-1]))) + 1
    return float(values[order][rank - 1 : rank + 1].mean())


def _quantiles(positions: Array, weights: Array, shares: tuple[float, float]) -> Array:
    """Two quantiles [2,3] of weighted positions [M,3]."""
    bounds = np.empty((2, 3))
    for axis in range(3):
        order = np.argsort(positions[:, axis], kind="stable")
        sums = np.cumsum(weights[order])
        ranks = np.searchsorted(sums, np.array(shares) * sums[-1])
        bounds[:, axis] = positions[order, axis][ranks.clip(0, len(positions) - 1)]
    return bounds


def inside_cell(cell: Array, positions: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Mask [N] of positions [N,3] in a half-open cell [2,3]."""
    mask: NDArray[np.bool_] = ((positions >= cell[0]) & (positions < cell[1])).all(axis=1)
    return mask


def grown(cell: Array, positions: Array, weights: Array | None = None) -> Array:
    """Cell [2,3] whose inner planes are moved outwards by OVERLAP of its extent.

    On its infinite sides the cell extends to the outer quartile of its points [M,3], of these `weights` [M].
    """
    inside = inside_cell(cell, positions)
    weights = np.ones(len(positions)) if weights is None else weights
    bounds = _quantiles(positions[inside], weights[inside], (0.25, 0.75))
    extent = np.where(np.isfinite(cell), cell, bounds)
    margin = OVERLAP * np.abs(extent[1] - extent[0])
    return cell + np.stack([-margin, margin])


def visible_points(views: Sequence[View], points: SparsePoints) -> Any:
    """Sparse matrix int32 [V,M], 1 where a photo sees a point: as the reconstruction knows it, else by the
    frustum.
    """
    from scipy.sparse import csr_matrix

    if points.seen_by:
        numbers = {view.name: n for n, view in enumerate(views)}
        photos = np.fromiter((numbers.get(name, -1) for names in points.seen_by for name in names), np.int64)
        rows = np.repeat(np.arange(len(points)), [len(names) for names in points.seen_by])
        photos, rows = photos[photos >= 0], rows[photos >= 0]
    else:
        found = [np.flatnonzero(_in_frustum(view, points.positions)) for view in views]
        photos = np.repeat(np.arange(len(views)), [len(part) for part in found])
        rows = np.concatenate(found)
    return csr_matrix((np.ones(len(rows), np.int32), (photos, rows)), shape=(len(views), len(points)))


def nearest_observations(views: Sequence[View], points: SparsePoints, seen: Any) -> Any:
    """Sparse matrix int32 [V,M] as `seen`, of each point the NEAREST_PHOTOS nearest photos."""
    from scipy.sparse import csr_matrix

    photos, rows = seen.nonzero()
    origins = np.stack([view.camera.origin for view in views])
    distances = np.linalg.norm(origins[photos] - points.positions[rows], axis=1)
    order = np.lexsort((photos, distances, rows))
    photos, rows = photos[order], rows[order]
    rank = np.arange(len(rows)) - np.searchsorted(rows, rows)
    near = rank < NEAREST_PHOTOS
    return csr_matrix((np.ones(near.sum(), np.int32), (photos[near], rows[near])), shape=seen.shape)


def _in_frustum(view: View, positions: Array) -> NDArray[np.bool_]:
    pixels, depth = view.camera.project(positions)
    with np.errstate(invalid="ignore"):
        inside: NDArray[np.bool_] = (
            (pixels >= 0).all(axis=1)
            & (pixels < (view.camera.width, view.camera.height)).all(axis=1)
            & (depth > 0)
        )
    return inside


def block_dataset(dataset: Dataset, points: SparsePoints, block: Block) -> Dataset:
    """The capture of a block: its training photos, and the points that two of them see; no test photos."""
    if len(block.photos) == len(dataset.train):
        return replace(dataset, points=points)
    train = tuple(dataset.train[n] for n in block.photos)
    return replace(dataset, train=train, test=(), val=(), points=points.take(block.points))


def left_out(dataset: Dataset, blocks: Sequence[Block]) -> tuple[str, ...]:
    """Names of the training photos in no block."""
    used = {n for block in blocks for n in block.photos}
    return tuple(view.name for n, view in enumerate(dataset.train) if n not in used)


def merge(blocks: Sequence[Block], fields: Sequence[SplatField], scaffold: SplatField) -> SplatField:
    """The field of all blocks: each block's own splats, of the scaffold those that no block contains.

    The fields agree in everything but their splats.

    Raises:
        CagefieldError: no block has a splat.
    """
    if not any(len(part) for part in fields):
        raise CagefieldError("the blocks have no splats in their cores; give fewer --blocks")
    left = np.ones(len(scaffold), bool)
    for block in blocks:
        left &= ~block.contains(scaffold.means)
    return concatenate([*fields, scaffold.take(left)])


def concatenate(fields: Sequence[SplatField]) -> SplatField:
    """The splats of all fields as one, which has the last field's other values."""
    return replace(
        fields[-1],
        means=np.concatenate([part.means for part in fields]),
        log_scales=np.concatenate([part.log_scales for part in fields]),
        quaternions=np.concatenate([part.quaternions for part in fields]),
        opacities=np.concatenate([part.opacities for part in fields]),
        sh=np.concatenate([part.sh for part in fields]),
    )
