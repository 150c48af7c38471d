"""Epipolar error of given poses and intrinsics, in pixels, measured by feature matches of photo pairs.

Notation: o_i is a camera's position, d_i the unit world direction of a feature. A match of d_i and d_j of two
cameras has the epipolar plane normal n = d_i x (o_j - o_i), made unit, and the error f_j |n . d_j| pixels,
the larger one of both ways round. Matches are those of one two-view geometry that RANSAC finds without the
given poses, so that wrong poses cannot choose the matches that suit them.

Source: Hartley and Zisserman, "Multiple View Geometry" (2004), chapters 9 and 11.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.datasets.natural_order import natural_key
from cagefield.datasets.sfm import features
from cagefield.datasets.views import View

FloatArray = npt.NDArray[np.float64]
OnProgress = Callable[[float, str], None]

LONGER_SIDE_PIXELS = 800
"""Longer side of the photos that are compared; errors are in pixels of this size."""

MAX_MEASURED_FEATURES = 1500
"""Maximum number of features of a photo."""

MAX_MEASURED_PHOTOS = 100
"""Maximum number of compared photos, evenly among all."""

NEIGHBOR_RANKS = (0, 2, 4)
"""Ranks of the cameras, by distance in pose, that each is compared with."""

SEQUENCE_STEPS = (1, 2)
"""Offsets in the order of names of the photos that each is compared with."""

MIN_GEOMETRY_INLIERS = 20
"""Minimum number of matches of one two-view geometry for a pair to count."""

MAX_ANGLE_RATIO = 0.8
"""Maximum ratio of the angles to the nearest and to the second nearest descriptor (Lowe, 2004)."""

MAX_RANSAC_ERROR_PIXELS = 2.0
MAX_RANSAC_TRIALS = 1000

PHOTO_QUANTILE = 0.3
"""Quantile of a photo's pair errors that is the photo's error: repeated structure falsifies some pairs."""

MAX_MEDIAN_PIXELS = 0.9
"""Maximum median of the photos' errors of right poses, which have .15 to .65."""

MAX_TENTH_PIXELS = 4.0
"""Maximum 90 % quantile of the photos' errors of right poses, which have up to 1."""

MAX_PAIR_PIXELS = 8.0
"""Cap of a pair's error in the mean over pairs, so that false matches have a bounded weight."""

CONTRADICTED_PIXELS = 3.0
"""Minimum error of a pair whose photos contradict the poses."""

MIN_MATCHED_SHARE = 0.3
"""Minimum share of the photos with a pair, for a measurement."""

MAX_FOCAL_SPREAD = 0.03
"""Maximum spread of the focal lengths of photos of one size and one lens (80 % of them, over the median)."""

_OPENGL_TO_OPENCV = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True, eq=False)
class PhotoMatches:
    """Feature matches of V photos that agree with one two-view geometry for each pair.

    Attributes:
        names: names of the views [V].
        sizes: (width, height) of each compared photo.
        pixels: positions of the matched features of each pair, ([K,2], [K,2]), pixels of the compared photos.
        pairs: numbers (i, j) of the photos of each pair.
        tried: number of pairs that were matched.
    """

    names: tuple[str, ...]
    sizes: tuple[tuple[int, int], ...]
    pairs: tuple[tuple[int, int], ...]
    pixels: tuple[tuple[FloatArray, FloatArray], ...]
    tried: int


@dataclass(frozen=True)
class PoseError:
    """Epipolar error of a capture's poses, in pixels of photos of `size` (longer side).

    Attributes:
        median: median of the photos' errors.
        tenth: 90 % quantile of the photos' errors.
        photos: number of photos with an error of their own.
        pairs: number of measured pairs of photos.
        size: longer side of the compared photos, in pixels.
        worst: name and error of the worst photo.
        capped: mean of the pairs' errors, each capped at MAX_PAIR_PIXELS; the measure by which corrections
            are compared.
        contradicted: share of the pairs above CONTRADICTED_PIXELS.
        focal_spread: largest spread of focal lengths among photos of one size that have one camera each, 0
            where cameras are shared.
    """

    median: float
    tenth: float
    photos: int
    pairs: int
    size: int
    worst: tuple[str, float]
    focal_spread: float = 0.0
    capped: float = 0.0
    contradicted: float = 0.0

    @property
    def is_wrong(self) -> bool:
        """Whether the error is more than a training can resolve."""
        return self.median > MAX_MEDIAN_PIXELS or self.tenth > MAX_TENTH_PIXELS

    @property
    def has_scattered_focals(self) -> bool:
        """Whether focal lengths of photos of one size differ by more than one lens explains."""
        return self.focal_spread > MAX_FOCAL_SPREAD

    def __str__(self) -> str:
        """One line of text: median, 90 % quantile, number of photos and pairs."""
        return (
            f"median epipolar error {self.median:.2f} pixels at {self.size} pixels a side, "
            f"a tenth of the photos above {self.tenth:.2f} ({self.pairs} pairs of {self.photos} photos)"
        )


@dataclass(eq=False)
class _Photo:
    """Compared photo: its camera at that size, features [K,2], unit descriptors [K,128]."""

    camera: Camera
    features: FloatArray
    descriptors: npt.NDArray[np.float32] = field(repr=False)


def match_photos(views: Sequence[View], on_progress: OnProgress | None = None) -> PhotoMatches:
    """Match of neighboring photos: neighbors by the given poses and by the order of names.

    Raises DatasetError where a photo cannot be read.
    """
    ordered = sort_views(views)
    ordered = ordered[:: max(1, -(-len(ordered) // MAX_MEASURED_PHOTOS))]
    pycolmap = features.import_pycolmap()
    options = pycolmap.FeatureExtractionOptions(use_gpu=False, num_threads=1)
    options.sift.max_num_features = MAX_MEASURED_FEATURES
    options.sift.first_octave = 0
    with features.silence_log():
        extractor = pycolmap.FeatureExtractor.create(options, pycolmap.Device.cpu)
        photos = []
        for number, view in enumerate(ordered, start=1):
            photos.append(_photo(pycolmap, view, extractor))
            features.scale_progress(on_progress, 0.0, 0.7)(
                number / len(ordered), f"features of {number} photos"
            )
        pairs = neighbor_pairs([photo.camera for photo in photos])
        matched_pairs: list[tuple[int, int]] = []
        pixels: list[tuple[FloatArray, FloatArray]] = []
        for number, (i, j) in enumerate(pairs, start=1):
            match_rows = _match_pair(pycolmap, photos[i], photos[j])
            if len(match_rows) >= MIN_GEOMETRY_INLIERS:
                matched_pairs.append((i, j))
                pixels.append((photos[i].features[match_rows[:, 0]], photos[j].features[match_rows[:, 1]]))
            features.scale_progress(on_progress, 0.7, 1.0)(
                number / len(pairs), f"{number} of {len(pairs)} pairs"
            )
    return PhotoMatches(
        names=tuple(view.name for view in ordered),
        sizes=tuple((photo.camera.width, photo.camera.height) for photo in photos),
        pairs=tuple(matched_pairs),
        pixels=tuple(pixels),
        tried=len(pairs),
    )


def sort_views(views: Iterable[View]) -> list[View]:
    """Views in the order of their names, numbers in these by value."""
    return sorted(views, key=lambda view: natural_key(view.name))


def pose_error(matches: PhotoMatches, views: Sequence[View]) -> PoseError | None:
    """Epipolar error of the views' cameras at the matches; None where too few photos have matches."""
    by_name = {view.name: view for view in views}
    cameras = [
        by_name[name].camera.resized(*size) for name, size in zip(matches.names, matches.sizes, strict=True)
    ]
    errors: list[list[float]] = [[] for _ in cameras]
    all_errors = []
    for (i, j), (first, second) in zip(matches.pairs, matches.pixels, strict=True):
        error = float(np.median(epipolar_errors(cameras[i], cameras[j], first, second)))
        all_errors.append(error)
        errors[i].append(error)
        errors[j].append(error)
    measured = [n for n, photo_errors in enumerate(errors) if photo_errors]
    if len(measured) < max(2, MIN_MATCHED_SHARE * len(cameras)):
        return None
    values = np.array([np.quantile(errors[n], PHOTO_QUANTILE) for n in measured])
    worst = int(np.argmax(values))
    return PoseError(
        median=float(np.median(values)),
        tenth=float(np.quantile(values, 0.9)),
        photos=len(measured),
        pairs=len(matches.pairs),
        size=max(map(max, matches.sizes)),
        worst=(matches.names[measured[worst]], float(values[worst])),
        focal_spread=focal_spread([view.camera for view in views]),
        capped=float(np.mean(np.minimum(all_errors, MAX_PAIR_PIXELS))),
        contradicted=float(np.mean(np.array(all_errors) > CONTRADICTED_PIXELS)),
    )


def epipolar_errors(one: Camera, other: Camera, first: FloatArray, second: FloatArray) -> FloatArray:
    """Epipolar errors [K], in pixels, of matched pixels `first` [K,2] of camera `one` and `second` of camera
    `other`.

    For cameras in one place the epipolar plane is undefined, and the error is the angle between both rays.
    """
    a, b = _directions(one, first), _directions(other, second)
    baseline = other.origin - one.origin
    errors = np.zeros(len(first))
    for d, e, camera in ((a, b, other), (b, a, one)):
        normal = np.cross(d, baseline)
        length = np.linalg.norm(normal, axis=1)
        sine = np.abs(np.einsum("ni,ni->n", normal, e)) / np.maximum(length, 1e-300)
        sine_between = np.linalg.norm(np.cross(d, e), axis=1)
        errors = np.maximum(
            errors, camera.fx * np.where(length > 1e-9 * np.linalg.norm(baseline), sine, sine_between)
        )
    return errors


def focal_spread(cameras: Sequence[Camera]) -> float:
    """Largest spread of the focal lengths of cameras of one size and lens, over their median.

    The spread is the difference of the 10 % and the 90 % quantile. 0 where fewer than half of the cameras of
    a size have intrinsics of their own: the file then says which photos share a camera.
    """
    largest = 0.0
    for size in {(camera.width, camera.height, camera.model) for camera in cameras}:
        group = [camera for camera in cameras if (camera.width, camera.height, camera.model) == size]
        focals = np.array([camera.fx for camera in group])
        if len(group) >= 4 and len(set(focals.tolist())) > len(group) // 2:
            low, middle, high = np.quantile(focals, (0.1, 0.5, 0.9))
            largest = max(largest, float((high - low) / middle))
    return largest


def neighbor_pairs(cameras: Sequence[Camera]) -> list[tuple[int, int]]:
    """Pairs (i, j), i < j, of cameras near each other in pose or in order."""
    count = len(cameras)
    origins = np.stack([camera.origin for camera in cameras])
    forward = np.stack([camera.forward for camera in cameras])
    spread = float(np.median(np.linalg.norm(origins - np.median(origins, axis=0), axis=1))) or 1.0
    angle = np.degrees(np.arccos(np.clip(forward @ forward.T, -1.0, 1.0)))
    score = angle / 45.0 + np.linalg.norm(origins[:, None] - origins[None], axis=2) / spread
    np.fill_diagonal(score, np.inf)
    pairs = {(i, i + step) for i in range(count) for step in SEQUENCE_STEPS if i + step < count}
    for i in range(count):
        order = np.argsort(score[i], kind="stable")
        pairs |= {
            (min(i, j), max(i, j)) for rank in NEIGHBOR_RANKS if rank < count - 1 for j in [int(order[rank])]
        }
    return sorted(pairs)


def _photo(pycolmap: Any, view: View, extractor: Any) -> _Photo:
    pixels = view.load()
    gray = Image.fromarray(np.ascontiguousarray(pixels[..., :3])).convert("L")
    scale = min(1.0, LONGER_SIDE_PIXELS / max(gray.size))
    size = max(1, round(gray.width * scale)), max(1, round(gray.height * scale))
    if size != gray.size:
        gray = gray.resize(size, Image.Resampling.BOX)
    keypoints, descriptors = extractor.extract_from_uint8_array(np.ascontiguousarray(np.asarray(gray)))
    positions = np.asarray(pycolmap.keypoints_to_matrix(keypoints), np.float64)[:, :2]
    is_used = np.ones(len(positions), dtype=bool)
    valid = view.valid_pixels()
    if pixels.shape[2] == 4:
        opaque = pixels[..., 3] > 127
        valid = opaque if valid is None else valid & opaque
    if valid is not None and len(positions):
        mask_pixels = (positions * (valid.shape[1] / size[0], valid.shape[0] / size[1])).astype(np.intp)
        mask_pixels = np.clip(mask_pixels, 0, (valid.shape[1] - 1, valid.shape[0] - 1))
        is_used = valid[mask_pixels[:, 1], mask_pixels[:, 0]]
    rows = np.asarray(descriptors.data, np.float32)[is_used]
    rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-9)
    return _Photo(view.camera.resized(*size), positions[is_used], rows)


def _match_pair(pycolmap: Any, one: _Photo, other: _Photo) -> npt.NDArray[np.intp]:
    """Rows (i, j) [K,2] of the matches that agree with one two-view geometry."""
    no_matches = np.zeros((0, 2), dtype=np.intp)
    if min(len(one.features), len(other.features)) < MIN_GEOMETRY_INLIERS:
        return no_matches
    cosines = one.descriptors @ other.descriptors.T
    rows = np.arange(len(cosines))
    best, reverse_best = cosines.argmax(axis=1), cosines.argmax(axis=0)
    nearest = cosines[rows, best]
    cosines[rows, best] = -1.0
    second = cosines.max(axis=1)
    ratio = np.arccos(np.clip(nearest, -1.0, 1.0)) < MAX_ANGLE_RATIO * np.arccos(np.clip(second, -1.0, 1.0))
    mutual = np.flatnonzero(ratio & (reverse_best[best] == rows))
    if len(mutual) < MIN_GEOMETRY_INLIERS:
        return no_matches
    options = pycolmap.TwoViewGeometryOptions(detect_watermark=False)
    options.ransac.random_seed = 0
    options.ransac.max_error = MAX_RANSAC_ERROR_PIXELS
    options.ransac.max_num_trials = MAX_RANSAC_TRIALS
    undistorted = [_undistort_pixels(photo.camera, photo.features) for photo in (one, other)]
    geometry = pycolmap.estimate_two_view_geometry(
        _pinhole(pycolmap, one.camera),
        undistorted[0],
        _pinhole(pycolmap, other.camera),
        undistorted[1],
        np.stack([mutual, best[mutual]], axis=1).astype(np.uint32),
        options,
    )
    return np.asarray(geometry.inlier_matches, dtype=np.intp).reshape(-1, 2)


def _undistort_pixels(camera: Camera, pixels: FloatArray) -> FloatArray:
    """Pixels [K,2] of the lens without its distortion; pixels beyond 80 degrees off the axis are clamped."""
    if camera.model == "pinhole":
        return pixels
    local = _local_directions(camera, pixels)
    plane = local[:, :2] / np.maximum(local[:, 2:], 0.17)
    return np.asarray(plane * (camera.fx, camera.fy) + (camera.cx, camera.cy))


def _pinhole(pycolmap: Any, camera: Camera) -> Any:
    params = [camera.fx, camera.fy, camera.cx, camera.cy]
    return pycolmap.Camera(model="PINHOLE", width=camera.width, height=camera.height, params=params)


def _local_directions(camera: Camera, pixels: FloatArray) -> FloatArray:
    image = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    return lenses.unproject(image, camera.model, camera.distortion)[0]


def _directions(camera: Camera, pixels: FloatArray) -> FloatArray:
    """Unit world directions [K,3] of pixels [K,2]."""
    return np.asarray(_local_directions(camera, pixels) * _OPENGL_TO_OPENCV @ camera.c2w[:3, :3].T)
