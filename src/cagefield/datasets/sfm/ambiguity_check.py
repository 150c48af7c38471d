"""Models that lie folded: cameras side by side whose photos show different things.

Structure from motion takes the front and the back of a can for one side, and lays the cameras of both on each
other; its errors of reprojection are small, and no field can show two backgrounds in one place. Small
pictures of neighbouring cameras tell: each pixel of one that has texture looks for its like in the other
along its ray, at a number of depths. In a good model most find it, in a folded one those of the repeated
thing alone, and those that find something like it by chance; as many do in the other's mirror image.

`repeated_views` is what avoids such models where poses are found.
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

SIDE = 72
"""Pixels of the longer side of the small pictures, about."""

PHOTOS = 120
"""Photos that are compared, at most, evenly among all."""

NEIGHBOURS = 5
"""Cameras that each is compared with, at most: the nearest."""

TURN = np.radians(20.0)
"""Most that a neighbour is turned."""

REACH = 0.3
"""Most that a neighbour is away, in usual distances of what is seen."""

ALIKE = 0.45
"""Likeness from which on photos agree: .57 to .9 in the usual good capture."""

STRANGE = 0.28
"""Likeness under which they contradict each other."""

SHARE = 5
"""A model is folded where one photo of so many agrees with a neighbour and contradicts another."""

LEAST = 4
"""And at least so many photos."""

_WINDOW = 7  # pixels whose correlation is taken
_CORRELATED = 0.7
_CONTRAST = 4.0 / 255.0  # standard deviation in the window from which on there is texture
_DEPTHS = (8, 32)  # that are tried, about one for each pixel of parallax
_LEAST_PIXELS = 100


@dataclass(frozen=True)
class Fold:
    """What tells that a model is folded: photos of one place that show different things.

    Attributes:
        photos: number of photos that contradict a neighbour and agree with another.
        compared: number of photos compared.
        pair: names of the two that contradict each other most.
    """

    photos: int
    compared: int
    pair: tuple[str, str]


def find_fold(dataset: Dataset, on_progress: OnProgress | None = None) -> Fold | None:
    """What tells that the data set's poses are folded, or None where nothing does."""
    views = sorted((*dataset.train, *dataset.test), key=lambda view: view.name)
    views = views[:: max(1, -(-len(views) // PHOTOS))]
    pictures = [_Picture.of(view, *_depths(dataset, view.camera)) for view in views]
    pairs = neighbours(pictures)
    alike = np.empty(len(pairs))
    for k, (i, j) in enumerate(pairs):
        alike[k] = likeness(pictures[i], pictures[j])
        if on_progress is not None:
            on_progress((k + 1) / len(pairs), f"{k + 1} of {len(pairs)} pairs of photos compared")
    strange = contradicting(pairs, alike, len(views))
    if len(strange) < max(LEAST, len(views) / SHARE):
        return None
    worst = [k for k, (i, j) in enumerate(pairs) if i in strange and j in strange]
    i, j = pairs[min(worst, key=lambda k: np.nan_to_num(alike[k], nan=1.0))]
    return Fold(len(strange), len(views), (views[i].name, views[j].name))


def contradicting(pairs: Sequence[tuple[int, int]], alike: FloatArray, count: int) -> set[int]:
    """The photos, of `count`, that agree with a neighbour and contradict another that agrees with one too.

    `alike` [P] is the likeness of the pairs. A photo that agrees with none is blurred, or has a
    wrong pose of its own.
    """
    agrees = np.zeros(count, dtype=bool)
    for (i, j), one in zip(pairs, alike, strict=True):
        if one > ALIKE:
            agrees[[i, j]] = True
    strange = {
        pair for pair, one in zip(pairs, alike, strict=True) if one < STRANGE and agrees[list(pair)].all()
    }
    return {index for pair in strange for index in pair}


@dataclass(frozen=True, eq=False)
class _Picture:
    """A small grey picture [H,W] of a photo, its camera, and the least and the usual depth in it.

    `valid` [H,W]: pixels in whose window no mask excludes one.
    """

    grey: FloatArray
    camera: Camera
    near: float
    middle: float
    valid: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, view: View, near: float, middle: float) -> _Picture:
        pixels = view.load()[..., :3].mean(axis=2) / 255.0
        factor = max(1, max(pixels.shape) // SIDE)
        height, width = pixels.shape[0] // factor, pixels.shape[1] // factor
        mask = view.valid_pixels()
        valid = shrink_mask(np.ones(pixels.shape, bool) if mask is None else mask, factor)
        blocks = pixels[: height * factor, : width * factor].reshape(height, factor, width, factor)
        return cls(
            blocks.mean(axis=(1, 3)),
            view.camera.downscaled(factor),
            near,
            middle,
            ndimage.minimum_filter(valid, _WINDOW),
        )


def _depths(dataset: Dataset, camera: Camera) -> tuple[float, float]:
    """The least and the usual depth of the sparse points in the picture, else guessed by the bounds."""
    if dataset.points is not None:
        pixels, depth = camera.project(dataset.points.positions)
        with np.errstate(invalid="ignore"):
            inside = (pixels >= 0).all(axis=1) & (pixels < (camera.width, camera.height)).all(axis=1)
        seen = depth[inside & (depth > 0)]
        if len(seen) >= 10:
            return 0.7 * float(np.quantile(seen, 0.02)), float(np.median(seen))
    middle = float(np.linalg.norm(np.mean(dataset.bounds, axis=0) - camera.origin))
    return 0.3 * middle, middle


def neighbours(pictures: Sequence[_Picture]) -> list[tuple[int, int]]:
    """Pairs (i, j), i < j, of cameras close to each other that look the same way, each once."""
    origins = np.stack([picture.camera.origin for picture in pictures])
    forward = np.stack([picture.camera.forward for picture in pictures])
    found = set()
    for i, picture in enumerate(pictures):
        turn = np.arccos(np.clip(forward @ forward[i], -1.0, 1.0))
        away = np.linalg.norm(origins - origins[i], axis=1) / picture.middle
        order = np.argsort(turn / TURN + away / REACH, kind="stable")
        near = [j for j in order.tolist() if j != i and turn[j] < TURN and away[j] < REACH]
        found |= {(min(i, j), max(i, j)) for j in near[:NEIGHBOURS]}
    return sorted(found)


def likeness(one: _Picture, other: _Picture) -> float:
    """How many pixels of `one` with texture find their like in `other`: 0 by chance, 1 all; NaN of few."""
    camera = one.camera
    height, width = one.grey.shape
    directions = _directions(camera)
    baseline = float(np.linalg.norm(camera.origin - other.camera.origin))
    count = int(np.clip(camera.fx * baseline / one.near, *_DEPTHS))
    mean = _mean(one.grey)
    variance = _mean(one.grey**2) - mean**2
    pictures = [other.grey, np.ascontiguousarray(other.grey[:, ::-1])]
    best = np.full((2, height, width), -1.0)
    for inverse in np.linspace(1e-4, 1.0, count) / one.near:
        pixels, depth = other.camera.project(camera.origin + directions / inverse)
        with np.errstate(invalid="ignore"):
            inside = (pixels >= 0).all(axis=1) & (pixels < other.grey.shape[::-1]).all(axis=1) & (depth > 0)
        columns, rows = np.where(inside[:, None], pixels, 0.0).astype(np.intp).T
        inside &= other.valid[rows, columns]
        at = np.where(inside[:, None], pixels, 0.0) - 0.5
        whole = ndimage.minimum_filter(inside.reshape(height, width), _WINDOW)
        for k, grey in enumerate(pictures):
            seen = ndimage.map_coordinates(grey, (at[:, 1], at[:, 0]), order=1, mode="nearest")
            seen = seen.reshape(height, width)
            its_mean = _mean(seen)
            product = variance * np.maximum(_mean(seen**2) - its_mean**2, 0.0)
            correlation = (_mean(one.grey * seen) - mean * its_mean) / np.sqrt(np.maximum(product, 1e-10))
            best[k] = np.maximum(best[k], np.where(whole, correlation, -1.0))
    textured = one.valid & (best[0] > -1.0) & (variance > _CONTRAST**2)
    if textured.sum() < _LEAST_PIXELS:
        return float("nan")
    found, chance = (best[:, textured] > _CORRELATED).mean(axis=1)
    return float((found - chance) / max(1.0 - chance, 1e-3))


def _directions(camera: Camera) -> FloatArray:
    """Directions [H*W,3] of the pixels, of depth 1 along the camera's axis."""
    rays = camera.rays()[1].reshape(-1, 3).astype(np.float64)
    return rays / np.maximum(rays @ camera.forward, 0.05)[:, None]


def _mean(values: FloatArray) -> FloatArray:
    return np.asarray(ndimage.uniform_filter(values, _WINDOW, mode="nearest"))
