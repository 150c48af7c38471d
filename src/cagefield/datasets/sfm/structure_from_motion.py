"""Posed data set of photos alone, or of a video: COLMAP's structure from motion, by pycolmap, on the CPU.

The result is a folder in COLMAP's layout, which `load_dataset` reads: `images`, the registered photos, turned
write_upright, and their `masks`; `sparse/0`, the model; `poses.json`, the record of the source and the
reasons why photos were left out.

Intermediate files are in a work folder beside it (`NAME.work`: photos, and the database of features and
matches), from which an interrupted run continues; it is removed at the end.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cagefield.cameras.camera import Camera
from cagefield.datasets.colmap.colmap_lenses import lens_views
from cagefield.datasets.colmap.colmap_model import image_pose
from cagefield.datasets.raw_photos import RawPhoto
from cagefield.datasets.sfm import disambiguation, features, moving_features
from cagefield.datasets.sfm.database_check import check_database, recorded_digest
from cagefield.datasets.sfm.features import OnProgress, Photo
from cagefield.datasets.sfm.matching import match
from cagefield.datasets.sfm.registered_capture import PosesReport as PosesReport
from cagefield.datasets.sfm.registered_capture import write_capture
from cagefield.datasets.sfm.registration_report import (
    Matches,
    explain_no_model,
    explain_unregistered,
    verified_matches,
)
from cagefield.datasets.sfm.sfm_workspace import (
    DATABASE,
    link_plain_names,
    mention_work_folder,
    photo_record,
    prepare_photos,
    prepare_work,
    remove_work,
    work_folder,
)
from cagefield.datasets.sfm.transforms_writer import RECORD_FILE
from cagefield.errors import DatasetError
from cagefield.files import json_text
from cagefield.files.atomic import recover_folder
from cagefield.files.safe_open import read_text

MAX_EXHAUSTIVE_PHOTOS = 120
"""Maximum number of photos of which every pair is matched; of more, pairs near in order or similar in
features.
"""

FEATURE_SIDE_PIXELS = 1600
"""Longer side to which photos are shrunk for feature extraction."""

MIN_STATIC_POINTS, MIN_STATIC_SHARE = 12, 0.15
"""Points that place a photo, number and share, at least, where only those that stand still are left."""

MIN_RADIAL_PHOTOS = 12
"""Photos that share a camera, from which on its lens has a second radial term: RADIAL, not SIMPLE_RADIAL.

Both have square pixels: cameras that are held level do not tell their aspect from a stretched scene."""

_GUESSED_FOCAL_SIDES = 1.2  # focal length over the longer side, where the camera wrote none


def make_poses(
    source: Path,
    target: Path,
    *,
    frames: int = 80,
    masks: Path | None = None,
    seed: int = 0,
    on_progress: OnProgress | None = None,
) -> PosesReport:
    """Write the data set `target` of a folder of photos or a video, replacing an earlier one.

    An interrupted run of the same photos continues from its work folder. `frames` are taken of a video.
    Features are not taken where masks exclude pixels (masks of the folder `masks`, else files beside the
    photos); the data set has the masks too.

    Raises DatasetError where pycolmap is missing, where fewer than three photos are registered, and where the
    disk is full: `target` is then unchanged, and the work folder stays.
    """
    features.import_pycolmap()
    record = photo_record(source, frames, masks)
    recover_folder(target, lambda folder: (folder / RECORD_FILE).is_file())
    work = work_folder(target)
    with mention_work_folder(work):
        prepare_work(work, record)
        check_database(work / DATABASE)
        with recorded_digest(work / DATABASE):
            report = _build(source, target, record, frames, masks, seed, on_progress)
    remove_work(work)
    features.scale_progress(on_progress, 0.0, 1.0)(1.0, f"{report.placed} of {report.total} photos")
    return report


def _build(
    source: Path,
    target: Path,
    record: Mapping[str, Any],
    frames: int,
    masks: Path | None,
    seed: int,
    on_progress: OnProgress | None,
) -> PosesReport:
    work = work_folder(target)
    photos, unreadable = prepare_photos(
        source, work, frames, features.scale_progress(on_progress, 0.0, 0.1), masks
    )
    total = len(photos) + len(unreadable)
    if len(photos) < 3:
        reasons = "".join(f"; {name}: {reason}" for name, reason in list(unreadable.items())[:3])
        raise DatasetError(f"{source}: {len(photos)} photos can be read, at least 3 are needed{reasons}")
    names = link_plain_names(photos, work)
    database = work / DATABASE
    if not database.is_file():
        cameras, shared = guess_cameras(photos)
        listed = [Photo(n, c) for n, c in zip(names, shared, strict=True)]
        features.create_database(database, cameras, listed)
    plain_masks = work / "masks"
    features.extract(
        database,
        work / "colmap",
        names,
        features=8192 if len(photos) <= 60 else 4096,
        longer_side=FEATURE_SIDE_PIXELS,
        masks=plain_masks if plain_masks.is_dir() else None,
        on_progress=features.scale_progress(on_progress, 0.1, 0.3),
    )
    uses_all_pairs = len(photos) <= MAX_EXHAUSTIVE_PHOTOS
    pairs = (
        features.all_pairs(len(photos))
        if uses_all_pairs
        else features.select_likely_pairs(database, len(photos))
    )
    match(
        database,
        names,
        pairs,
        verify=True,
        seed=seed,
        on_progress=features.scale_progress(on_progress, 0.3, 0.7),
    )
    shared_matches = verified_matches(database, len(photos))
    reconstructions = reconstruct(
        work, names, shared_matches, seed, features.scale_progress(on_progress, 0.7, 0.99)
    )
    models = reconstructions.models
    if not models:
        raise DatasetError(f"{source}: {explain_no_model(photos, shared_matches)}")
    model = models[0]
    placed = {image_id - 1 for image_id in model.reg_image_ids()}
    left_out = unreadable | explain_unregistered(photos, placed, models[1:], shared_matches)
    if len(placed) < 3:
        raise DatasetError(f"{source}: {explain_no_model(photos, shared_matches)}")
    report = PosesReport(
        target,
        total,
        len(placed),
        model.num_points3D(),
        float(model.compute_mean_reprojection_error()),
        left_out,
        len(reconstructions.moving),
    )
    write_capture(model, photos, placed, target, record, report)
    return report


def is_built_from(target: Path, source: Path, frames: int = 80, masks: Path | None = None) -> bool:
    """Whether the data set `target` was built from these photos, unchanged since."""
    try:
        known = json_text.loads(read_text(target / RECORD_FILE))
    except (OSError, ValueError):
        return False
    return isinstance(known, dict) and known.get("made_of") == photo_record(source, frames, masks)


def guess_cameras(photos: Sequence[RawPhoto]) -> tuple[list[Any], list[int]]:
    """(COLMAP's initial cameras, number of each photo's): one for all photos of one size and focal length."""
    pycolmap = features.import_pycolmap()
    groups, numbers = features.number_groups((p.width, p.height, p.focal) for p in photos)
    cameras = []
    for index, (width, height, focal) in enumerate(groups):
        model = "RADIAL" if numbers.count(index) >= MIN_RADIAL_PHOTOS else "SIMPLE_RADIAL"
        guess = _GUESSED_FOCAL_SIDES * max(width, height) if focal is None else focal
        camera = pycolmap.Camera.create_from_model_name(index + 1, model, guess, width, height)
        camera.has_prior_focal_length = focal is not None
        cameras.append(camera)
    return cameras, numbers


@dataclass(frozen=True, eq=False)
class Reconstructions:
    """Reconstructions by COLMAP, the one with the most photos first.

    Attributes:
        models: the reconstructions.
        moving: numbers of photos whose features on things that move were removed.
    """

    models: list[Any]
    moving: tuple[int, ...] = ()


def reconstruct(
    work: Path, names: Sequence[str], matches: Matches, seed: int, on_progress: OnProgress
) -> Reconstructions:
    """Reconstructions from the verified matches in `work`, without folds and without moving things.

    Where photos show things that move, a reconstruction without their features is preferred if it registers
    as many photos and the remaining matches agree with it better.
    """
    mapping = features.scale_progress(on_progress, 0.0, 0.7)
    models, database = build_unambiguous_models(work, matches, seed, mapping)
    if not models:
        return Reconstructions(models)
    matched = moving_features.read_features(database, len(names))
    before = _cameras(models[0])
    moving, photos = moving_features.moving_features(matched, before)
    if len(photos) < moving_features.MIN_MOVING_PHOTOS:
        return Reconstructions(models)
    copy = work / "static_features.db"
    shutil.copyfile(database, copy)
    pairs = moving_features.remove_features(copy, moving)
    verifying = features.scale_progress(on_progress, 0.7, 0.8)
    match(copy, names, pairs, verify=True, several=True, seed=seed, on_progress=verifying)
    static = _map(
        work, copy, len(names), seed, features.scale_progress(on_progress, 0.8, 1.0), few_matches=True
    )
    if not static or static[0].num_reg_images() < models[0].num_reg_images():
        return Reconstructions(models)
    remaining = moving_features.read_features(copy, len(names))
    errors = [moving_features.capped_error(remaining, each) for each in (before, _cameras(static[0]))]
    return Reconstructions(static, tuple(photos)) if errors[1] < errors[0] else Reconstructions(models)


def _cameras(model: Any) -> dict[int, Camera]:
    """Cameras of a reconstruction's photos, by number of the photo, in its world."""
    return {number - 1: model_camera(model, model.image(number)) for number in model.reg_image_ids()}


def model_camera(model: Any, image: Any) -> Camera:
    """Camera of an image of a reconstruction, in the reconstruction's world."""
    colmap_camera = model.camera(image.camera_id)
    lens = lens_views(
        colmap_camera.model.name,
        tuple(colmap_camera.params.tolist()),
        colmap_camera.width,
        colmap_camera.height,
    )[0]
    return lens.camera.with_c2w(image_pose(image))


def build_unambiguous_models(
    work: Path, matches: Matches, seed: int, on_progress: OnProgress
) -> tuple[list[Any], Path]:
    """(reconstructions without pairs that only look alike, the most photos first; database of their pairs).

    Photos in order are registered by their neighbors alone first; pairs further apart that contradict this
    chain are left out, unless the result has fewer photos, or as many photos and fewer points.
    """
    count, database = len(matches.counts), work / DATABASE
    if not disambiguation.is_sequence(matches.counts):
        return _map(work, database, count, seed, on_progress), database
    distant = disambiguation.distant_pairs(matches.counts)
    chain = _map(
        work,
        copy_without_pairs(database, distant),
        count,
        seed,
        features.scale_progress(on_progress, 0.0, 0.33),
    )
    false_pairs: set[tuple[int, int]] = set()
    if chain:
        relative = disambiguation.relative_rotations(database, chain[0], distant)
        false_pairs = disambiguation.contradicting_pairs(disambiguation.model_rotations(chain[0]), relative)
    plain_models = _map(work, database, count, seed, features.scale_progress(on_progress, 0.33, 0.66))
    if not false_pairs:
        return plain_models, database
    pruned_database = copy_without_pairs(database, false_pairs)
    pruned_models = _map(work, pruned_database, count, seed, features.scale_progress(on_progress, 0.66, 1.0))
    return (
        (pruned_models, pruned_database)
        if _size(pruned_models) >= _size(plain_models)
        else (plain_models, database)
    )


def _size(models: Sequence[Any]) -> tuple[int, int]:
    """(number of photos, number of points) of the first of the reconstructions."""
    return (models[0].num_reg_images(), models[0].num_points3D()) if models else (0, 0)


def copy_without_pairs(database: Path, pairs: set[tuple[int, int]]) -> Path:
    """Copy of the database without the verified matches of these pairs."""
    copy = database.with_name("fewer_pairs.db")
    shutil.copyfile(database, copy)
    disambiguation.remove_pairs(copy, pairs)
    return copy


def _map(
    work: Path, database: Path, count: int, seed: int, on_progress: OnProgress, few_matches: bool = False
) -> list[Any]:
    """Reconstructions, the one with the most photos first; `few_matches` lowers the number needed to register
    a photo.
    """
    pycolmap = features.import_pycolmap()
    options = pycolmap.IncrementalPipelineOptions(min_model_size=3, random_seed=seed, max_num_models=10)
    options.mapper.random_seed = seed
    options.triangulation.random_seed = seed
    if few_matches:
        options.min_num_matches = moving_features.MIN_STATIC_MATCHES
        options.mapper.abs_pose_min_num_inliers = MIN_STATIC_POINTS
        options.mapper.abs_pose_min_inlier_ratio = MIN_STATIC_SHARE
    out = work / "models"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    placed = [0]

    def count_photo() -> None:
        placed[0] += 1

    def start() -> None:
        placed[0] = 2

    def poll() -> None:
        done = min(placed[0], count)
        on_progress(done / count, f"{done} of {count} photos placed")

    models = features.call_cancellable(
        pycolmap.incremental_mapping,
        database,
        work / "colmap",
        out,
        options=options,
        initial_image_pair_callback=start,
        next_image_callback=count_photo,
        poll=poll,
    )
    return sorted(models.values(), key=lambda m: (-m.num_reg_images(), -m.num_points3D()))
