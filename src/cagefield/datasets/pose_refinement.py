"""Bundle adjustment of given poses and intrinsics, or new ones by structure from motion, by pycolmap.

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
from cagefield.datasets.left_out import verified_matches
from cagefield.datasets.matching import match
from cagefield.datasets.pose_alignment import Similarity, align_poses
from cagefield.datasets.pose_check import SEQUENCE_STEPS
from cagefield.datasets.structure_from_motion import MOST_FOR_ALL_PAIRS, unfolded_models
from cagefield.datasets.views import SparsePoints, View

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
    """New cameras of a capture, in its given world where `aligned`.

    Attributes:
        cameras: camera at the photo's full size, by name of the view.
        points: sparse points of the reconstruction.
        reprojection_error: mean, pixels of the full-size photos.
        aligned: whether they are in the given world; not where both sets of poses disagree too much.
    """

    cameras: dict[str, Camera]
    points: SparsePoints | None
    reprojection_error: float
    aligned: bool


class PoseSolver:
    """Features and matches of the full-size `views` in `folder`, from which their cameras are found anew.

    Raises DatasetError where a photo cannot be read, StoppedError where COLMAP fails; so do the methods.
    """

    def __init__(
        self, views: Sequence[View], folder: Path, on_progress: OnProgress | None = None, seed: int = 0
    ) -> None:
        """Finds features of all photos, and matches of neighbors in pose and in order."""
        pycolmap = features.engine()
        self._views, self._folder, self._seed = views, folder, seed
        self._shrunk, self._names = triangulation.shrink_views(views, folder, on_progress)
        self._numbers, self._cameras = shared_cameras(pycolmap, [one.camera for one in self._shrunk])
        self._database = folder / "database.db"
        photos = [Photo(n, c) for n, c in zip(self._names, self._numbers, strict=True)]
        features.create_database(self._database, self._cameras, photos)
        extracting = features.share(on_progress, 0.05, 0.5)
        triangulation.extract_features(self._database, folder, self._names, MAX_FEATURES, extracting)
        near = triangulation.nearest_pairs([one.camera for one in self._shrunk])
        in_order = [(i, i + k) for i in range(len(views)) for k in SEQUENCE_STEPS if i + k < len(views)]
        self._match(sorted({*near, *in_order}), features.share(on_progress, 0.5, 1.0))

    def refine(self, expected_error: float, on_progress: OnProgress | None = None) -> RefinedPoses | None:
        """Bundle-adjusted cameras; None where too few photos keep enough observations.

        `expected_error` is the usual epipolar error of the given poses as a share of a photo's longer side.
        """
        pycolmap = features.engine()
        center, scale = triangulation.normalization([one.camera for one in self._shrunk])
        model = triangulation.posed_model(
            pycolmap, self._cameras, self._numbers, self._shrunk, self._names, center, scale
        )
        side = max(max(one.camera.width, one.camera.height) for one in self._shrunk)
        first = float(np.clip(4.0 * expected_error * side, *FIRST_BOUNDS_PIXELS))
        for number, bound in enumerate(np.geomspace(first, LAST_BOUND_PIXELS, ROUNDS)):
            model = triangulation.triangulated(
                pycolmap, model, self._database, self._folder, f"round-{number}", float(bound),
                least_photos=2, seed=self._seed,
            )  # fmt: skip
            if not model.num_points3D():
                return None
            _adjust(pycolmap, model, float(bound))
            note = f"bundle adjustment {number + 1} of {ROUNDS}"
            features.share(on_progress, 0.0, 1.0)((number + 1) / ROUNDS, note)
        return self._collected(model, Similarity(scale, np.eye(3), center))

    def rebuild(self, on_progress: OnProgress | None = None) -> RefinedPoses | None:
        """Cameras by structure from motion without the given poses; None where too few photos are placed."""
        count = len(self._views)
        few = count <= MOST_FOR_ALL_PAIRS
        pairs = features.all_pairs(count) if few else features.likely_pairs(self._database, count)
        self._match(pairs, features.share(on_progress, 0.0, 0.5))
        matches = verified_matches(self._database, count)
        mapping = features.share(on_progress, 0.5, 1.0)
        models = unfolded_models(self._folder, matches, self._seed, mapping)
        return self._collected(models[0], None) if models else None

    def _match(self, pairs: features.Pairs, on_progress: OnProgress) -> None:
        match(self._database, self._names, pairs, verify=True, seed=self._seed, on_progress=on_progress)
