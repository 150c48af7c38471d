"""Verification of the poses that come with photos, and their correction.

The poses are measured (`epipolar_error`, `ambiguity_check`). Right poses are unchanged. Wrong poses are
bundle-adjusted (`pose_refinement`); where the adjustment does not cure them, structure from motion finds new
poses from the photos. The data set gets the poses with the least epipolar error, in its given world where
enough of them agree with the given ones.

Figures and corrections are stored in the user's cache, under a digest of photos and given cameras.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.datasets.scene_bounds import cube_of_interest, depth_range
from cagefield.datasets.sfm.ambiguity_check import Fold, check_ambiguity
from cagefield.datasets.sfm.epipolar_error import (
    PhotoMatches,
    PoseError,
    match_photos,
    pose_error,
    sort_views,
)
from cagefield.datasets.sfm.pose_refinement import PoseSolver, RefinedPoses
from cagefield.datasets.sfm.sparse_points import capture_key, read_cached_points, write_cached_points
from cagefield.datasets.views import Dataset, View
from cagefield.errors import CagefieldError
from cagefield.files import json_text
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import read_text
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.files.user_cache import cache_root

Outcome = Literal["unmeasured", "kept", "adjusted", "rebuilt"]
OnStage = Callable[[str, float, str], None]

MAX_ERROR_RATIO = 0.7
"""Maximum ratio of epipolar errors after and before, for accepting corrected poses that are still called
wrong.
"""

MAX_CONTRADICTED = 0.05
"""Maximum share of pairs that contradict adjusted poses, above which structure from motion is tried too."""

MIN_FOLD_TURN_DEG = 5.0
"""Minimum turn of a tenth of the photos by which new poses differ from the poses of a real fold."""

MAX_SHARED_ERROR_RATIO = 1.25
"""Maximum ratio of epipolar errors after and before, where only focal lengths are scattered."""

_VERSION = b"poses 3"


@dataclass(frozen=True, eq=False)
class Verification:
    """Data set with verified poses, and the measurements.

    Attributes:
        dataset: the given data set where its poses stay, else one with other cameras and points.
        before, after: epipolar errors of the given poses and of the data set's; None where too few photos
            match.
        fold: photos that contradict each other under the given poses, None without any.
        outcome: unmeasured and kept leave the poses unchanged; adjusted is by bundle adjustment, rebuilt by
            structure from motion.
        aligned: whether the cameras are in the given world.
        left_out: names of views without a new pose.
        same_fold: poses found from the photos alone agree with the given ones, so that the fold is doubtful.
        moving: photos whose features on things that move, such as a backdrop, were left out.
    """

    dataset: Dataset
    before: PoseError | None
    after: PoseError | None
    fold: Fold | None
    outcome: Outcome
    aligned: bool = True
    left_out: tuple[str, ...] = ()
    same_fold: bool = False
    moving: int = 0


def sorted_views(dataset: Dataset) -> list[View]:
    """All views of a data set once, in natural order of their names."""
    everything = {view.name: view for view in (*dataset.val, *dataset.test, *dataset.train)}
    return sort_views(everything.values())


def verify_poses(
    dataset: Dataset,
    *,
    correct: bool = True,
    cache: Path | None = None,
    on_stage: OnStage = lambda stage, done, note: None,
    seed: int = 0,
) -> Verification:
    """Data set with its poses measured and, with `correct`, corrected where they are wrong.

    Figures and corrections are read from and written to the folder `cache`.

    Raises DatasetError where a photo cannot be read, StoppedError where COLMAP fails.
    """
    views = [view.whole() for view in sorted_views(dataset)]
    version = _VERSION + (b" unbounded" if dataset.unbounded else b"")
    file = None if cache is None else cache / f"poses-{capture_key(views, seed, version)}.json"
    findings = None if file is None else _read(file)
    if findings is None or (correct and findings.is_suspect and not findings.searched):
        matches = match_photos(views, partial(on_stage, "Checking poses"))
        if findings is None:
            fold = (
                check_ambiguity(dataset, partial(on_stage, "Comparing photos")) if dataset.unbounded else None
            )
            findings = _Findings(pose_error(matches, views), fold)
        if correct and findings.is_suspect:
            findings = _search_corrections(dataset, views, findings, matches, seed, on_stage)
        if file is not None:
            _write(file, findings)
    before, fold = findings.before, findings.fold
    if not correct or findings.corrected is None:
        outcome: Outcome = "unmeasured" if before is None else "kept"
        return Verification(dataset, before, before, fold, outcome, same_fold=findings.same_fold)
    outcome, refined, after = findings.corrected
    left_out = tuple(view.name for view in views if view.name not in refined.cameras)
    moved = replace_cameras(dataset, refined)
    return Verification(
        moved, before, after, fold, outcome, refined.aligned, left_out, findings.same_fold, refined.moving
    )


@dataclass(frozen=True, eq=False)
class _Findings:
    """Measurements of given poses, whether better ones were searched for, and (outcome, poses, error) if
    found.

    `same_fold`: new poses agree with the given ones, so that their fold is doubtful.
    """

    before: PoseError | None
    fold: Fold | None
    searched: bool = False
    same_fold: bool = False
    corrected: tuple[Outcome, RefinedPoses, PoseError | None] | None = None

    @property
    def is_suspect(self) -> bool:
        """Whether better poses are searched for."""
        before = self.before
        return self.fold is not None or (
            before is not None and (before.is_wrong or before.has_scattered_focals)
        )


def _search_corrections(
    dataset: Dataset,
    views: list[View],
    findings: _Findings,
    matches: PhotoMatches,
    seed: int,
    on_stage: OnStage,
) -> _Findings:
    """Findings with the best corrected poses, where some are better than the given ones."""
    before, fold = findings.before, findings.fold
    best: tuple[Outcome, RefinedPoses, PoseError | None] | None = None
    for outcome, refined in _corrections(views, before, fold, seed, on_stage):
        other = replace_cameras(dataset, refined)
        after = pose_error(matches, [view.whole() for view in sorted_views(other)])
        is_right = after is None or not after.is_wrong
        if fold is not None and is_right and outcome == "rebuilt" and _agrees(dataset, refined):
            fold, findings = None, replace(findings, same_fold=True)
            if before is None or not (before.is_wrong or before.has_scattered_focals):
                break
        if not _is_better(before, after, fold):
            continue
        if fold is not None and check_ambiguity(other) is not None:
            continue
        # Matches on things that move contradict right poses: they do not decide then.
        if best is None or refined.moving or _capped(after) < _capped(best[2]):
            best = outcome, refined, after
        after = best[2]
        if after is not None and not after.is_wrong and after.contradicted <= MAX_CONTRADICTED:
            break
    return replace(findings, searched=True, corrected=best)


def _corrections(
    views: list[View], before: PoseError | None, fold: Fold | None, seed: int, on_stage: OnStage
) -> Iterator[tuple[Outcome, RefinedPoses]]:
    """(outcome, poses) of each correction, the cheapest first."""
    with TemporaryFolder("points") as folder:
        solver = PoseSolver(views, folder, partial(on_stage, "Matching photos"), seed)
        if before is not None and (before.is_wrong or fold is None):
            refined = solver.refine(before.median / before.size, partial(on_stage, "Adjusting poses"))
            if refined is not None:
                yield "adjusted", refined
        if fold is not None or (before is not None and before.is_wrong):
            refined = solver.rebuild(partial(on_stage, "Finding poses"))
            if refined is not None:
                yield "rebuilt", refined


def _capped(error: PoseError | None) -> float:
    return float("inf") if error is None else error.capped


def _is_better(before: PoseError | None, after: PoseError | None, fold: Fold | None) -> bool:
    """Whether poses with the error `after` are to replace the poses with the error `before`.

    Where both errors are None the fold alone decides.
    """
    if after is None:
        return before is None and fold is not None
    if before is None:
        return not after.is_wrong
    if fold is not None and not before.is_wrong:
        return not after.is_wrong
    if not before.is_wrong:
        return not after.is_wrong and after.median <= MAX_SHARED_ERROR_RATIO * before.median
    if not after.is_wrong:
        return after.capped < before.capped
    return after.median < MAX_ERROR_RATIO * before.median and after.capped < MAX_ERROR_RATIO * before.capped


def _agrees(dataset: Dataset, refined: RefinedPoses) -> bool:
    """Whether new poses agree with the given ones, so that the given ones are not folded."""
    given = [view.camera.c2w[:3, :3] for view in sorted_views(dataset) if view.name in refined.cameras]
    new = [
        refined.cameras[view.name].c2w[:3, :3]
        for view in sorted_views(dataset)
        if view.name in refined.cameras
    ]
    turns = Rotation.from_matrix(np.stack(given).transpose(0, 2, 1) @ np.stack(new)).magnitude()
    return refined.aligned and bool(np.degrees(np.quantile(turns, 0.9)) < MIN_FOLD_TURN_DEG)


def replace_cameras(dataset: Dataset, refined: RefinedPoses) -> Dataset:
    """Data set with other cameras and points; views without a camera are left out.

    The cube of interest of an unbounded capture is estimated again. Where the cameras are not in the given
    world, the file's coordinates are unknown: `source_to_world` is the identity and `offset` zero.
    """

    def moved(views: tuple[View, ...]) -> tuple[View, ...]:
        return tuple(
            replace(view.whole(), camera=refined.cameras[view.name]).downscaled(view.downscale)
            for view in views
            if view.name in refined.cameras
        )

    train, test, val = moved(dataset.train), moved(dataset.test), moved(dataset.val)
    cameras = [view.camera for view in train]
    positions = None if refined.points is None else refined.points.positions
    bounds = cube_of_interest(cameras, points=positions) if dataset.unbounded else dataset.bounds
    return replace(
        dataset,
        train=train,
        test=test,
        val=val,
        bounds=bounds,
        depths=depth_range(cameras, positions),
        points=refined.points,
        source_to_world=dataset.source_to_world if refined.aligned else np.eye(4),
        offset=dataset.offset if refined.aligned else (0.0, 0.0, 0.0),
    )


def describe(one: Verification) -> list[str]:
    """Lines of text about a verification: the error, the correction, photos left out."""
    if one.before is None:
        lines = ["poses: not measured, too few photos have matches with their neighbors"]
    else:
        lines = [f"poses: {one.before}"]
    if one.fold is not None:
        first, second = one.fold.pair
        lines.append(
            f"poses {'look' if one.same_fold else 'are'} folded: {one.fold.photos} of {one.fold.compared} "
            f"photos stand beside others that show something else ({first} and {second}), as where two sides "
            "of a thing look alike"
        )
    elif one.before is not None and one.before.has_scattered_focals:
        lines.append(
            f"focal lengths of photos of one size differ by {100 * one.before.focal_spread:.0f} %, more than "
            "one lens explains"
        )
    if one.outcome in ("adjusted", "rebuilt"):
        how = {
            "adjusted": "adjusted (bundle adjustment, intrinsics shared by photos of one size)",
            "rebuilt": "found anew (structure from motion)",
        }[one.outcome]
        world = "in the given world" if one.aligned else "in another world: too few agree with the given ones"
        lines.append(f"poses are {how}, {world}: {one.after}; --keep-poses leaves them as they are")
        if one.moving:
            lines.append(f"{one.moving} photos show things that move: features on these were left out")
    elif one.same_fold:
        lines.append("structure from motion finds the same poses from the photos alone: they are used")
    elif one.fold is not None or (one.before is not None and one.before.is_wrong):
        lines.append("nothing better was found: the given poses are used")
    if one.left_out:
        lines.append(f"{len(one.left_out)} photos found no place and are left out: {', '.join(one.left_out)}")
    return lines


def poses_cache_folder() -> Path:
    """Folder of corrected poses in the user's cache."""
    return cache_root() / "poses"


def _write(file: Path, findings: _Findings) -> None:
    """Write the findings whole or not at all; an unwritable folder is ignored."""
    values: dict[str, Any] = {
        "before": None if findings.before is None else asdict(findings.before),
        "fold": None if findings.fold is None else asdict(findings.fold),
        "searched": findings.searched,
        "same_fold": findings.same_fold,
    }
    if findings.corrected is not None:
        outcome, refined, after = findings.corrected
        values |= {
            "outcome": outcome,
            "after": None if after is None else asdict(after),
            "cameras": {name: camera.to_dict() for name, camera in refined.cameras.items()},
            "reprojection_error": refined.reprojection_error,
            "aligned": refined.aligned,
            "moving": refined.moving,
        }
        if refined.points is not None:
            write_cached_points(file.with_suffix(".npz"), refined.points)
    try:
        with replaced_file(file) as draft:
            draft.write_text(json.dumps(values), encoding="utf-8")
    except OSError:
        return


def _read(file: Path) -> _Findings | None:
    """Findings of a file; None where it is missing or damaged."""
    try:
        values = json_text.loads(read_text(file))
        before, searched, same_fold = (
            _parse_pose_error(values["before"]),
            values["searched"],
            values["same_fold"],
        )
        fold = None if values["fold"] is None else _parse_fold(values["fold"])
        if not (isinstance(searched, bool) and isinstance(same_fold, bool)):
            return None
        if "outcome" not in values:
            return _Findings(before, fold, searched, same_fold)
        cameras = {str(name): Camera.from_dict(one) for name, one in values["cameras"].items()}
        outcome, error, aligned = values["outcome"], float(values["reprojection_error"]), values["aligned"]
        if outcome not in ("adjusted", "rebuilt") or not isinstance(aligned, bool) or not np.isfinite(error):
            return None
        points, moving = read_cached_points(file.with_suffix(".npz")), int(values["moving"])
        refined = RefinedPoses(cameras, points, error, aligned, moving)
        return _Findings(
            before, fold, searched, same_fold, (outcome, refined, _parse_pose_error(values["after"]))
        )
    except (OSError, ValueError, TypeError, KeyError, AttributeError, CagefieldError):
        return None


def _parse_pose_error(values: dict[str, Any] | None) -> PoseError | None:
    """Pose error of a file; raises ValueError, TypeError or KeyError where it is damaged."""
    if values is None:
        return None
    name, worst = values["worst"]
    shares = [float(values[key]) for key in ("median", "tenth", "focal_spread", "capped", "contradicted")]
    if not np.isfinite([*shares, float(worst)]).all():
        raise ValueError("a pose error that is not finite")
    median, tenth, focal_spread, capped, contradicted = shares
    photos, pairs, size = (int(values[key]) for key in ("photos", "pairs", "size"))
    one = (str(name), float(worst))
    return PoseError(median, tenth, photos, pairs, size, one, focal_spread, capped, contradicted)


def _parse_fold(values: dict[str, Any]) -> Fold:
    """Fold of a file; raises ValueError, TypeError or KeyError where it is damaged."""
    first, second = values["pair"]
    return Fold(int(values["photos"]), int(values["compared"]), (str(first), str(second)))
