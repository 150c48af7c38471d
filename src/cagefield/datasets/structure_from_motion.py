"""A data set of photos alone, or of a video: COLMAP's structure from motion, by pycolmap, on the CPU.

The result is a folder in COLMAP's layout, which `load_dataset` reads: `images`, the photos that found their
place, turned upright; `sparse/0`, the model; `poses.json`, what it was made of, and why photos were left out.

Everything on the way is in a work folder beside it (`NAME.work`: photos, and the database of features and
matches), from which an interrupted run continues; it is removed at the end.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from cagefield import json_text
from cagefield.atomic_files import replaced_file, replaced_folder
from cagefield.datasets import features, repeated_views
from cagefield.datasets.features import OnProgress, Photo
from cagefield.datasets.matching import match
from cagefield.datasets.raw_photos import RawPhoto, find_raw_photos, is_video, upright, video_frames
from cagefield.errors import DatasetError

RECORD = "poses.json"

MOST_FOR_ALL_PAIRS = 120
"""Photos of which every pair is matched; of more, those that are near in order or look alike."""

LONGER_SIDE = 1600
"""Photos are shrunk to this many pixels for features."""

LEAST_SHARED = 12
"""Photos that share a camera, from which on its lens is OPENCV instead of SIMPLE_RADIAL."""

BLURRED = 0.3
"""Share of the photos' median sharpness under which one is called blurred."""

FEW_MATCHES = 30

_VERSION = 1
_FOCAL_GUESS = 1.2  # focal length over the longer side, where the camera wrote none


@dataclass(frozen=True)
class PosesReport:
    """What became of the photos.

    Attributes:
        folder: the data set.
        total: photos that there were, readable or not.
        placed: photos that found their place.
        points: sparse points.
        error: mean reprojection error in pixels.
        left_out: the other photos, and what was wrong with each.
    """

    folder: Path
    total: int
    placed: int
    points: int
    error: float
    left_out: Mapping[str, str] = field(default_factory=dict)


def make_poses(
    source: Path,
    target: Path,
    *,
    frames: int = 80,
    seed: int = 0,
    on_progress: OnProgress | None = None,
) -> PosesReport:
    """Writes the data set `target` of a folder of photos or a video; replaces what is there.

    An interrupted run of the same photos continues from its work folder. `frames` are taken of a video.

    Raises DatasetError where pycolmap is missing, and where fewer than three photos find their place.
    """
    features.engine()
    record = record_of(source, frames)
    work = work_folder(target)
    _prepare_work(work, record)
    photos, unreadable = _photos(source, work, frames, features.share(on_progress, 0.0, 0.1))
    total = len(photos) + len(unreadable)
    if len(photos) < 3:
        reasons = "".join(f"; {name}: {reason}" for name, reason in list(unreadable.items())[:3])
        raise DatasetError(f"{source}: {len(photos)} photos can be read, at least 3 are needed{reasons}")
    names = _linked(photos, work)
    database = work / "database.db"
    if not database.is_file():
        draft = work / "database.new"
        cameras, shared = camera_guesses(photos)
        features.create_database(draft, cameras, [Photo(n, c) for n, c in zip(names, shared, strict=True)])
        draft.rename(database)
    masks = work / "masks"
    features.extract(
        database,
        work / "colmap",
        names,
        features=8192 if len(photos) <= 60 else 4096,
        longer_side=LONGER_SIDE,
        masks=masks if masks.is_dir() else None,
        on_progress=features.share(on_progress, 0.1, 0.3),
    )
    few = len(photos) <= MOST_FOR_ALL_PAIRS
    pairs = features.all_pairs(len(photos)) if few else features.likely_pairs(database, len(photos))
    match(database, names, pairs, verify=True, seed=seed, on_progress=features.share(on_progress, 0.3, 0.7))
    shared_matches = _matches(database, len(photos))
    models = unfolded_models(work, shared_matches, seed, features.share(on_progress, 0.7, 0.99))
    if not models:
        raise DatasetError(f"{source}: {_why_none(photos, shared_matches)}")
    model = models[0]
    placed = {image_id - 1 for image_id in model.reg_image_ids()}
    left_out = unreadable | reasons_left_out(photos, placed, models[1:], shared_matches)
    if len(placed) < 3:
        raise DatasetError(f"{source}: {_why_none(photos, shared_matches)}")
    report = PosesReport(
        target,
        total,
        len(placed),
        model.num_points3D(),
        float(model.compute_mean_reprojection_error()),
        left_out,
    )
    _write(model, photos, placed, target, record, report)
    shutil.rmtree(work, ignore_errors=True)
    features.share(on_progress, 0.0, 1.0)(1.0, f"{len(placed)} of {total} photos")
    return report


def work_folder(target: Path) -> Path:
    """The folder beside `target` that an interrupted run leaves."""
    return target.with_name(target.name + ".work")


def is_made_of(target: Path, source: Path, frames: int = 80) -> bool:
    """Whether the data set `target` was made of these photos, none of them changed since."""
    try:
        known = json_text.loads((target / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(known, dict) and known.get("made_of") == record_of(source, frames)


def record_of(source: Path, frames: int) -> dict[str, Any]:
    """What tells one set of photos from another: names, sizes in bytes, times of change."""
    if not source.exists():
        raise DatasetError(f"{source} does not exist; give a folder of photos or a video")
    if source.is_file() and not is_video(source):
        raise DatasetError(
            f"{source} is no video that is known by its name; give a folder of photos or an MP4"
        )
    base = source.parent if source.is_file() else _base(source)
    files = [source] if source.is_file() else find_raw_photos(base)
    if not files:
        raise DatasetError(f"{base}: no photos in it; give a folder of photos or a video")
    listing = [[f.relative_to(base).as_posix(), f.stat().st_size, f.stat().st_mtime_ns] for f in files]
    return {"version": _VERSION, "files": listing, **({"frames": frames} if source.is_file() else {})}


def _base(source: Path) -> Path:
    """The folder of the photos: `images` in `source` where there is one, whose neighbours may be masks."""
    return source / "images" if (source / "images").is_dir() else source


def _prepare_work(work: Path, record: Mapping[str, Any]) -> None:
    """The work folder, emptied where it is of other photos."""
    note = work / "made_of.json"
    text = json.dumps(record)
    if work.exists():
        if note.is_file() and note.read_text(encoding="utf-8") == text:
            return
        if not note.is_file() and any(work.iterdir()):
            raise DatasetError(f"folder {work} is in the way and holds something else; move it away")
        shutil.rmtree(work)
    work.mkdir(parents=True)
    note.write_text(text, encoding="utf-8")


def _photos(
    source: Path, work: Path, frames: int, on_progress: OnProgress
) -> tuple[list[RawPhoto], dict[str, str]]:
    """The upright photos in the work folder, and those that cannot be read with the reason."""
    note = work / "photos.json"
    if note.is_file():
        kept = json_text.loads(note.read_text(encoding="utf-8"))
        known = [RawPhoto(**{**one, "path": work / "images" / one["name"]}) for one in kept["photos"]]
        return known, kept["unreadable"]
    shutil.rmtree(work / "images", ignore_errors=True)
    if source.is_file():
        base = work / "frames"
        shutil.rmtree(base, ignore_errors=True)
        files = video_frames(source, frames, base, on_progress)
    else:
        base = _base(source)
        files = find_raw_photos(base)
    photos, unreadable = [], {}
    for index, file in enumerate(files, start=1):
        name = file.relative_to(base).as_posix()
        try:
            photos.append(upright(file, name, work / "images"))
        except DatasetError as error:
            unreadable[name] = str(error).removeprefix(f"{file}: ")
        on_progress(index / len(files), f"{index} of {len(files)} photos read")
    listing = [{**asdict(photo), "path": ""} for photo in photos]
    with replaced_file(note) as draft:
        draft.write_text(json.dumps({"photos": listing, "unreadable": unreadable}), encoding="utf-8")
    return photos, unreadable


def _linked(photos: Sequence[RawPhoto], work: Path) -> list[str]:
    """Plain names of the photos for COLMAP, in the folder `colmap`; masks of cut-outs in `masks`.

    COLMAP's lists of pairs hold no names with spaces, and it does not read every format.
    """
    folder = work / "colmap"
    folder.mkdir(exist_ok=True)
    names = []
    for index, photo in enumerate(photos):
        simple = photo.path.suffix.lower() in (".jpg", ".jpeg", ".png") and not photo.alpha
        name = f"{index:06}{photo.path.suffix.lower() if simple else '.png'}"
        names.append(name)
        if (folder / name).exists():
            continue
        if simple:
            try:
                os.link(photo.path, folder / name)
            except OSError:
                shutil.copyfile(photo.path, folder / name)
            continue
        with Image.open(photo.path) as image:
            pixels = image.convert("RGBA")
        if photo.alpha:
            mask = pixels.getchannel("A").point(lambda value: 255 if value > 127 else 0)
            (work / "masks").mkdir(exist_ok=True)
            mask.save(work / "masks" / f"{name}.png")
        grey = Image.new("RGBA", pixels.size, (127, 127, 127, 255))
        Image.alpha_composite(grey, pixels).convert("RGB").save(folder / name, compress_level=1)
    return names


def camera_guesses(photos: Sequence[RawPhoto]) -> tuple[list[Any], list[int]]:
    """COLMAP's first guesses of the cameras, and each photo's: one for all of one size and focal length."""
    pycolmap = features.engine()
    groups, numbers = features.consecutive((p.width, p.height, p.focal) for p in photos)
    cameras = []
    for index, (width, height, focal) in enumerate(groups):
        model = "OPENCV" if numbers.count(index) >= LEAST_SHARED else "SIMPLE_RADIAL"
        guess = _FOCAL_GUESS * max(width, height) if focal is None else focal
        camera = pycolmap.Camera.create_from_model_name(index + 1, model, guess, width, height)
        camera.has_prior_focal_length = focal is not None
        cameras.append(camera)
    return cameras, numbers


def unfolded_models(work: Path, matches: _Matches, seed: int, on_progress: OnProgress) -> list[Any]:
    """The reconstructions, the one with the most photos first, without pairs that only look alike.

    Photos in order are placed by their neighbours alone first; where that contradicts pairs further apart,
    these are left out, unless fewer photos, or with as many fewer points, come of it.
    """
    count, database = len(matches.counts), work / "database.db"
    if not repeated_views.are_in_order(matches.counts):
        return _map(work, database, count, seed, on_progress)
    far = repeated_views.far_pairs(matches.counts)
    chain = _map(work, without_pairs(database, far), count, seed, features.share(on_progress, 0.0, 0.33))
    false: set[tuple[int, int]] = set()
    if chain:
        relative = repeated_views.relative_rotations(database, chain[0], far)
        false = repeated_views.contradicting(repeated_views.rotations_of(chain[0]), relative)
    plain = _map(work, database, count, seed, features.share(on_progress, 0.33, 0.66))
    if not false:
        return plain
    pruned = _map(work, without_pairs(database, false), count, seed, features.share(on_progress, 0.66, 1.0))
    return pruned if _size(pruned) >= _size(plain) else plain


def _size(models: Sequence[Any]) -> tuple[int, int]:
    """Photos, then points, of the first of the reconstructions."""
    return (models[0].num_reg_images(), models[0].num_points3D()) if models else (0, 0)


def without_pairs(database: Path, pairs: set[tuple[int, int]]) -> Path:
    """A copy of the database without the verified matches of these pairs."""
    copy = database.with_name("fewer_pairs.db")
    shutil.copyfile(database, copy)
    repeated_views.remove_pairs(copy, pairs)
    return copy


def _map(work: Path, database: Path, count: int, seed: int, on_progress: OnProgress) -> list[Any]:
    """The reconstructions, the one with the most photos first."""
    pycolmap = features.engine()
    options = pycolmap.IncrementalPipelineOptions(min_model_size=3, random_seed=seed, max_num_models=10)
    options.mapper.random_seed = seed
    options.triangulation.random_seed = seed
    out = work / "models"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    placed = [0]

    def one_more() -> None:
        placed[0] += 1

    def start() -> None:
        placed[0] = 2

    def poll() -> None:
        done = min(placed[0], count)
        on_progress(done / count, f"{done} of {count} photos placed")

    found = features.call(
        pycolmap.incremental_mapping,
        database,
        work / "colmap",
        out,
        options=options,
        initial_image_pair_callback=start,
        next_image_callback=one_more,
        poll=poll,
    )
    return sorted(found.values(), key=lambda m: (-m.num_reg_images(), -m.num_points3D()))


@dataclass(frozen=True)
class _Matches:
    """Verified matches of pairs [N,N], and which of the pairs show no parallax [N,N]."""

    counts: Any
    no_parallax: Any


def _matches(database: Path, count: int) -> _Matches:
    pycolmap = features.engine()
    counts = np.zeros((count, count), dtype=np.int64)
    flat = np.zeros((count, count), dtype=bool)
    kinds = pycolmap.TwoViewGeometryConfiguration
    with features.quiet(), contextlib.closing(pycolmap.Database.open(database)) as source:
        for pair, geometry in zip(*source.read_two_view_geometries(), strict=True):
            i, j = (number - 1 for number in pycolmap.pair_id_to_image_pair(pair))
            counts[i, j] = counts[j, i] = len(geometry.inlier_matches)
            flat[i, j] = flat[j, i] = geometry.config in (kinds.PANORAMIC, kinds.PLANAR_OR_PANORAMIC)
    return _Matches(counts, flat)


def reasons_left_out(
    photos: Sequence[RawPhoto], placed: set[int], others: Sequence[Any], matches: _Matches
) -> dict[str, str]:
    """What was wrong with each photo that is not in `placed`."""
    median = float(np.median([photo.sharpness for photo in photos]))
    elsewhere = {
        image_id - 1: model.num_reg_images()
        for model in reversed(others)
        for image_id in model.reg_image_ids()
    }
    found = {}
    inside = sorted(placed)
    for index, photo in enumerate(photos):
        if index in placed:
            continue
        counts = matches.counts[index, inside]
        most = int(counts.max(initial=0))
        if photo.sharpness < BLURRED * median:
            reason = f"blurred ({photo.sharpness / median:.0%} of the sharpness of the others)"
        elif index in elsewhere:
            reason = f"not connected: one of {elsewhere[index]} photos that fit each other, not the rest"
        elif most < FEW_MATCHES:
            reason = f"too few matches (at most {most} with a photo that found its place)"
        elif matches.no_parallax[index, inside][counts >= FEW_MATCHES].all():
            reason = "no parallax (taken from where another was taken)"
        else:
            reason = f"its {most} matches fit no place"
        found[photo.name] = reason
    return found


def _why_none(photos: Sequence[RawPhoto], matches: _Matches) -> str:
    """Why no photos at all fit together, and the cure."""
    good = matches.counts >= FEW_MATCHES
    if not good.any():
        most = int(matches.counts.max(initial=0))
        return (
            f"no two of the {len(photos)} photos have enough in common (at most {most} matches); take them "
            "closer together, sharp, and of things with texture"
        )
    if matches.no_parallax[good].mean() > 0.5:
        return "the photos have no parallax: the camera only turned; walk around what you capture"
    return "the photos match, and fit no common place; take more, closer together, each from another place"


def _write(
    model: Any,
    photos: Sequence[RawPhoto],
    placed: set[int],
    target: Path,
    record: Mapping[str, Any],
    report: PosesReport,
) -> None:
    """The data set, whole or not at all."""
    for index in placed:
        model.image(index + 1).name = photos[index].name
    for image_id in [number for number in model.images if number - 1 not in placed]:
        del model.images[image_id]
    with replaced_folder(target, ("images", "sparse", RECORD)) as draft:
        for index in sorted(placed):
            photo = photos[index]
            place = draft / "images" / photo.name
            place.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.link(photo.path, place)
            except OSError:
                shutil.copy2(photo.path, place)
        (draft / "sparse/0").mkdir(parents=True)
        with features.quiet():
            model.write_binary(draft / "sparse/0")
        summary = {
            "made_of": record,
            "photos": report.total,
            "placed": report.placed,
            "points": report.points,
            "reprojection_error": round(report.error, 4),
            "left_out": dict(report.left_out),
        }
        (draft / RECORD).write_text(json.dumps(summary, indent=1), encoding="utf-8")
