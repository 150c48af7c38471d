"""Bundle adjustment of given poses and intrinsics, or new ones by structure from motion, by pycolmap.

Matches are verified without the given poses. Points are triangulated with the given poses under a loose
bound of the reprojection error; then bundle adjustments of poses, intrinsics and points, each with a tighter
bound, and a triangulation anew between them.

Photos of one size share their intrinsics, unless the given ones group them otherwise (`camera_groups`). The
photos are resampled to square pixels and have one focal length: cameras that are all held level do not
tell a wrong aspect of the pixels from a stretched scene. Tangential distortion, where the given lens has it,
is fitted last, with the focal length held. A robust similarity takes the result back to the given world
(`pose_alignment`).

Source: Schönberger and Frahm, "Structure-from-Motion Revisited" (2016); Cauchy's loss as in Triggs et al.,
"Bundle Adjustment, A Modern Synthesis" (2000).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.datasets.colmap.colmap_model import image_pose
from cagefield.datasets.sfm import features, triangulation
from cagefield.datasets.sfm.epipolar_error import SEQUENCE_STEPS
from cagefield.datasets.sfm.features import OnProgress, Photo
from cagefield.datasets.sfm.matching import match
from cagefield.datasets.sfm.pose_alignment import align_poses
from cagefield.datasets.sfm.registration_report import verified_matches
from cagefield.datasets.sfm.structure_from_motion import MAX_EXHAUSTIVE_PHOTOS, model_camera, reconstruct
from cagefield.datasets.views import SparsePoints, View
from cagefield.geometry.point_alignment import Similarity

FloatArray = npt.NDArray[np.float64]

MAX_ADJUSTMENT_FEATURES = 4096

MIN_RADIAL_PHOTOS = 12
"""Minimum number of photos that share a camera whose lens has a second radial term."""

FIRST_BOUNDS_PIXELS = (12.0, 80.0)
"""Least and largest bound of the reprojection error in the first round, pixels of the shrunk photos."""

LAST_BOUND_PIXELS = 3.0
"""Bound of the reprojection error in the last round."""

ADJUSTMENT_ROUNDS = 4

MIN_PHOTO_OBSERVATIONS = 15
"""Minimum number of observed points of a photo whose new pose counts."""

MIN_PLACED_SHARE = 0.9
"""Minimum share of photos with enough observations."""


@dataclass(frozen=True, eq=False)
class RefinedPoses:
    """New cameras of a capture, in its given world where `aligned`.

    Attributes:
        cameras: camera at the photo's full size, by name of the view.
        points: sparse points of the reconstruction.
        reprojection_error: mean, pixels of the full-size photos.
        aligned: whether the cameras are in the given world, which fails where both sets of poses disagree.
        moving: number of photos whose features on moving things were left out.
    """

    cameras: dict[str, Camera]
    points: SparsePoints | None
    reprojection_error: float
    aligned: bool
    moving: int = 0


class PoseSolver:
    """Solver for the cameras of the full-size `views`, with features and matches in `folder`.

    The constructor and the methods raise DatasetError where a photo cannot be read, StoppedError where COLMAP
    fails.
    """

    def __init__(
        self, views: Sequence[View], folder: Path, on_progress: OnProgress | None = None, seed: int = 0
    ) -> None:
        """Find features of all photos, and matches of neighbors in pose and in order."""
        pycolmap = features.import_pycolmap()
        self._views, self._folder, self._seed = views, folder, seed
        self._shrunk, self._names = triangulation.shrink_views(views, folder, on_progress, square=True)
        self._numbers, self._cameras = shared_cameras(pycolmap, [one.camera for one in self._shrunk])
        self._tangential = [
            bool(np.any(np.median([(*c.distortion, 0.0, 0.0, 0.0, 0.0)[2:4] for c in group], axis=0)))
            for group in _groups([one.camera for one in self._shrunk], self._numbers)
        ]
        self._database = folder / "database.db"
        photos = [Photo(n, c) for n, c in zip(self._names, self._numbers, strict=True)]
        features.create_database(self._database, self._cameras, photos)
        extracting = features.scale_progress(on_progress, 0.05, 0.5)
        triangulation.extract_features(
            self._database, folder, self._names, MAX_ADJUSTMENT_FEATURES, extracting
        )
        near_pairs = triangulation.nearest_pairs([one.camera for one in self._shrunk])
        sequence_pairs = [(i, i + k) for i in range(len(views)) for k in SEQUENCE_STEPS if i + k < len(views)]
        self._match(sorted({*near_pairs, *sequence_pairs}), features.scale_progress(on_progress, 0.5, 1.0))

    def refine(self, expected_error: float, on_progress: OnProgress | None = None) -> RefinedPoses | None:
        """Bundle-adjusted cameras; None where too few photos keep enough observations.

        `expected_error` is the usual epipolar error of the given poses as a share of a photo's longer side.
        """
        pycolmap = features.import_pycolmap()
        center, scale = triangulation.normalization([one.camera for one in self._shrunk])
        model = triangulation.posed_model(
            pycolmap, self._cameras, self._numbers, self._shrunk, self._names, center, scale
        )
        side = max(max(one.camera.width, one.camera.height) for one in self._shrunk)
        first = float(np.clip(4.0 * expected_error * side, *FIRST_BOUNDS_PIXELS))
        for number, bound in enumerate(np.geomspace(first, LAST_BOUND_PIXELS, ADJUSTMENT_ROUNDS)):
            model = triangulation.triangulate_tracks(
                pycolmap, model, self._database, self._folder, f"round-{number}", float(bound),
                min_photos=2, seed=self._seed,
            )  # fmt: skip
            if not model.num_points3D():
                return None
            if number == ADJUSTMENT_ROUNDS - 1:
                _add_tangential(pycolmap, model, self._tangential)
            _adjust(pycolmap, model, float(bound), refine_focal=number < ADJUSTMENT_ROUNDS - 1)
            note = f"bundle adjustment {number + 1} of {ADJUSTMENT_ROUNDS}"
            features.scale_progress(on_progress, 0.0, 1.0)((number + 1) / ADJUSTMENT_ROUNDS, note)
        return self._collect_poses(model, Similarity(scale, np.eye(3), center))

    def rebuild(self, on_progress: OnProgress | None = None) -> RefinedPoses | None:
        """Cameras by structure from motion without the given poses; None where too few photos are placed."""
        count = len(self._views)
        uses_all_pairs = count <= MAX_EXHAUSTIVE_PHOTOS
        pairs = (
            features.all_pairs(count)
            if uses_all_pairs
            else features.select_likely_pairs(self._database, count)
        )
        self._match(pairs, features.scale_progress(on_progress, 0.0, 0.5))
        matches = verified_matches(self._database, count)
        mapping = features.scale_progress(on_progress, 0.5, 1.0)
        reconstructions = reconstruct(self._folder, self._names, matches, self._seed, mapping)
        if not reconstructions.models:
            return None
        refined = self._collect_poses(reconstructions.models[0], None)
        return None if refined is None else replace(refined, moving=len(reconstructions.moving))

    def _match(self, pairs: features.Pairs, on_progress: OnProgress) -> None:
        match(self._database, self._names, pairs, verify=True, seed=self._seed, on_progress=on_progress)

    def _collect_poses(self, model: Any, default: Similarity | None) -> RefinedPoses | None:
        """Cameras and points of a reconstruction, aligned to the given poses, else moved by `default`."""
        images = {image_id - 1: model.image(image_id) for image_id in model.reg_image_ids()}
        placed = [n for n, image in sorted(images.items()) if image.num_points3D >= MIN_PHOTO_OBSERVATIONS]
        if len(placed) < max(3, MIN_PLACED_SHARE * len(self._views)):
            return None
        poses = np.stack([image_pose(images[n]) for n in placed])
        alignment = align_poses(poses, np.stack([self._views[n].camera.c2w for n in placed]))
        to_world = alignment or default or Similarity(1.0, np.eye(3), np.zeros(3))
        cameras = {}
        for n, pose in zip(placed, poses, strict=True):
            view = self._views[n]
            posed = model_camera(model, images[n]).with_c2w(to_world.transform_pose(pose))
            cameras[view.name] = posed.resized(view.camera.width, view.camera.height)
        points = triangulation.collect_points(model, self._shrunk, None, to_world)
        shrinking = float(np.mean([one.scale for one in self._shrunk]))
        error = float(model.compute_mean_reprojection_error()) / shrinking
        return RefinedPoses(cameras, points, error, alignment is not None or default is not None)


def camera_groups(cameras: Sequence[Camera]) -> list[int]:
    """Number of the shared camera of each photo.

    Photos of one size and lens share a camera; where the given intrinsics are shared by at least two photos
    on average, the photos with equal intrinsics share one.
    """
    sizes = [(camera.width, camera.height, camera.model == "opencv_fisheye") for camera in cameras]
    intrinsics = [
        (*size, camera.fx, camera.fy, camera.cx, camera.cy, camera.distortion)
        for size, camera in zip(sizes, cameras, strict=True)
    ]
    grouped = 2 * len(set(intrinsics)) <= len(cameras)
    return features.number_groups(intrinsics if grouped else sizes)[1]


def shared_cameras(pycolmap: Any, cameras: Sequence[Camera]) -> tuple[list[int], list[Any]]:
    """(camera number of each photo, COLMAP cameras with the groups' median intrinsics)."""
    numbers = camera_groups(cameras)
    shared = []
    for group in _groups(cameras, numbers):
        middle = np.median([[c.fx, c.fy, c.cx, c.cy] for c in group], axis=0)
        lens = np.median([(*c.distortion, 0.0, 0.0, 0.0, 0.0)[:4] for c in group], axis=0)
        if group[0].model == "opencv_fisheye":
            model, params = "OPENCV_FISHEYE", [*middle, *lens]
        elif len(group) >= MIN_RADIAL_PHOTOS or lens[1]:
            model, params = "RADIAL", [middle[:2].mean(), middle[2], middle[3], lens[0], lens[1]]
        else:
            model, params = "SIMPLE_RADIAL", [middle[:2].mean(), middle[2], middle[3], lens[0]]
        camera = pycolmap.Camera(model=model, width=group[0].width, height=group[0].height, params=params)
        camera.has_prior_focal_length = True
        shared.append(camera)
    return numbers, shared


def _groups(cameras: Sequence[Camera], numbers: Sequence[int]) -> list[list[Camera]]:
    """Cameras of each group of photos that share a camera."""
    return [
        [camera for camera, n in zip(cameras, numbers, strict=True) if n == number]
        for number in range(max(numbers) + 1)
    ]


def _add_tangential(pycolmap: Any, model: Any, wanted: Sequence[bool]) -> None:
    """Change radial camera models to OPENCV, with zero tangential distortion, where `wanted`."""
    for camera_id, camera in model.cameras.items():
        if wanted[camera_id - 1] and camera.model.name in ("RADIAL", "SIMPLE_RADIAL"):
            focal, cx, cy, k1, k2 = (*camera.params, 0.0)[:5]
            camera.model = pycolmap.CameraModelId.OPENCV
            camera.params = [focal, focal, cx, cy, k1, k2, 0.0, 0.0]


def _adjust(pycolmap: Any, model: Any, bound: float, refine_focal: bool) -> None:
    """Bundle-adjust poses, intrinsics and points, then remove observations with more than half the bound."""
    options = pycolmap.BundleAdjustmentOptions(print_summary=False, refine_focal_length=refine_focal)
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = max(1.0, 0.1 * bound)
    options.ceres.solver_options.max_num_iterations = 50
    options.ceres.solver_options.function_tolerance = 1e-5
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in model.reg_image_ids():
        config.add_image(image_id)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    with (
        features.silence_log()
    ):  # pycolmap.bundle_adjustment writes headings to stderr whatever the log's level
        pycolmap.create_default_bundle_adjuster(options, config, model).solve()
    manager = pycolmap.ObservationManager(model)
    manager.filter_all_points3D(max(LAST_BOUND_PIXELS, 0.5 * bound), 1.0)
