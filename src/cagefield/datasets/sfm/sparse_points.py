"""Sparse points that a training starts from: the data set's own, triangulated, or random points.

A point that held-out photos alone see would leak test data into a training: `training_points` leaves it out,
and points that are triangulated for a training come from its training photos alone.
"""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from cagefield.datasets.photos import read_header
from cagefield.datasets.sfm.features import OnProgress
from cagefield.datasets.sfm.triangulation import triangulate
from cagefield.datasets.views import Dataset, SparsePoints, View
from cagefield.errors import DatasetError
from cagefield.files.atomic import replaced_file
from cagefield.files.npz import read_arrays
from cagefield.files.safe_open import open_regular
from cagefield.files.stale_files import remove_unfinished
from cagefield.files.user_cache import cache_root

FloatArray = npt.NDArray[np.float64]
Views = Literal["train", "all"]

MIN_STARTING_POINTS = 50
"""Minimum number of points; fewer are discarded."""

_CACHE_VERSION = b"points 1"  # of the files; changes with the results of `triangulate`
_SAMPLE_BYTES = 1 << 16  # bytes hashed at the beginning and at the end of each photo
_MAX_COLOR_PHOTOS = 64  # whose pixels color random points, at most
_MIN_OPAQUE_ALPHA = 128  # alpha below which a pixel of a cut-out shows no surface
_MAX_DISTANCE_HALF_SIZES = 20.0  # half-sizes of the cube of interest to the farthest random point
_MAX_ROUNDS = 12
_MAX_CANDIDATES = 200_000  # random points in one round
_BALANCED_ROUNDS = 4  # rounds of random points after which the halves may differ


def starting_points(
    dataset: Dataset,
    cache: Path | None = None,
    *,
    views: Views = "train",
    on_progress: OnProgress | None = None,
    seed: int = 0,
) -> SparsePoints | None:
    """Data set's points, else points triangulated from its poses; None, after one warning, without any.

    `views` "train" takes no point that held-out photos alone see, and triangulates training photos alone;
    "all" is for measuring. Triangulated points are stored in the folder `cache` under a name that depends on
    photos, poses and seed, and read from there again; for None they are triangulated each time.
    """
    own_points = training_points(dataset) if views == "train" else dataset.points
    if own_points is not None and len(own_points) >= MIN_STARTING_POINTS:
        return own_points
    used_views = (
        dataset.train if views == "train" else (*dataset.train, *dataset.test, *_validation_views(dataset))
    )
    file = None if cache is None else cache / f"points-{capture_key(used_views, seed)}.npz"
    triangulated = None if file is None else read_cached_points(file)
    if triangulated is None:
        try:
            triangulated = triangulate(used_views, on_progress=on_progress, seed=seed)
        except DatasetError as error:
            warnings.warn(f"{dataset.path}: no points are made of the photos: {error}", stacklevel=2)
            return None
        if file is not None and triangulated is not None:
            write_cached_points(file, triangulated)
    if triangulated is None or len(triangulated) < MIN_STARTING_POINTS:
        count = 0 if triangulated is None else len(triangulated)
        warnings.warn(
            f"{dataset.path}: the photos give {count} points, too few to start from; poses may be wrong, or "
            "the photos have no texture",
            stacklevel=2,
        )
        return None
    return triangulated


def training_points(dataset: Dataset) -> SparsePoints | None:
    """Data set's points that at least two training views see, or all points where observations are
    unknown.
    """
    points = dataset.points
    if points is None or not points.seen_by:
        return points
    names = {view.name for view in dataset.train}
    return points.take(np.array([len(view_names & names) >= 2 for view_names in points.seen_by]))


def random_points(dataset: Dataset, count: int, seed: int = 0) -> SparsePoints:
    """`count` random positions that training views see, with the mean color of the pixels there.

    Bounded: uniform in the bounds, and for cut-outs nowhere that a photo shows as empty. Unbounded: half of
    them uniform in the cube of interest, half around it, uniform in direction and in 1/distance from the
    cube's faces to 20 times as far. Two views see each of them where the capture has such places, else one.
    The result has fewer than `count` points where the views see little of these regions.
    """
    if count < 1:
        raise DatasetError(f"count must be at least 1, got {count}")
    rng = np.random.default_rng(seed)
    photos = _TrainingPhotos(dataset)
    accepted: list[FloatArray] = []
    colors: list[FloatArray] = []
    tried_count, inside_count, accepted_count, min_views = 0, 0, 0, min(2, len(dataset.train))
    for attempt in range(_MAX_ROUNDS):
        acceptance = max(accepted_count / tried_count, 1e-3) if tried_count else 0.5
        candidates = _candidates(dataset, min(max(int(1.3 * count / acceptance), 1000), _MAX_CANDIDATES), rng)
        tried_count += len(candidates)
        view_counts, rgb = photos.count_views(candidates)
        is_seen = view_counts >= min_views
        if min_views > 1 and not is_seen.any() and attempt == 0:
            min_views, is_seen = 1, view_counts >= 1
        accepted.append(candidates[is_seen])
        colors.append(rgb[is_seen])
        inside = int(np.count_nonzero(_inside(dataset, candidates[is_seen])))
        inside_count, accepted_count = inside_count + inside, accepted_count + int(np.count_nonzero(is_seen))
        is_balanced = (
            not dataset.unbounded or min(inside_count, accepted_count - inside_count) >= (count + 1) // 2
        )
        if accepted_count >= count and (is_balanced or attempt + 1 >= _BALANCED_ROUNDS):
            break
    if not accepted_count:
        raise DatasetError(f"{dataset.path}: no camera sees the scene's bounds; check poses and bounds")
    positions, rgb = np.concatenate(accepted), np.concatenate(colors)
    chosen = (
        _balanced_rows(_inside(dataset, positions), count)
        if dataset.unbounded
        else np.arange(min(count, accepted_count))
    )
    return SparsePoints(positions[chosen], np.rint(rgb[chosen]).astype(np.uint8))


def points_cache_folder() -> Path:
    """Folder of triangulated points in the user's cache."""
    return cache_root() / "points"


def _inside(dataset: Dataset, positions: FloatArray) -> npt.NDArray[np.bool_]:
    low, high = dataset.bounds
    return np.asarray(np.all((positions >= low) & (positions <= high), axis=1))


def _balanced_rows(inside: npt.NDArray[np.bool_], count: int) -> npt.NDArray[np.intp]:
    """Rows of `count` points: half inside and half outside, or more of one kind where the other has
    too few.
    """
    inside_rows, outside_rows = np.flatnonzero(inside), np.flatnonzero(~inside)
    first = min(len(inside_rows), max(count // 2, count - len(outside_rows)))
    return np.concatenate([inside_rows[:first], outside_rows[: count - first]])


def _candidates(dataset: Dataset, count: int, rng: np.random.Generator) -> FloatArray:
    low, high = dataset.bounds
    if not dataset.unbounded:
        return rng.uniform(low, high, (count, 3))
    half = count // 2
    directions = rng.standard_normal((count - half, 3))
    directions /= np.abs(directions).max(axis=1, keepdims=True)  # to the faces of the cube [-1, 1]^3
    distant = directions / rng.uniform(1.0 / _MAX_DISTANCE_HALF_SIZES, 1.0, (count - half, 1))
    return np.concatenate(
        [rng.uniform(low, high, (half, 3)), 0.5 * (low + high) + 0.5 * (high - low) * distant]
    )


class _TrainingPhotos:
    """Pixels of some training photos, evenly among all."""

    def __init__(self, dataset: Dataset) -> None:
        step = max(1, -(-len(dataset.train) // _MAX_COLOR_PHOTOS))
        self._views = [(view.camera, view.load(), view.valid_pixels()) for view in dataset.train[::step]]

    def count_views(self, points: FloatArray) -> tuple[npt.NDArray[np.intp], FloatArray]:
        """(number [N] of photos that see each point, 0 where one shows it as empty; mean color [N,3] in
        them).
        """
        view_counts = np.zeros(len(points), dtype=np.intp)
        empty = np.zeros(len(points), dtype=bool)
        color_sums = np.zeros((len(points), 3))
        for camera, pixels, valid in self._views:
            positions, depth = camera.project(points)
            with np.errstate(invalid="ignore"):
                inside = np.all((positions >= 0) & (positions < (camera.width, camera.height)), axis=1)
            inside &= depth > 0 if camera.model != "opencv_fisheye" else np.isfinite(depth)
            rows = np.flatnonzero(inside)
            columns, lines = positions[rows].astype(np.intp).T
            if valid is not None:
                usable = valid[lines, columns]
                rows, columns, lines = rows[usable], columns[usable], lines[usable]
            point_colors = pixels[lines, columns]
            if point_colors.shape[1] == 4:
                empty[rows] |= point_colors[:, 3] < _MIN_OPAQUE_ALPHA
            view_counts[rows] += 1
            color_sums[rows] += point_colors[:, :3]
        return np.where(empty, 0, view_counts), color_sums / np.maximum(view_counts, 1)[:, None]


def _validation_views(dataset: Dataset) -> tuple[View, ...]:
    """Validation views that are not test views too."""
    known = {view.image_path for view in (*dataset.train, *dataset.test)}
    return tuple(view for view in dataset.val if view.image_path not in known)


def capture_key(views: Sequence[View], seed: int, version: bytes = _CACHE_VERSION) -> str:
    """Digest of photos, names, poses, lenses and seed, as 24 hexadecimal digits."""
    digest = hashlib.sha256(version + str(seed).encode())
    for view in views:
        header = read_header(view.image_path)
        camera = repr((view.name, view.camera.to_dict(), view.downscale, header, view.source))
        digest.update(camera.encode())
        for file in (view.image_path, *(() if view.mask is None else (view.mask.path,))):
            with open_regular(file) as stream:
                digest.update(stream.read(_SAMPLE_BYTES))
                size = stream.seek(0, os.SEEK_END)
                stream.seek(max(0, size - _SAMPLE_BYTES))
                digest.update(stream.read(_SAMPLE_BYTES) + str(size).encode())
    return digest.hexdigest()[:24]


def write_cached_points(file: Path, points: SparsePoints) -> None:
    """Write the file whole or not at all; an unwritable folder is ignored."""
    names = sorted({name for view_names in points.seen_by for name in view_names})
    numbers = {name: number for number, name in enumerate(names)}
    flat = [sorted(numbers[name] for name in view_names) for view_names in points.seen_by]
    remove_unfinished(file.parent)  # of any name: it has a digest's, that of a run which may not come again
    try:
        with replaced_file(file) as draft, draft.open("wb") as stream:
            np.savez(
                stream,
                positions=points.positions,
                rgb=points.rgb,
                errors=np.full(len(points), np.nan) if points.errors is None else points.errors,
                names=np.array(names, dtype=np.str_),
                counts=np.array([len(view_names) for view_names in flat], dtype=np.int64),
                seen=np.array([number for view_names in flat for number in view_names], dtype=np.int64),
            )
    except OSError:
        return


def read_cached_points(file: Path) -> SparsePoints | None:
    """Points of a file; None where it is missing or damaged."""
    try:
        arrays = read_arrays(file)
        names, counts, numbers = (arrays[name] for name in ("names", "counts", "seen"))
        kinds = "".join(array.dtype.kind for array in (names, counts, numbers, arrays["positions"]))
        if kinds != "Uiif" or any(array.ndim != 1 for array in (names, counts, numbers)):
            return None
        if len(counts) and (counts.min() < 0 or counts.max() > len(numbers)):
            return None
        if counts.sum() != len(numbers) or (len(numbers) and numbers.min() < 0):
            return None
        known, flat = names.tolist(), numbers.tolist()
        seen_by = tuple(
            frozenset(known[number] for number in flat[end - count : end])
            for count, end in zip(counts.tolist(), np.cumsum(counts).tolist(), strict=True)
        )
        return SparsePoints(arrays["positions"], arrays["rgb"], seen_by, arrays["errors"])
    except (OSError, ValueError, TypeError, KeyError, IndexError, OverflowError, DatasetError):
        return None
