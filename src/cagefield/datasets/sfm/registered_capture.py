"""Data set of registered photos: the report on them, and its files in COLMAP's layout."""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cagefield.datasets.colmap.colmap_files import check_complete
from cagefield.datasets.raw_photos import RawPhoto
from cagefield.datasets.sfm import features
from cagefield.datasets.sfm.raw_masks import VALID_FOLDER
from cagefield.datasets.sfm.sfm_workspace import work_folder
from cagefield.datasets.sfm.transforms_writer import RECORD_FILE, WRITTEN_FILES
from cagefield.errors import DatasetError
from cagefield.files.atomic import replaced_folder


@dataclass(frozen=True)
class PosesReport:
    """Numbers of registered photos and points, and the reasons for photos that were left out.

    Attributes:
        folder: the data set.
        total: number of photos, readable or not.
        placed: number of registered photos.
        points: number of sparse points.
        error: mean reprojection error in pixels.
        left_out: reason, by name, for the other photos.
        moving: number of photos whose features on moving things were left out.
    """

    folder: Path
    total: int
    placed: int
    points: int
    error: float
    left_out: Mapping[str, str] = field(default_factory=dict)
    moving: int = 0


def write_capture(
    model: Any,
    photos: Sequence[RawPhoto],
    placed: set[int],
    target: Path,
    record: Mapping[str, Any],
    report: PosesReport,
) -> None:
    """Write the data set of the photos with the indices `placed`, whole or not at all.

    Renames the images of the model, and removes those of other photos from it.
    """
    for index in placed:
        model.image(index + 1).name = photos[index].name
    for image_id in [number for number in model.images if number - 1 not in placed]:
        del model.images[image_id]
    with replaced_folder(target, WRITTEN_FILES) as draft:
        for index in sorted(placed):
            photo = photos[index]
            link_or_copy(photo.path, draft / "images" / photo.name)
            mask = work_folder(target) / VALID_FOLDER / f"{photo.name}.png"
            if mask.is_file():
                link_or_copy(mask, draft / "masks" / f"{photo.name}.png")
        (draft / "sparse/0").mkdir(parents=True)
        write_model(model, draft / "sparse/0")
        summary = {
            "made_of": record,
            "photos": report.total,
            "placed": report.placed,
            "points": report.points,
            "reprojection_error": round(report.error, 4),
            "left_out": dict(report.left_out),
        }
        (draft / RECORD_FILE).write_text(json.dumps(summary, indent=1), encoding="utf-8")


def link_or_copy(file: Path, target: Path) -> None:
    """Hard-link a file to another path, or copy it where links fail."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(file, target)
    except OSError:
        shutil.copy2(file, target)


def write_model(model: Any, folder: Path) -> None:
    """Write the files of a model. Raises OSError where they are truncated: COLMAP does not notice."""
    with features.silence_log():
        model.write_binary(folder)
    try:
        check_complete(folder)
    except DatasetError as error:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from error
