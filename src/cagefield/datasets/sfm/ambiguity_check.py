"""Detection of folded reconstructions: neighboring cameras whose photos show different things.

Structure from motion may take the front and the back of a can for one side and place the cameras of both at
the same position; its reprojection errors are small, yet no field can show two backgrounds in one place. The
check compares small images of neighboring cameras: each textured pixel of one image searches a similar pixel
in the other along its epipolar line, at a number of depths. In a correct model most pixels find one; in a
folded model only the pixels of the repeated object do, and pixels that match by chance, as often as in the
mirrored image.

`disambiguation` avoids such models where poses are found.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cagefield.cameras.camera import Camera
from cagefield.datasets.masks import shrink_mask
from cagefield.datasets.views import Dataset, View

FloatArray = npt.NDArray[np.float64]
OnProgress = Callable[[float, str], None]

MAX_SIDE_PIXELS = 72
"""Approximate longer side of the small images."""

MAX_COMPARED_PHOTOS = 120
"""Maximum number of compared photos, evenly among all."""

MAX_COMPARED_NEIGHBORS = 5
"""Maximum number of nearest cameras that each camera is compared with."""

MAX_TURN_RAD = np.radians(20.0)
"""Maximum angle between the viewing directions of neighbors."""

MAX_DISTANCE_DEPTHS = 0.3
"""Maximum distance of neighbors, over the median depth of the visible points."""

MIN_AGREEING_LIKENESS = 0.45
"""Minimum likeness of photos that agree: .57 to .9 in the usual good capture."""

MAX_CONTRADICTING_LIKENESS = 0.28
"""Likeness below which photos contradict each other."""

MIN_FOLDED_SHARE_INVERSE = 5
"""Inverse of the minimum share of photos, in a folded model, that agree with a neighbor and contradict
another.
"""

MIN_FOLDED_PHOTOS = 4
"""Minimum number of such photos."""

_WINDOW_PIXELS = 7  # pixels whose correlation is taken
_MIN_CORRELATION = 0.7
_MIN_CONTRAST = 4.0 / 255.0  # standard deviation in the window from which on there is texture
_DEPTH_COUNT_RANGE = (8, 32)  # that are tried, about one for each pixel of parallax
_MIN_TEXTURED_PIXELS = 100


@dataclass(frozen=True)
class Fold:
    """Evidence that a model is folded: photos of one place that show different things.

    Attributes:
        photos: number of photos that contradict a neighbor and agree with another.
        compared: number of photos compared.
        pair: names of the two that contradict each other most.
    """

    photos: int
    compared: int
    pair: tuple[str, str]


def check_ambiguity(dataset: Dataset, on_progress: OnProgress | None = None) -> Fold | None:
    """Evidence that the data set's poses are folded, None where there is none."""
    views = sorted((*dataset.train, *dataset.test), key=lambda view: view.name)
    views = views[:: max(1, -(-len(views) // MAX_COMPARED_PHOTOS))]
    images = [_SmallImage.from_view(view, *_depths(dataset, view.camera)) for view in views]
    pairs = neighbor_pairs(images)
    likenesses = np.empty(len(pairs))
    for k, (i, j) in enumerate(pairs):
        likenesses[k] = pair_likeness(images[i], images[j])
        if on_progress is not None:
            on_progress((k + 1) / len(pairs), f"{k + 1} of {len(pairs)} pairs of photos compared")
    contradicting_photos = find_contradicting_photos(pairs, likenesses, len(views))
    if len(contradicting_photos) < max(MIN_FOLDED_PHOTOS, len(views) / MIN_FOLDED_SHARE_INVERSE):
        return None
    worst = [k for k, (i, j) in enumerate(pairs) if i in contradicting_photos and j in contradicting_photos]
    known: FloatArray = np.nan_to_num(likenesses[worst], nan=1.0)
    i, j = pairs[worst[int(known.argmin())]]
    return Fold(len(contradicting_photos), len(views), (views[i].name, views[j].name))


def find_contradicting_photos(
    pairs: Sequence[tuple[int, int]], likenesses: FloatArray, count: int
) -> set[int]:
    """Numbers of the photos, of `count`, that agree with one neighbor and contradict another that agrees with
    one too.

    `likenesses` [P] belong to the pairs. A photo that agrees with none is blurred, or has a wrong pose of its
    own.
    """
    agrees = np.zeros(count, dtype=bool)
    for (i, j), likeness in zip(pairs, likenesses, strict=True):
        if likeness > MIN_AGREEING_LIKENESS:
            agrees[[i, j]] = True
    contradicting_pairs = {
        pair
        for pair, likeness in zip(pairs, likenesses, strict=True)
        if likeness < MAX_CONTRADICTING_LIKENESS and agrees[list(pair)].all()
    }
    return {index for pair in contradicting_pairs for index in pair}


@dataclass(frozen=True, eq=False)
class _SmallImage:
    """Small gray image [H,W] of a photo, its camera, and the near and the median depth in it, world units.

    `valid` [H,W]: pixels whose window no mask touches.
    """

    gray: FloatArray
    camera: Camera
    near: float
    median_depth: float
    valid: npt.NDArray[np.bool_]

    @classmethod
    def from_view(cls, view: View, near: float, median_depth: float) -> _SmallImage:
        """Small image of a view with the given near and median depths."""
        pixels = view.load()[..., :3].mean(axis=2) / 255.0
        factor = max(1, max(pixels.shape) // MAX_SIDE_PIXELS)
        height, width = pixels.shape[0] // factor, pixels.shape[1] // factor
        mask = view.valid_pixels()
        valid = shrink_mask(np.ones(pixels.shape, bool) if mask is None else mask, factor)
        blocks = pixels[: height * factor, : width * factor].reshape(height, factor, width, factor)
        return cls(
            blocks.mean(axis=(1, 3)),
            view.camera.downscaled(factor),
            near,
            median_depth,
            ndimage.minimum_filter(valid, _WINDOW_PIXELS),
        )


def _depths(dataset: Dataset, camera: Camera) -> tuple[float, float]:
    """(near, median) depth, world units, of the sparse points in the image, else estimated from the
    bounds.
    """
    if dataset.points is not None:
        pixels, depth = camera.project(dataset.points.positions)
        with np.errstate(invalid="ignore"):
            inside = (pixels >= 0).all(axis=1) & (pixels < (camera.width, camera.height)).all(axis=1)
        visible_depths = depth[inside & (depth > 0)]
        if len(visible_depths) >= 10:
            return 0.7 * float(np.quantile(visible_depths, 0.02)), float(np.median(visible_depths))
    median_depth = float(np.linalg.norm(np.mean(dataset.bounds, axis=0) - camera.origin))
    return 0.3 * median_depth, median_depth


def neighbor_pairs(images: Sequence[_SmallImage]) -> list[tuple[int, int]]:
    """Pairs (i, j), i < j, of cameras close to each other with similar viewing directions, each once."""
    origins = np.stack([image.camera.origin for image in images])
    forward = np.stack([image.camera.forward for image in images])
    pairs = set()
    for i, image in enumerate(images):
        angle = np.arccos(np.clip(forward @ forward[i], -1.0, 1.0))
        distance = np.linalg.norm(origins - origins[i], axis=1) / image.median_depth
        order = np.argsort(angle / MAX_TURN_RAD + distance / MAX_DISTANCE_DEPTHS, kind="stable")
        neighbors = [
            j
            for j in order.tolist()
            if j != i and angle[j] < MAX_TURN_RAD and distance[j] < MAX_DISTANCE_DEPTHS
        ]
        pairs |= {(min(i, j), max(i, j)) for j in neighbors[:MAX_COMPARED_NEIGHBORS]}
    return sorted(pairs)


def pair_likeness(one: _SmallImage, other: _SmallImage) -> float:
    """Share of the textured pixels of `one` that find a similar pixel in `other`: 0 by chance, 1 all; NaN for
    few pixels.
    """
    camera = one.camera
    height, width = one.gray.shape
    directions = _directions(camera)
    baseline = float(np.linalg.norm(camera.origin - other.camera.origin))
    count = int(np.clip(camera.fx * baseline / one.near, *_DEPTH_COUNT_RANGE))
    mean = _window_mean(one.gray)
    variance = _window_mean(one.gray**2) - mean**2
    images = [other.gray, np.ascontiguousarray(other.gray[:, ::-1])]
    best_correlation = np.full((2, height, width), -1.0)
    for inverse in np.linspace(1e-4, 1.0, count) / one.near:
        pixels, depth = other.camera.project(camera.origin + directions / inverse)
        with np.errstate(invalid="ignore"):
            inside = (pixels >= 0).all(axis=1) & (pixels < other.gray.shape[::-1]).all(axis=1) & (depth > 0)
        columns, rows = np.where(inside[:, None], pixels, 0.0).astype(np.intp).T
        inside &= other.valid[rows, columns]
        positions = np.where(inside[:, None], pixels, 0.0) - 0.5
        is_complete = ndimage.minimum_filter(inside.reshape(height, width), _WINDOW_PIXELS)
        for k, gray in enumerate(images):
            warped = ndimage.map_coordinates(
                gray, (positions[:, 1], positions[:, 0]), order=1, mode="nearest"
            )
            warped = warped.reshape(height, width)
            warped_mean = _window_mean(warped)
            product = variance * np.maximum(_window_mean(warped**2) - warped_mean**2, 0.0)
            correlation = (_window_mean(one.gray * warped) - mean * warped_mean) / np.sqrt(
                np.maximum(product, 1e-10)
            )
            best_correlation[k] = np.maximum(best_correlation[k], np.where(is_complete, correlation, -1.0))
    textured = one.valid & (best_correlation[0] > -1.0) & (variance > _MIN_CONTRAST**2)
    if textured.sum() < _MIN_TEXTURED_PIXELS:
        return float("nan")
    agreeing_share, mirrored_share = (best_correlation[:, textured] > _MIN_CORRELATION).mean(axis=1)
    return float((agreeing_share - mirrored_share) / max(1.0 - mirrored_share, 1e-3))


def _directions(camera: Camera) -> FloatArray:
    """Directions [H*W,3] of the pixels, of depth 1 along the camera's axis."""
    rays = camera.rays()[1].reshape(-1, 3).astype(np.float64)
    return rays / np.maximum(rays @ camera.forward, 0.05)[:, None]


def _window_mean(values: FloatArray) -> FloatArray:
    """Mean [H,W] over the window around each pixel."""
    return np.asarray(ndimage.uniform_filter(values, _WINDOW_PIXELS, mode="nearest"))
