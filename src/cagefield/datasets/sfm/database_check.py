"""COLMAP's database of an earlier run: whole and of the same photos, or made anew.

COLMAP reads what a database says without looking: wrong numbers end its process, or keep it busy for ever.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.datasets.sfm.features import Photo
from cagefield.errors import DatasetError
from cagefield.files.safe_open import check_regular

_PAIRS = 2**31 - 1
"""COLMAP's number of a pair is this times the first photo's, and the second one's."""

_WIDTHS = {"keypoints": (2, 4, 6), "descriptors": (128,), "matches": (2,), "two_view_geometries": (2,)}
"""Numbers in a row of each table of arrays."""

_BYTES = {"descriptors": 1}
"""Bytes of such a number, 4 if left out."""

_GEOMETRY = {"F": 72, "E": 72, "H": 72, "qvec": 32, "tvec": 24}
"""Bytes of what else is known of a pair, where it is known."""


def check_database(database: Path, cameras: Sequence[Any], photos: Sequence[Photo]) -> None:
    """Removes a database that is damaged or of others than these, with a warning that says so.

    The cameras are pycolmap's, as `create_database` is given them. Raises DatasetError for one that may not
    be written. Nothing else has it open meanwhile: SQLite's locks do not know of each other where two
    libraries of it are in one process.
    """
    if not database.exists():
        return
    try:
        check_regular(database)
    except OSError as error:
        raise DatasetError(f"{database} is in the way ({error.strerror}); move it away") from None
    folder = database.parent
    if not (os.access(database, os.R_OK | os.W_OK) and os.access(folder, os.W_OK)):
        raise DatasetError(f"{database} may not be written; make it and {folder} writable, or move it away")
    said: str | None
    try:
        with contextlib.closing(sqlite3.connect(database)) as opened:
            said = _problem(opened, cameras, photos)
    except sqlite3.OperationalError as error:
        if not str(error).startswith("no such"):  # locked, or the disk's fault: COLMAP says what
            return
        said = str(error)
    except (sqlite3.DatabaseError, TypeError, ValueError, OverflowError) as error:
        said = str(error)
    if said is None:
        return
    reason = " ".join(said.split())[:120]
    warnings.warn(f"{database} is damaged ({reason}); features and matches are found anew", stacklevel=2)
    for file in folder.glob("database.db*"):
        file.unlink()


def _problem(opened: sqlite3.Connection, cameras: Sequence[Any], photos: Sequence[Photo]) -> str | None:
    """What is wrong with a database; None where nothing is. Raises sqlite3's errors, and ValueError."""
    said = str(opened.execute("PRAGMA quick_check(1)").fetchone()[0])
    if said != "ok":
        return said
    if not opened.execute("SELECT 1 FROM sqlite_master WHERE name = 'images'").fetchone():
        return "it holds no photos"
    for query, expected in _written(cameras, photos):
        found = opened.execute(query)
        if any(row != next(found, None) for row in expected) or found.fetchone() is not None:
            return "it is of other photos"
    if opened.execute("SELECT 1 FROM rig_sensors").fetchone():
        return "it has cameras that move together"
    counts = dict.fromkeys(range(1, len(photos) + 1), 0)
    return _features_problem(opened, counts) or _pairs_problem(opened, counts)


def _written(
    cameras: Sequence[Any], photos: Sequence[Photo]
) -> Iterator[tuple[str, Iterator[tuple[object, ...]]]]:
    """Queries of what `create_database` writes, and their rows."""
    camera_numbers, photo_numbers = range(1, len(cameras) + 1), range(1, len(photos) + 1)
    owners = [photo.camera + 1 for photo in photos]
    yield (
        "SELECT camera_id, model, width, height, params, prior_focal_length FROM cameras ORDER BY camera_id",
        (
            (
                number,
                int(camera.model),
                camera.width,
                camera.height,
                np.asarray(camera.params, np.float64).tobytes(),
                int(camera.has_prior_focal_length),
            )
            for number, camera in zip(camera_numbers, cameras, strict=True)
        ),
    )
    yield (
        "SELECT rig_id, ref_sensor_id, ref_sensor_type FROM rigs ORDER BY rig_id",
        ((number, number, 0) for number in camera_numbers),
    )
    yield (
        "SELECT image_id, name, camera_id FROM images ORDER BY image_id",
        zip(photo_numbers, (photo.name for photo in photos), owners, strict=True),
    )
    yield (
        "SELECT frame_id, rig_id FROM frames ORDER BY frame_id",
        zip(photo_numbers, owners, strict=True),
    )
    yield (
        "SELECT frame_id, data_id, sensor_id, sensor_type FROM frame_data ORDER BY frame_id",
        ((number, number, owner, 0) for number, owner in zip(photo_numbers, owners, strict=True)),
    )


def _features_problem(opened: sqlite3.Connection, counts: dict[int, int]) -> str | None:
    """The same of features; `counts` then has those of each photo."""
    for photo, values in _arrays(opened, "keypoints", "image_id"):
        if photo not in counts:
            return "it has features of other photos"
        if not np.isfinite(np.frombuffer(values, np.float32)).all():
            return f"features of photo {photo} have no places"
    counts.update(opened.execute("SELECT image_id, rows FROM keypoints"))
    if opened.execute("SELECT 1 FROM descriptors WHERE type != 0").fetchone():
        return "its features are of another type"
    for photo, rows, cols, size in opened.execute(
        "SELECT image_id, rows, cols, length(CAST(data AS BLOB)) FROM descriptors"
    ):
        _check_array("descriptors", rows, cols, size or 0)
        if photo not in counts or rows != counts[photo]:
            return f"photo {photo!s:.30} has {counts.get(photo, 0)} features, and {rows} are described"
    return None


def _pairs_problem(opened: sqlite3.Connection, counts: dict[int, int]) -> str | None:
    """The same of matches, whose features must be there."""
    for table in ("matches", "two_view_geometries"):
        for pair, values in _arrays(opened, table, "pair_id"):
            first, second = divmod(pair, _PAIRS)
            if not (first in counts and second in counts and first < second):
                return "it has matches of other photos"
            matches = np.frombuffer(values, np.uint32).reshape(-1, 2)
            if (matches >= (counts[first], counts[second])).any():
                return f"photos {first} and {second} match in features that are not there"
    for name, size in _GEOMETRY.items():
        query = f"SELECT 1 FROM two_view_geometries WHERE length(CAST({name} AS BLOB)) NOT IN (0, {size})"
        if opened.execute(query).fetchone():
            return f"{name} of a pair is no matrix"
    return None


def _arrays(opened: sqlite3.Connection, table: str, key: str) -> Iterator[tuple[int, bytes]]:
    """The arrays of a table by their numbers. Raises ValueError for one that is not as long as it says."""
    for number, rows, cols, data in opened.execute(f"SELECT {key}, rows, cols, data FROM {table}"):
        if data is not None and not isinstance(data, bytes):
            raise ValueError(f"{table} are no numbers")
        _check_array(table, rows, cols, len(data or b""))
        yield number, data or b""


def _check_array(table: str, rows: int, cols: int, size: int) -> None:
    """Raises ValueError for an array that is not as long as it says, or as wide as those of its table."""
    wide = cols in _WIDTHS[table] or (rows == 0 and not size)
    if not wide or rows < 0 or rows * cols * _BYTES.get(table, 4) != size:
        raise ValueError(f"{table} are {rows} x {cols} numbers in {size} bytes")
