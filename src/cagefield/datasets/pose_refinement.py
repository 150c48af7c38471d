"""Bundle adjustment of given poses and intrinsics: COLMAP's, by pycolmap, on the CPU.

Matches are verified without the given poses. Points are triangulated with the given poses under a loose
bound of the reprojection error; then bundle adjustments of poses, intrinsics and points, each with a tighter
bound, and a triangulation anew between them.

Photos of one size share their intrinsics, unless the given ones group them otherwise (`camera_groups`). A
robust similarity takes the result back to the given world (`pose_alignment`).

Source: Schönberger and Frahm, "Structure-from-Motion Revisited" (2016); Cauchy's loss as in Triggs et al.,
"Bundle Adjustment, A Modern Synthesis" (2000).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.cameras import Camera
from cagefield.datasets import features, triangulation
from cagefield.datasets.colmap import camera_of, pose_of
from cagefield.datasets.features import OnProgress, Photo
from cagefield.datasets.matching import match
from cagefield.datasets.pose_alignment import Similarity, align_poses
from cagefield.datasets.pose_check import SEQUENCE_STEPS
from cagefield.datasets.views import SparsePoints, View
from cagefield.temporary_folders import TemporaryFolder

FloatArray = npt.NDArray[np.float64]

MAX_FEATURES = 4096

MIN_OPENCV_PHOTOS = 12
"""Photos that share a camera, from which on its lens has tangential distortion and two radial terms."""

FIRST_BOUNDS_PIXELS = (12.0, 80.0)
"""Least and largest bound of the reprojection error in the first round, pixels of the shrunk photos."""

LAST_BOUND_PIXELS = 3.0
"""Bound of the reprojection error in the last round."""

ROUNDS = 4

MIN_OBSERVATIONS = 15
"""Observed points that a photo must have for its new pose to count."""

MIN_PLACED_SHARE = 0.9
"""Share of the photos that must keep enough observations."""


@dataclass(frozen=True, eq=False)
class RefinedPoses:
    """New cameras of a capture, in its given world where `alignment` is there.

    Attributes:
        cameras: camera at the photo's full size, by name of the view.
        points: sparse points of the reconstruction.
        reprojection_error: mean, pixels of the full-size photos.
        alignment: similarity from the reconstruction to the given world; None where poses agree too little.
    """

    cameras: dict[str, Camera]
    points: SparsePoints | None
    reprojection_error: float
    alignment: Similarity | None


def refine_poses(
    views: Sequence[View],
    expected_error: float,
    *,
    on_progress: OnProgress | None = None,
    seed: int = 0,
) -> RefinedPoses | None:
    """Bundle-adjusted cameras of full-size `views`; None where too few photos keep enough observations.

    `expected_error` is the usual epipolar error of the given poses as a share of a photo's longer side.

    Raises DatasetError where a photo cannot be read, StoppedError where COLMAP fails.
    """
    pycolmap = features.engine()
    with TemporaryFolder("points") as folder:
        shrunk, names = triangulation.shrink_views(views, folder, on_progress)
        numbers, cameras = _shared_cameras(pycolmap, [one.camera for one in shrunk])
        database = folder / "database.db"
        features.create_database(
            database, cameras, [Photo(n, c) for n, c in zip(names, numbers, strict=True)]
        )
        triangulation.extract_features(
            database, folder, names, MAX_FEATURES, features.share(on_progress, 0.05, 0.35)
        )
        near = triangulation.nearest_pairs([one.camera for one in shrunk])
        in_order = [(i, i + k) for i in range(len(names)) for k in SEQUENCE_STEPS if i + k < len(names)]
        matching = features.share(on_progress, 0.35, 0.7)
        match(database, names, sorted({*near, *in_order}), verify=True, seed=seed, on_progress=matching)
        center, scale = triangulation.normalization([one.camera for one in shrunk])
        model = triangulation.posed_model(pycolmap, cameras, numbers, shrunk, names, center, scale)
        side = max(max(one.camera.width, one.camera.height) for one in shrunk)
        first = float(np.clip(4.0 * expected_error * side, *FIRST_BOUNDS_PIXELS))
        for number, bound in enumerate(np.geomspace(first, LAST_BOUND_PIXELS, ROUNDS)):
            model = triangulation.triangulated(
                pycolmap, model, database, folder, f"round-{number}", bound, least_photos=2, seed=seed
            )
            if not model.num_points3D():
                return None
            _adjust(pycolmap, model, bound)
            features.share(on_progress, 0.7, 1.0)(
                (number + 1) / ROUNDS, f"bundle adjustment {number + 1} of {ROUNDS}"
            )
        return _collected(model, views, shrunk, center, scale)


def camera_groups(cameras: Sequence[Camera]) -> list[int]:
    """Number of the shared camera of each photo.

    Photos of one size and lens share one; where the given intrinsics are shared by at least two photos on
    average, those that share them do.
    """
    sizes = [(camera.width, camera.height, camera.model == "opencv_fisheye") for camera in cameras]
    intrinsics = [
        (*size, camera.fx, camera.fy, camera.cx, camera.cy, camera.distortion)
        for size, camera in zip(sizes, cameras, strict=True)
    ]
    grouped = 2 * len(set(intrinsics)) <= len(cameras)
    return features.consecutive(intrinsics if grouped else sizes)[1]


def _shared_cameras(pycolmap: Any, cameras: Sequence[Camera]) -> tuple[list[int], list[Any]]:
    """(camera number of each photo, COLMAP cameras with the groups' median intrinsics)."""
    numbers = camera_groups(cameras)
    shared = []
    for number in range(max(numbers) + 1):
        group = [camera for camera, n in zip(cameras, numbers, strict=True) if n == number]
        middle = np.median([[c.fx, c.fy, c.cx, c.cy] for c in group], axis=0)
        lens = np.median([(*c.distortion, 0.0, 0.0, 0.0, 0.0)[:4] for c in group], axis=0)
        if group[0].model == "opencv_fisheye":
            model, params = "OPENCV_FISHEYE", [*middle, *lens]
        elif len(group) >= MIN_OPENCV_PHOTOS or np.any(lens[1:]):
            model, params = "OPENCV", [*middle, *lens]
        else:
            model, params = "SIMPLE_RADIAL", [middle[:2].mean(), middle[2], middle[3], lens[0]]
        made = pycolmap.Camera(model=model, width=group[0].width, height=group[0].height, params=params)
        made.has_prior_focal_length = True
        shared.append(made)
    return numbers, shared


def _adjust(pycolmap: Any, model: Any, bound: float) -> None:
    """Bundle adjustment of everything, after which observations with more than half the bound are removed."""
    options = pycolmap.BundleAdjustmentOptions(print_summary=False)
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = max(1.0, 0.1 * bound)
    options.ceres.solver_options.max_num_iterations = 50
    options.ceres.solver_options.function_tolerance = 1e-5
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in model.reg_image_ids():
        config.add_image(image_id)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    with features.quiet():  # pycolmap.bundle_adjustment writes headings to stderr whatever the log's level
        pycolmap.create_default_bundle_adjuster(options, config, model).solve()
    manager = pycolmap.ObservationManager(model)
    manager.filter_all_points3D(max(LAST_BOUND_PIXELS, 0.5 * bound), 1.0)


def _collected(
    model: Any, views: Sequence[View], shrunk: Sequence[Any], center: FloatArray, scale: float
) -> RefinedPoses | None:
    images = {image_id - 1: model.image(image_id) for image_id in model.reg_image_ids()}
    placed = [n for n, image in images.items() if image.num_points3D >= MIN_OBSERVATIONS]
    if len(placed) < max(3, MIN_PLACED_SHARE * len(views)):
        return None
    poses = np.stack([pose_of(images[n]) for n in range(len(views))])
    given = np.stack([view.camera.c2w for view in views])
    alignment = align_poses(poses, given)
    to_world = alignment or Similarity(scale, np.eye(3), center)
    cameras = {}
    for number, view in enumerate(views):
        camera = camera_of(Path("refined"), model.camera(images[number].camera_id)).with_c2w(
            to_world.moved_pose(poses[number])
        )
        cameras[view.name] = camera.resized(view.camera.width, view.camera.height)
    points = triangulation.collect_points(model, shrunk, None, to_world)
    error = float(model.compute_mean_reprojection_error()) / float(np.mean([one.scale for one in shrunk]))
    return RefinedPoses(cameras, points, error, alignment)
