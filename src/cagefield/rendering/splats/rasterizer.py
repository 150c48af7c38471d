"""Splats rasterized on the CPU: projected, sorted by depth, blended in tiles; the host side of the kernels.

A `Projection` is one camera's view of one set of splats; pictures, opacities along rays and gradients are
asked of it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import spence

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.compute.cancellation import check_cancelled
from cagefield.rendering.splats.kernels import blending, projection, tile_binning
from cagefield.rendering.splats.kernels.projection import AREA, PACKED, TILE_PX
from cagefield.rendering.splats.kernels.splat_args import CameraArgs, ProjectedSplats
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.rendering.splats.splat_lod import Clusters, View
from cagefield.typing import Float32, Mask

Region = tuple[int, int, int, int]

_MODELS = {
    "pinhole": projection.PINHOLE,
    "opencv": projection.OPENCV,
    "opencv_fisheye": projection.FISHEYE,
}
_TO_OPENCV = np.diag([1.0, -1.0, -1.0])

_GRAZING = 0.05
"""A fisheye's picture reaches this cosine to its axis at most: splats are drawn in front of it alone."""

MIN_PART_TILES = 20_000
"""Minimum number of tiles that a thread tests at a time: waking one costs microseconds."""

OUTSIDE = 0.3
"""How far outside the picture, in shares of its half-size, a splat's shape still follows where it is."""

NEAR_HALF_DIAGONALS = 0.04
"""Depth at which drawing starts, in half-diagonals of the box of interest."""

NOWHERE: Float32 = np.zeros((2, 1, 1), np.float32)
"""Nothing is known to be empty."""

_NO_MASSES: Float32 = np.empty((0, 2), np.float32)
_NO_NORMALS: Float32 = np.empty((0, 3), np.float32)

_SHARES = np.concatenate(
    [np.linspace(0.0, 0.9, 1000), 0.9 + np.linspace(0.0, projection.ALPHA_MAX - 0.9, 1000)]
)
_OPACITIES = np.interp(np.linspace(0.0, projection.DEEPEST, 1024), spence(1.0 - _SHARES), _SHARES)
"""Opacities o at equal steps of Li2(o); scipy's `spence(1 - o)` is Li2(o)."""

COLOR, DEPTH, NORMALS = 4, 5, 8
"""Channels of a picture: T and color; depth as well; normals as well."""


@dataclass(frozen=True)
class Intrinsics:
    """A camera's intrinsics for the kernels; `limits` are x low, x high, y low, y high of n = (x/z, y/z)."""

    focal: NDArray[np.float64]
    center: NDArray[np.float64]
    size: NDArray[np.int64]
    limits: NDArray[np.float64]
    model: int
    coefficients: NDArray[np.float64]
    radius_limit: float


@dataclass(frozen=True, eq=False)
class Projection:
    """The pairs (tile, splat) of one picture, near to far within each tile; see `pairs_of_tiles`."""

    packed: Float32
    order: NDArray[np.int64]
    starts: NDArray[np.int64]
    ids: NDArray[np.int32]
    firsts: NDArray[np.int64]
    slots: NDArray[np.int32]
    pairs: int
    width: int
    height: int

    @property
    def across(self) -> int:
        """Tiles in a row of the picture."""
        return -(-self.width // TILE_PX)

    @property
    def tiles(self) -> int:
        """Tiles of the picture."""
        return len(self.starts) - 1

    def blend(self, channels: int = DEPTH) -> tuple[Float32, NDArray[np.int64]]:
        """The picture [tiles,channels,AREA] (T, color, depth x weight, normals), and where tiles end."""
        out = np.empty((self.tiles, channels, AREA), np.float32)
        stops = np.empty(self.tiles, np.int64)
        blending.blend(self.packed, self.ids, self.starts, self.across, channels, stops, out)
        return out, stops

    def picture(self, channels: int = DEPTH) -> Float32:
        """The picture [H,W,channels]."""
        return untiled(self.blend(channels)[0], self.width, self.height)

    def gradients(
        self,
        color: Float32,
        slopes: Float32,
        stops: NDArray[np.int64],
        sums: Float32 | None = None,
        empty: Float32 = NOWHERE,
        veil: float = 0.0,
        weights: Float32 | None = None,
    ) -> Float32:
        """Sums [pairs, SUMS] (see `blending`) for dL/d(picture) `slopes` [tiles,3,AREA].

        `color` [tiles,3,AREA] is the picture over its background, whose part in the gradient is included.
        `empty` [2,h,w] are distances along the picture's rays, at its size or smaller, up to which there is
        nothing, 0 where nobody knows, and how sure that is: each alpha before them adds that times `veil` to
        the loss. `weights` [tiles,AREA] scale the slopes; pixels of weight 0 count for nothing.
        """
        if weights is None:
            weights = np.ones((self.tiles, AREA), np.float32)
        if sums is None or len(sums) < self.pairs:
            sums = np.empty((self.pairs, blending.SUMS), np.float32)
        blending.gradients(
            self.packed, self.ids, self.starts, stops, self.width, self.height, color, slopes, weights,
            empty, np.float32(veil), sums,
        )  # fmt: skip
        return sums

    def opacity_before(self, pixels: NDArray[Any], distances: NDArray[Any]) -> Float32:
        """Opacity [K] gathered before distances [K] along the rays of pixels [K,2] inside the picture."""
        out = np.zeros(len(pixels), np.float32)
        blending.opacity_before(
            self.packed,
            self.ids,
            self.starts,
            self.across,
            np.ascontiguousarray(pixels, np.float32),
            np.ascontiguousarray(distances, np.float32),
            out,
        )
        return out


@dataclass(frozen=True, eq=False)
class _Source:
    """Splats of which `rows` are projected; masses [N,2] where they are representatives."""

    splats: DeformedSplats
    rows: NDArray[np.int32]
    masses: Float32 | None = None


class Buffers:
    """Memory that one owner's projections share; a projection is valid until its owner makes the next.

    Threads that share an owner hold `lock` from a projection to the last use of it.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._arrays: dict[str, NDArray[Any]] = {}

    def take(self, name: str, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """An uninitialized array; the same memory as long as it is large enough."""
        size = int(np.prod(shape))
        found = self._arrays.get(name)
        if found is None or found.size < size or found.dtype != dtype:
            found = self._arrays[name] = np.empty(size + size // 4, dtype)
        return found[:size].reshape(shape)


def project(
    splats: DeformedSplats,
    camera: Camera,
    *,
    near: float,
    region: Region | None = None,
    normals: Float32 | None = None,
    buffers: Buffers | None = None,
    clusters: Clusters | None = None,
    detail: float = 0.0,
    choose: Callable[[CameraArgs], Mask] | None = None,
) -> Projection:
    """The splats as `camera` sees them, in the part (x, y, width, height) of its picture.

    Splats nearer than the depth `near` are left out. `normals` [N,3] (world, unit, either sign) are needed
    where normals will be asked for.

    With the splats' `clusters`, those out of sight cost nothing, and the picture is the same. A `detail`
    above 0 has representatives drawn for splats that lie within so many pixels; they have no normals.
    Without clusters `choose` may say which of the last splats a view draws.
    """
    buffers = buffers or Buffers()
    x, y, width, height = region or (0, 0, camera.width, camera.height)
    view = camera_args(camera, near, (x, y, width, height))
    if clusters is None:
        chosen = np.ones(0, bool) if choose is None else choose(view)
        always = len(splats) - len(chosen)
        last = (always + np.flatnonzero(chosen)).astype(np.int32)
        sources = [_Source(splats, np.concatenate([np.arange(always, dtype=np.int32), last]))]
    else:
        visible = View.from_region(
            view.origin, view.world_to_camera, view.focal, view.center, (width, height), view.limits, near,
            pinhole=view.model == projection.PINHOLE,
        )  # fmt: skip
        rows, *coarser = clusters.rows(visible, detail)
        levels = clusters.levels if coarser else ()
        sources = [_Source(splats, rows)]
        sources += [
            _Source(level.splats, chosen, level.masses) for level, chosen in zip(levels, coarser, strict=True)
        ]
    count = sum(len(source.splats) for source in sources)
    packed = buffers.take("packed", (count, PACKED), np.float32)
    keys = buffers.take("keys", (count,), np.float32)
    tiles = buffers.take("tiles", (count, 4), np.int32)
    if clusters is None:
        tiles[always:][~chosen, :2] = 0
    shown, begin = [], 0
    for source in sources:
        end = begin + len(source.splats)
        projection.project(
            source.splats.kernel_args(),
            _NO_NORMALS if normals is None else np.ascontiguousarray(normals),
            _NO_MASSES if source.masses is None else source.masses,
            _OPACITIES,
            source.rows,
            view,
            splats.antialiased,
            ProjectedSplats(packed[begin:end], keys[begin:end], tiles[begin:end]),
        )
        if clusters is None:
            shown.append(np.flatnonzero(tiles[:, 1] > tiles[:, 0]))
        else:
            part = tiles[begin:end] if len(source.rows) == end - begin else tiles[begin:end][source.rows]
            shown.append(source.rows[part[:, 1] > part[:, 0]] + np.int32(begin))
        begin = end
    check_cancelled()
    tiled = pairs_of_tiles(np.concatenate(shown), keys, tiles, packed, False, width, height, buffers)
    return Projection(packed, *tiled, width, height)


def pairs_of_tiles(
    shown: NDArray[np.integer],
    keys: Float32,
    tiles: NDArray[np.int32],
    packed: Float32,
    discs: bool,
    width: int,
    height: int,
    buffers: Buffers,
) -> tuple[
    NDArray[np.int64], NDArray[np.int64], NDArray[np.int32], NDArray[np.int64], NDArray[np.int32], int
]:
    """(order, starts, ids, firsts, slots, pairs): the splats or discs `shown`, near to far in each tile.

    `keys` [N] sort them, `tiles` [N,4] are their boxes of tiles. ids[starts[t]:starts[t+1]] are the splats of
    tile t; slots[firsts[q]:firsts[q+1]] are the places in `ids` of the splat order[q]; `pairs` is the number
    of both.
    """
    every = shown.astype(np.int64)
    order = every[np.argsort(keys[every])]
    boxes = tiles[order]
    areas = np.cumsum((boxes[:, 1] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 2]), dtype=np.int64)
    most = int(areas[-1]) if len(areas) else 0
    across, down = -(-width // TILE_PX), -(-height // TILE_PX)
    ids, slots, found = (buffers.take(name, (most,), np.int32) for name in ("ids", "slots", "found"))
    # Parts with about as many tiles to test each.
    parts = max(1, min(devices.parts(), most // MIN_PART_TILES))
    bounds = np.searchsorted(areas, most * np.arange(parts + 1) // parts)
    bounds[[0, -1]] = 0, len(order)
    places = np.append(0, areas)[bounds]
    counts = np.zeros((parts, across * down), np.int64)
    firsts = np.zeros(len(order) + 1, np.int64)
    tile_binning.find_pairs(bounds, order, tiles, packed, discs, across, places, found, counts, firsts[1:])
    np.cumsum(firsts, out=firsts)
    starts = np.append(0, np.cumsum(counts.sum(axis=0)))
    fill = starts[:-1] + np.cumsum(counts, axis=0) - counts
    tile_binning.sort_pairs(bounds, order, places, found, firsts, fill, ids, slots)
    return order, starts, ids, firsts, slots, int(firsts[-1])


def world_to_camera(camera: Camera) -> NDArray[np.float64]:
    """The rotation [3,3] into camera axes x right, y down, z forward."""
    return np.ascontiguousarray(_TO_OPENCV @ camera.c2w[:3, :3].T)


def camera_args(camera: Camera, near: float, region: Region | None = None) -> CameraArgs:
    """Kernel arguments of a camera and the part (x, y, width, height) of its image."""
    x, y, width, height = region or (0, 0, camera.width, camera.height)
    lens = intrinsics(camera)
    return CameraArgs(
        world_to_camera(camera),
        camera.origin.astype(np.float64),
        lens.focal,
        lens.center - (x, y),
        np.array((width, height)),
        lens.limits,
        lens.model,
        lens.coefficients,
        lens.radius_limit,
        near,
    )


def intrinsics(camera: Camera) -> Intrinsics:
    """The camera's intrinsics; those of the last cameras are kept."""
    return _intrinsics(
        camera.width,
        camera.height,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        camera.model,
        tuple(camera.distortion),
    )


@lru_cache(maxsize=512)
def _intrinsics(
    width: int,
    height: int,
    fx: float,
    fy: float,
    cx: float,
    cy: float,
    model: Any,
    distortion: tuple[float, ...],
) -> Intrinsics:
    coefficients = np.zeros(6)
    coefficients[: len(distortion)] = distortion
    limits = np.array([-cx / fx, (width - cx) / fx, -cy / fy, (height - cy) / fy])
    radius_limit = np.inf
    if model != "pinhole":
        edge = (_border(width, height) - (cx, cy)) / (fx, fy)
        directions = lenses.unproject(edge, model, distortion)[0]
        n = (directions[:, :2] / np.maximum(directions[:, 2:], _GRAZING))[directions[:, 2] > _GRAZING]
        limits = np.array([n[:, 0].min(), n[:, 0].max(), n[:, 1].min(), n[:, 1].max()])
        radius_limit = lenses.fold_radius(model, distortion)
    half = 0.5 * np.array([limits[1] - limits[0], limits[3] - limits[2]])
    limits += OUTSIDE * np.array([-half[0], half[0], -half[1], half[1]])
    return Intrinsics(
        np.array([fx, fy]),
        np.array([cx, cy]),
        np.array([width, height]),
        limits,
        _MODELS[model],
        coefficients,
        radius_limit,
    )


def _border(width: int, height: int) -> NDArray[np.float64]:
    """Pixel positions [K,2] along the edges of a picture."""
    x, y = np.linspace(0.0, width, 64), np.linspace(0.0, height, 64)
    return np.concatenate(
        [
            np.stack([x, np.zeros_like(x)], axis=1),
            np.stack([x, np.full_like(x, height)], axis=1),
            np.stack([np.zeros_like(y), y], axis=1),
            np.stack([np.full_like(y, width), y], axis=1),
        ]
    )


def tiled(picture: NDArray[Any]) -> NDArray[Any]:
    """A picture [H,W,C] as tiles [tiles,C,AREA], filled up with zeros."""
    height, width, channels = picture.shape
    down, across = -(-height // TILE_PX), -(-width // TILE_PX)
    padded = np.zeros((down * TILE_PX, across * TILE_PX, channels), picture.dtype)
    padded[:height, :width] = picture
    split = padded.reshape(down, TILE_PX, across, TILE_PX, channels).transpose(0, 2, 4, 1, 3)
    return np.ascontiguousarray(split).reshape(down * across, channels, AREA)


def untiled(tiles: NDArray[Any], width: int, height: int) -> NDArray[Any]:
    """The picture [H,W,C] of tiles [tiles,C,AREA]."""
    down, across = -(-height // TILE_PX), -(-width // TILE_PX)
    split = tiles.reshape(down, across, tiles.shape[1], TILE_PX, TILE_PX).transpose(0, 3, 1, 4, 2)
    return np.ascontiguousarray(split.reshape(down * TILE_PX, across * TILE_PX, -1)[:height, :width])


def near_depth(bounds: NDArray[Any]) -> float:
    """The depth from which splats are drawn: nearer ones would be smeared over the picture. World units."""
    return NEAR_HALF_DIAGONALS * 0.5 * float(np.linalg.norm(bounds[1] - bounds[0]))
