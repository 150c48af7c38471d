"""Files that finding poses keeps for its next run, and videos: honest seeds, and how they are read."""

from __future__ import annotations

import contextlib
import json
import shutil
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from reader_seeds import Reader

from cagefield.datasets import raw_photos
from cagefield.datasets.sfm import registration_report, sfm_workspace, sparse_points, structure_from_motion
from cagefield.datasets.sfm.database_check import check_database, recorded_digest
from cagefield.datasets.sfm.features import Photo
from cagefield.errors import CagefieldError
from cagefield.images.video import is_cagefield_video, open_encoder
from posed_photos import photos_alone


def _no_progress(done: float, note: str) -> None:
    """Nobody is told."""


def _make_photos(count: int, folder: Path) -> None:
    from PIL import Image

    photos = photos_alone(folder / "photos")
    for file in photos.iterdir():
        with Image.open(file) as image:
            small = image.resize((16, 12))
        small.save(file)
    for n in range(4, count):
        shutil.copy(photos / "00.png", photos / f"{n:02}.png")
    (folder / "work").mkdir()
    sfm_workspace.prepare_photos(photos, folder / "work", 3, _no_progress)


def _read_photos(folder: Path) -> None:
    """The list, copies for COLMAP, and its guesses of cameras."""
    work = folder / "work"
    known = sfm_workspace._read_photo_list(work / "photos.json", work / "images")
    if known is None:
        raise CagefieldError("it is damaged, and the photos are read again")
    shutil.rmtree(work / "colmap", ignore_errors=True)
    sfm_workspace.link_plain_names(known[0], work)
    structure_from_motion.guess_cameras(known[0])


def _record_reader(files: int) -> Reader:
    """Of what so many photos are known by."""
    record = {"version": 1, "files": [["a.png", 12, 34 + n] for n in range(files)]}

    def prepare(folder: Path) -> None:
        sfm_workspace.prepare_work(folder / "work", record)

    return Reader(prepare, prepare, {"work/made_of.json": "json"})


def _make_poses(left_out: int, folder: Path) -> None:
    photos = photos_alone(folder / "photos")
    (folder / "data").mkdir()
    blurred = {f"a{n}": "blurred" for n in range(left_out)}
    made = {"made_of": sfm_workspace.photo_record(photos, 80), "photos": 4, "left_out": blurred}
    (folder / "data" / "poses.json").write_text(json.dumps(made))


def _read_poses(folder: Path) -> None:
    if not structure_from_motion.is_built_from(folder / "data", folder / "photos"):
        raise CagefieldError("it is of other photos, or damaged")


def _make_points(count: int, folder: Path) -> None:
    from cagefield.datasets.views import SparsePoints

    chance = np.random.default_rng(0)
    seen = tuple(frozenset((f"photo {n % 3}", f"photo {n % 5}")) for n in range(count))
    rgb = chance.integers(0, 256, (count, 3)).astype(np.uint8)
    found = SparsePoints(chance.normal(size=(count, 3)), rgb, seen, np.ones(count))
    sparse_points.write_cached_points(folder / "points-1.npz", found)


def _read_points(folder: Path) -> None:
    found = sparse_points.read_cached_points(folder / "points-1.npz")
    if found is None:
        raise CagefieldError("it is damaged, and the points are found again")
    found.take(np.arange(len(found)) % 2 == 0)


def _cameras_and_photos() -> tuple[list[Any], list[Photo]]:
    import pycolmap

    camera = pycolmap.Camera.create_from_model_name(1, "SIMPLE_RADIAL", 30.0, 24, 16)
    return [camera], [Photo(f"{n:06}.png", 0) for n in range(3)]


def _make_database(count: int, folder: Path) -> None:
    """Three photos of `count` features each, all matched."""
    import pycolmap

    from cagefield.datasets.sfm import features

    features.create_database(folder / "database.db", *_cameras_and_photos())
    chance, pairs = np.random.default_rng(0), np.stack([np.arange(count, dtype=np.uint32)] * 2, axis=1)
    with features.open_database(folder / "database.db") as database:
        for n in range(1, 4):
            database.write_keypoints(n, chance.uniform(0, 16, (count, 4)).astype(np.float32))
            kinds = pycolmap.FeatureExtractorType.SIFT
            found = pycolmap.FeatureDescriptors(kinds, chance.integers(0, 256, (count, 128)).astype(np.uint8))
            database.write_descriptors(n, found)
        for first, second in ((1, 2), (1, 3), (2, 3)):
            database.write_matches(first, second, pairs)
            geometry = pycolmap.TwoViewGeometry()
            geometry.inlier_matches = pairs
            geometry.config = pycolmap.TwoViewGeometryConfiguration.CALIBRATED
            database.write_two_view_geometry(first, second, geometry)
    with contextlib.suppress(InterruptedError), recorded_digest(folder / "database.db"):
        raise InterruptedError


def _read_database(folder: Path) -> None:
    """A copy of the database: COLMAP writes into a database that it opens."""
    from cagefield.datasets.sfm import features

    database = folder / "run" / "database.db"
    shutil.rmtree(database.parent, ignore_errors=True)
    database.parent.mkdir()
    for name in ("database.db", "database.db.digest"):
        shutil.copyfile(folder / name, database.parent / name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_database(database)
    if not database.exists():
        raise CagefieldError("it is damaged, and the features are found again")
    features.select_likely_pairs(database, 3)
    registration_report.verified_matches(database, 3)


def _make_video(folder: Path) -> None:
    chance = np.random.default_rng(0)
    with open_encoder(folder / "v.mp4", (32, 24), 10.0, 30) as encode:
        for _ in range(6):
            encode(chance.integers(0, 256, (24, 32, 3)).astype(np.uint8).tobytes())


def _read_video(folder: Path) -> None:
    shutil.rmtree(folder / "frames", ignore_errors=True)
    raw_photos.extract_video_frames(folder / "v.mp4", 3, folder / "frames")


def _read_replaced_video(folder: Path) -> None:
    if not is_cagefield_video(folder / "v.mp4"):
        raise CagefieldError("it is none of ours, and stays")


def work_readers(
    photos: int = 4, files: int = 1, left_out: int = 1, points: int = 60, features: int = 10
) -> dict[str, Reader]:
    """Of what is kept of so many photos, of files of them, of photos left out, of points, and of features."""
    return {
        "poses, photos.json": Reader(
            partial(_make_photos, photos), _read_photos, {"work/photos.json": "json"}
        ),
        "poses, made_of.json": _record_reader(files),
        "poses.json": Reader(partial(_make_poses, left_out), _read_poses, {"data/poses.json": "json"}),
        "poses, points .npz": Reader(partial(_make_points, points), _read_points, {"points-1.npz": "zip"}),
        "poses, database.db": Reader(
            partial(_make_database, features), _read_database, {"database.db": "bytes"}
        ),
    }


POSES_READERS: dict[str, Reader] = {
    **work_readers(),
    "video, frames of": Reader(_make_video, _read_video, {"v.mp4": "bytes"}),
    "video, replaced": Reader(_make_video, _read_replaced_video, {"v.mp4": "bytes"}),
}
