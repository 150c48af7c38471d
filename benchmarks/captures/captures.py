"""Real captures and the built-in rooms: pictures, depth and fog of trained fields in held-out photos.

A held-out photo sees sparse points; a point at the distance t* along the ray of its pixel has the depth error
|t - t*| / t*, t the picture's expected distance there, and is in fog where more than FOGGY of opacity lies
before NEARER of t*. Where the true depth of held-out photos is known (DATA/depth/NAME.npy), the same over the
whole picture. Points that fewer than two training photos see are no part of the training.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.train_captures import Learnt
from benchmarks.common.tables import Table, number
from cagefield.datasets import Dataset, View
from cagefield.datasets.photos import EXTENSIONS
from cagefield.datasets.views import SparsePoints
from cagefield.errors import CagefieldError
from cagefield.files.npz import read_array
from cagefield.images.image_files import side_by_side, write_png
from cagefield.images.metrics import correct_colors
from cagefield.images.render_result import RenderResult
from cagefield.training.evaluation import (
    Evaluation,
    ViewMetrics,
    collect_metrics,
    composite_on_white,
    evaluate_image,
)
from cagefield.typing import Array, Float32

NEARER, FOGGY = 0.8, 0.1

TRAIN_VIEWS = 10
"""Training photos on which the PSNR is taken, evenly spread."""

TRUE_RAYS = 2000
"""Rays of a photo, evenly spread, on which the true depth is compared."""

DERIVED = ("depth", "normal", "mask", "confidence")
"""Words in names of pictures beside photos that are no photos."""

_COLUMNS = (
    "capture", "field", "photos", "held out", "left out", "size", "seconds", "elements", "train PSNR",
    "train, corrected", "PSNR", "corrected", "SSIM", "worst view", "pose error", "points", "depth error",
    "90 %", "fog", "true depth", "true 90 %", "true fog", "memory",
)  # fmt: skip
_SHOWN = ("capture", "field", "train PSNR", "PSNR", "corrected", "SSIM", "worst view", "pose error", "fog")


@dataclass(frozen=True)
class DepthFigures:
    """Of some rays: median and 90 % of the relative depth error, the share in fog; NaN where none are."""

    rays: int = 0
    median: float = float("nan")
    high: float = float("nan")
    fog: float = float("nan")


@dataclass(frozen=True)
class CaptureScore:
    """The figures of one field on one capture.

    photos      number of training photos; left_out: of photos beside them that are in no split
    pose_error  epipolar error of the poses in pixels, as given and after they were verified; None where
                nobody measured it
    """

    name: str
    kind: str
    photos: int
    held_out: int
    size: tuple[int, int]
    seconds: float
    elements: int
    train: Evaluation
    test: Evaluation
    points: DepthFigures
    truth: DepthFigures
    left_out: int = 0
    pose_error: tuple[float, float] | None = None
    memory: float = float("nan")


def measure(dataset: Dataset, learnt: Learnt, points: SparsePoints | None = None) -> CaptureScore:
    """The score of a field trained on the data set; `points` with their sightings, None where there are none.

    Raises CagefieldError where no photo is held out.
    """
    if not dataset.test:
        raise CagefieldError(f"data set {dataset.name} has no held-out photos; choose another --holdout")
    some = dataset.train[:: -(-len(dataset.train) // TRAIN_VIEWS)]
    train = collect_metrics([_figures_of(view, learnt.show(view.camera)) for view in some])
    test: list[ViewMetrics | None] = []
    at_points, true = [], []
    for view in dataset.test:
        frame = learnt.show(view.camera)
        test.append(_figures_of(view, frame))
        if points is not None:
            at_points.append(_depths(view, frame, learnt, *_point_rays(view, points)))
        known = true_depth(dataset, view)
        if known is not None:
            true.append(_depths(view, frame, learnt, *_spread_rays(known)))
    camera = dataset.test[0].camera
    return CaptureScore(
        dataset.name,
        learnt.kind,
        len(dataset.train),
        len(dataset.test),
        (camera.width, camera.height),
        learnt.seconds,
        learnt.elements,
        train,
        collect_metrics(test),
        _figures(at_points),
        _figures(true),
        left_out_photos(dataset),
    )


def left_out_photos(dataset: Dataset) -> int:
    """Number of photos that lie beside those of the data set, in the same folders, and belong to no split.

    Masks, pictures named as one of DERIVED (NeRF-synthetic's r_0_depth_0001.png) and hidden files are none.
    """
    views = (*dataset.train, *dataset.test, *dataset.val)
    known = {view.image_path for view in views} | {view.mask.path for view in views if view.mask is not None}
    beside = {path for folder in {view.image_path.parent for view in views} for path in folder.iterdir()}
    return sum(
        path.suffix.lower() in EXTENSIONS
        and not path.name.startswith(".")
        and not any(word in path.stem.lower() for word in DERIVED)
        for path in beside - known
    )


def sighted_points(dataset: Dataset) -> SparsePoints | None:
    """The data set's sparse points with the photos that see them, None where nobody knows.

    Where the data set's own have no sightings, those of a COLMAP model in its folder, moved into its world.
    """
    if dataset.points is not None and dataset.points.seen_by:
        return dataset.points
    from cagefield.datasets.colmap.colmap_model import find_model, load_colmap

    folder = find_model(dataset.path) if dataset.path.is_dir() else None
    if folder is None:
        return None
    model = load_colmap(folder, dataset.test[0].downscale if dataset.test else None, 0)
    if model.points is None or not model.points.seen_by:
        return None
    names: dict[str, str] = {}
    for view in (*dataset.train, *dataset.test, *dataset.val):
        names[PurePosixPath(view.name).name] = view.name
    back = dataset.source_to_world @ np.linalg.inv(model.source_to_world)
    seen = tuple(
        frozenset(names[base] for name in those if (base := PurePosixPath(name).name) in names)
        for those in model.points.seen_by
    )
    positions = model.points.positions @ back[:3, :3].T + back[:3, 3]
    return dataclasses.replace(model.points, positions=positions, seen_by=seen)


def for_training(dataset: Dataset, points: SparsePoints | None) -> Dataset:
    """The data set with those points alone that two training photos see; as it is where `points` is None."""
    if points is None:
        return dataset
    training = {view.name for view in dataset.train}
    known = np.array([len(names & training) >= 2 for names in points.seen_by], bool)
    return dataclasses.replace(dataset, points=points.take(known) if known.any() else None)


def true_depth(dataset: Dataset, view: View) -> Float32 | None:
    """The true distances [H,W] along the rays of a photo, at the camera's size; None where nobody knows."""
    path = dataset.path / "depth" / f"{PurePosixPath(view.name).stem}.npy"
    if not path.is_file():
        return None
    try:
        depth: Float32 = read_array(path)
    except (OSError, ValueError) as error:
        raise CagefieldError(f"{path}: cannot be read as distances ({error!s:.120}); copy it again") from None
    step, camera = view.downscale, view.camera
    some = depth[step // 2 :: step, step // 2 :: step][: camera.height, : camera.width]
    if some.shape != (camera.height, camera.width):
        raise CagefieldError(
            f"{path} has {depth.shape[1]}x{depth.shape[0]} distances; its photo shrunk by {step} is "
            f"{camera.width}x{camera.height}"
        )
    return some


def _figures_of(view: View, frame: RenderResult) -> ViewMetrics | None:
    return evaluate_image(view.name, frame.rgb, composite_on_white(view.load()), view.valid_pixels())


def _point_rays(view: View, points: SparsePoints) -> tuple[NDArray[np.int64], Array]:
    """(pixels [K,2], distances [K]) of the points that a photo sees."""
    rows = np.array([view.name in names for names in points.seen_by], bool)
    positions = points.positions[rows]
    at, ahead = view.camera.project(positions) if len(positions) else (np.empty((0, 2)), np.empty(0))
    with np.errstate(invalid="ignore"):
        inside = (
            (ahead > 0) & (at >= 0).all(axis=1) & (at < (view.camera.width, view.camera.height)).all(axis=1)
        )
    return at[inside].astype(np.int64), np.linalg.norm(positions[inside] - view.camera.origin, axis=1)


def _spread_rays(depth: Float32) -> tuple[NDArray[np.int64], Array]:
    """(pixels [K,2], distances [K]) of at most TRUE_RAYS pixels on a square lattice."""
    step = max(1, int(np.ceil(np.sqrt(depth.size / TRUE_RAYS))))
    rows, columns = np.meshgrid(
        np.arange(step // 2, depth.shape[0], step), np.arange(step // 2, depth.shape[1], step), indexing="ij"
    )
    known = np.isfinite(depth[rows, columns])
    rows, columns = rows[known], columns[known]
    return np.stack([columns, rows], 1), depth[rows, columns].astype(np.float64)


def _depths(
    view: View, frame: RenderResult, learnt: Learnt, pixels: NDArray[np.int64], distances: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """(relative depth errors [K], whether the rays [K] are in fog)."""
    if not len(pixels):
        return np.empty(0), np.empty(0, bool)
    found = frame.depth[pixels[:, 1], pixels[:, 0]].astype(np.float64)
    opacity = learnt.opacity_before(view.camera, pixels, NEARER * distances)
    return np.abs(found - distances) / distances, np.asarray(opacity) > FOGGY


def _figures(rays: Sequence[tuple[Array, NDArray[np.bool_]]]) -> DepthFigures:
    errors = np.concatenate([error for error, _ in rays]) if rays else np.empty(0)
    if not len(errors):
        return DepthFigures()
    fog = np.concatenate([foggy for _, foggy in rays])
    median, high = np.quantile(errors, (0.5, 0.9), method="inverted_cdf")
    return DepthFigures(len(errors), float(median), float(high), float(fog.mean()))


def table(scores: Sequence[CaptureScore], notes: Sequence[str] = ()) -> Table:
    """The scores as a table, with what its columns mean."""
    explained = (
        "PSNR (dB) and SSIM: mean over held-out photos, never trained on, over pixels that no mask excludes; "
        f"train: over {TRAIN_VIEWS} training photos; worst view: the held-out photo of the lowest PSNR. "
        "Corrected: after an affine map of each color channel, fitted to the photo by least squares over "
        "unsaturated pixels: exposure and white balance of held-out photos are not known to the trainer.",
        "Left out: photos in the same folders that are in no split. Pose error: median distance in pixels of "
        "matches to their epipolar lines, of the poses as given -> as trained with.",
        "Depth error: at the sparse points that held-out photos see, |t - t*| / t* of the distance along the "
        f"ray, median and 90 %; fog: the share of those rays with more than {FOGGY:g} opacity before "
        f"{NEARER:g} t*. Points that fewer than two training photos see are not trained with.",
        "True: the same on pixels all over the held-out photos, where the true depth is known.",
        "Elements: splats or voxels. Memory: the most that the process held, trained and measured.",
    )
    return Table(
        "Captures", _COLUMNS, tuple(_row(score) for score in scores), (*explained, *notes), 2, _SHOWN
    )


def _row(score: CaptureScore) -> tuple[str, ...]:
    def percent(value: float) -> str:
        return "-" if np.isnan(value) else f"{number(100 * value, 1)}%"

    points, truth, worst = score.points, score.truth, score.test.worst
    return (
        score.name,
        score.kind,
        str(score.photos),
        str(score.held_out),
        str(score.left_out),
        f"{score.size[0]}x{score.size[1]}",
        number(score.seconds, 0),
        str(score.elements),
        number(score.train.psnr),
        number(score.train.corrected),
        number(score.test.psnr),
        number(score.test.corrected),
        number(score.test.ssim, 4),
        "-" if worst is None else f"{number(worst.psnr)} ({PurePosixPath(worst.name).name})",
        "-" if score.pose_error is None else " -> ".join(number(error) for error in score.pose_error),
        str(points.rays) if points.rays else "-",
        percent(points.median),
        percent(points.high),
        percent(points.fog),
        percent(truth.median),
        percent(truth.high),
        percent(truth.fog),
        "-" if np.isnan(score.memory) else f"{score.memory:.1f} GiB",
    )


def write_pictures(
    dataset: Dataset, learnt: Learnt, folder: Path, views: int = 4, times: float = 3.0
) -> list[Path]:
    """Writes photo, picture (color-corrected), difference and depth of some held-out photos side by side.

    The difference is dark and `times` as strong; the depth is that of the picture, near is dark.
    """
    written = []
    for view in dataset.test[:: -(-len(dataset.test) // views)]:
        photo, frame = composite_on_white(view.load()), learnt.show(view.camera)
        picture = correct_colors(np.clip(frame.rgb, 0, 1), photo, view.valid_pixels())
        difference = 1 - np.minimum(times * np.abs(picture - photo).max(-1, keepdims=True), 1)
        known = true_depth(dataset, view)
        panels = [photo, picture, np.repeat(difference, 3, -1), _grey(frame.depth, known)]
        if known is not None:
            panels.append(_grey(known, known))
        path = folder / f"{dataset.name}_{learnt.kind}_{PurePosixPath(view.name).stem}.png"
        write_png(path, side_by_side(*(panel.astype(np.float32) for panel in panels)))
        written.append(path)
    return written


def _grey(depth: NDArray[Any], known: NDArray[Any] | None) -> Float32:
    """A picture [H,W,3] of distances, by logarithm between the 2nd and the 98th percent of what is known."""
    scale = depth if known is None else known
    scale = scale[np.isfinite(scale) & (scale > 0)]
    low, high = np.log(np.quantile(scale, (0.02, 0.98))) if len(scale) else (0.0, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (np.log(depth) - low) / max(high - low, 1e-6)
    return np.repeat(np.clip(np.nan_to_num(share, nan=0.0), 0, 1)[..., None], 3, -1).astype(np.float32)


def forget_memory() -> None:
    """Starts the peak of the process's memory anew, where the system lets it."""
    try:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    except OSError:
        return


def peak_memory() -> float:
    """Most memory that the process held since `forget_memory`, or else since it began, in GiB."""
    try:
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) / 2**20
    except OSError:
        pass
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 2**30 if sys.platform == "darwin" else peak / 2**20
