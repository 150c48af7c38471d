"""Level of detail of splats: clusters, for frame times that grow with visible splats and not with the file.

Splats are ordered along a Morton curve, the largest ones apart, and taken in clusters of CLUSTER. A camera
draws the clusters that it may see: exactly the splats that it would draw without them. Where a group of a
cluster's splats lies within a share of a pixel, a representative may stand for it (`detail`): so the number
of drawn elements is bounded by the pixels, for any file.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary, ref

import numpy as np
from numpy.typing import NDArray

from cagefield.rendering.splats.kernels import splat_lod as kernels
from cagefield.rendering.splats.kernels.projection import BLUR
from cagefield.rendering.splats.kernels.splat_args import MergedSplats
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.typing import Float32

CLUSTER = 256
"""Splats of a cluster."""

GROUPS = (8, 8)
"""Elements merged into one representative at each level: splats, then representatives."""

MIN_CLUSTERED_SPLATS = 100_000
"""Fewer splats are drawn without clusters: projecting them all costs less than 15 ms."""

LARGEST = (1 / 64, 1 / 4096)
"""Shares of the largest splats that have clusters of their own: one of them makes a cluster's box large."""


@dataclass(frozen=True, eq=False)
class View:
    """View of an image for culling clusters: pinhole frusta have four planes, other lenses none.

    origin [3] of the camera, W [3,3] world to camera, planes [P,3] and reaches [P] as `kernels.seen`, focal
    length in pixels, least depth.
    """

    origin: NDArray[np.float64]
    W: NDArray[np.float64]
    planes: NDArray[np.float64]
    reaches: NDArray[np.float64]
    focal: float
    near: float

    @classmethod
    def from_region(
        cls,
        origin: NDArray[np.float64],
        W: NDArray[np.float64],
        focal: NDArray[np.float64],
        center: NDArray[np.float64],
        size: tuple[int, int],
        limits: NDArray[np.float64],
        near: float,
        *,
        pinhole: bool,
    ) -> View:
        """The view of a camera's region: center [2] and size in pixels of the region, `limits` of n.

        A splat at (x, y, z) with the variance s^2 at most reaches r (f sqrt(1 + n^2) s / z + sqrt(BLUR))
        pixels from its mean, r <= FARTHEST. Points right of the left edge have f x + (c + r sqrt(BLUR)) z
        >= -f sqrt(1 + n^2) r s; so for the other edges.
        """
        planes, reaches = [], []
        blur = float(kernels.FARTHEST * np.sqrt(BLUR)) + 1e-3
        for axis in range(2 if pinhole else 0):
            f, c = focal[axis], center[axis]
            slope = float(np.abs(limits[2 * axis : 2 * axis + 2]).max())
            planes += [f * W[axis] + (c + blur) * W[2], -f * W[axis] + (size[axis] - c + blur) * W[2]]
            reaches += [f * np.sqrt(1.0 + slope**2)] * 2
        return cls(
            origin,
            W,
            np.array(planes).reshape(-1, 3),
            np.array(reaches) * (1.0 + 1e-5),
            float(focal.max()),
            near,
        )


@dataclass(frozen=True, eq=False)
class Level:
    """Representatives of groups of splats, in the order of the clusters.

    masses [M,2]: see `kernels.merge`; apart [clusters]: rms distance of the merged elements from them.
    """

    splats: DeformedSplats
    masses: Float32
    apart: Float32
    per_cluster: int


@dataclass(frozen=True, eq=False)
class Clusters:
    """Clusters of living splats: order [N] of the splats, boxes [clusters,CLUSTER_FLOATS].

    The splats are a weak reference: remembered clusters do not keep them alive.
    """

    splats: ref[DeformedSplats]
    order: NDArray[np.int32]
    boxes: Float32

    @classmethod
    def build(cls, splats: DeformedSplats, like: Clusters | None = None) -> Clusters:
        """The clusters of splats, made once while they live; in the order of others of as many splats."""
        found = _known.get(splats)
        if found is None:
            same = like is not None and len(like.order) == len(splats)
            order = like.order if like is not None and same else _ordered(splats)
            boxes = np.empty((-(-len(splats) // CLUSTER), kernels.CLUSTER_FLOATS), np.float32)
            kernels.boxes(splats.means, splats.covariances, splats.opacities, order, CLUSTER, boxes)
            # Rounding may not make a box smaller.
            boxes[:, 3:7] += 1e-6 * (np.abs(boxes[:, :3]).max(axis=1, keepdims=True) + boxes[:, 3:7])
            found = _known[splats] = cls(ref(splats), order, boxes)
        return found

    @cached_property
    def levels(self) -> tuple[Level, ...]:
        """Representatives, finest first; made on first use."""
        levels: list[Level] = []
        below = self.splats()
        assert below is not None, "clusters are used while their splats live"
        order, masses, per_cluster = self.order, np.empty((0, 2), np.float32), CLUSTER
        for size in GROUPS:
            per_cluster //= size
            level = _merged(below, order, size, masses, len(self.boxes), per_cluster)
            levels.append(level)
            below, masses = level.splats, level.masses
            order = np.arange(len(below), dtype=np.int32)
        return tuple(levels)

    def rows(self, view: View, detail: float) -> list[NDArray[np.int32]]:
        """Indices of the splats visible in a view, then of the representatives of each level.

        A representative replaces elements less than `detail` pixels from it; 0 takes splats alone.
        """
        depths = np.empty(len(self.boxes))
        kernels.seen(self.boxes, view.origin, view.W, view.planes, view.reaches, view.near, depths)
        seen = np.flatnonzero(depths >= 0.0)
        level = np.zeros(len(seen), np.int64)
        if detail > 0.0:
            pixel = detail * depths[seen] / view.focal
            for number, coarser in enumerate(self.levels, start=1):
                level[coarser.apart[seen] < pixel] = number
        rows = [_rows_of(seen[level == 0], self.order, CLUSTER)]
        if detail > 0.0:
            for number, coarser in enumerate(self.levels, start=1):
                every = np.arange(len(coarser.splats), dtype=np.int32)
                rows.append(_rows_of(seen[level == number], every, coarser.per_cluster))
        return rows


_known: WeakKeyDictionary[DeformedSplats, Clusters] = WeakKeyDictionary()


def _ordered(splats: DeformedSplats) -> NDArray[np.int32]:
    """The splats along a Morton curve through the box of most means; the largest last, in classes."""
    if not len(splats):
        return np.zeros(0, np.int32)
    some = splats.means[:: max(1, len(splats) // 100_000)]
    low, high = np.quantile(some, (0.01, 0.99), axis=0)
    margin = 0.05 * (high - low) + 1e-12
    low, high = low - margin, high + margin
    codes = np.empty(len(splats), np.uint32)
    kernels.codes(splats.means, low, 1024.0 / (high - low), codes)
    traces = splats.covariances[:, 0] + splats.covariances[:, 3]
    traces += splats.covariances[:, 5]
    sample = traces[:: max(1, len(splats) // 1_000_000)]
    for share in LARGEST:
        codes[traces > np.quantile(sample, 1.0 - share)] += np.uint32(1 << 30)
    return np.argsort(codes, kind="stable").astype(np.int32)


def _merged(
    below: DeformedSplats, order: NDArray[np.int32], size: int, masses: Float32, clusters: int, per: int
) -> Level:
    """Representatives of each `size` elements of the level below."""
    count = -(-len(order) // size)
    turned = below.rotations is not None
    means, covariances = np.empty((count, 3), np.float32), np.empty((count, 6), np.float32)
    sh = np.empty((count, *below.sh.shape[1:]), np.float32)
    rotations = np.empty((count if turned else 0, 3, 3), np.float32)
    own, apart = np.empty((count, 2), np.float32), np.empty(count, np.float32)
    kernels.merge(
        below.kernel_args(), masses, order, size, MergedSplats(means, covariances, sh, rotations, own, apart)
    )
    spread = np.empty(clusters, np.float32)
    kernels.spreads(apart, per, spread)
    opacities = np.ones(count, np.float32)
    merged = DeformedSplats(
        means, covariances, opacities, sh, rotations if turned else None, below.antialiased
    )
    return Level(merged, own, spread, per)


def _rows_of(chosen: NDArray[np.int64], order: NDArray[np.int32], size: int) -> NDArray[np.int32]:
    """The entries of `order` of the chosen clusters, ascending, as without clusters."""
    out = np.empty(len(chosen) * size, np.int32)
    return np.sort(out[: kernels.rows_of(chosen, order, size, out)])
