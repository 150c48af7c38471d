"""Detection of the capture program that wrote a file or folder, and its reader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cagefield.datasets.programs.meshroom import find_meshroom, is_meshroom, load_meshroom
from cagefield.datasets.programs.metashape import find_metashape, load_metashape
from cagefield.datasets.programs.polycam import find_polycam, load_polycam
from cagefield.datasets.programs.program_json import read_object
from cagefield.datasets.programs.reality_capture import (
    find_reality_capture,
    find_xmp,
    load_reality_capture,
    load_xmp,
)
from cagefield.datasets.programs.record3d import METADATA_FILE, find_record3d, is_record3d, load_record3d
from cagefield.datasets.views import Dataset
from cagefield.errors import DatasetError

Reader = Callable[[Path, int | None, int], Dataset]
"""Function of a path, a factor to shrink by and a holdout, as for `load_dataset`."""

LAYOUTS = (
    "keyframes (Polycam), metadata.json (Record3D), cameras.xml (Metashape), a CSV file or XMP files of "
)
LAYOUTS += "cameras (RealityCapture), cameras.sfm (Meshroom)"


def find_folder_program(folder: Path) -> tuple[Reader, Path] | None:
    """(reader, file or folder that it takes) of a capture program's folder; None for other folders."""
    for find, load in (
        (find_polycam, load_polycam),
        (find_record3d, load_record3d),
        (find_metashape, load_metashape),
        (find_meshroom, load_meshroom),
        (find_reality_capture, load_reality_capture),
        (find_xmp, load_xmp),
    ):
        source = find(folder)
        if source is not None:
            return load, source
    return None


def find_file_program(file: Path) -> tuple[Reader, Path] | None:
    """(reader, file or folder that it takes) of a capture program's file; None for other files."""
    suffix = file.suffix.lower()
    if suffix == ".sfm":
        return load_meshroom, file
    if suffix == ".xml":
        return load_metashape, file
    if suffix == ".csv":
        return load_reality_capture, file
    if suffix == ".xmp":
        return load_xmp, file.parent
    if suffix == ".json":
        return _program_of_json(file)
    return None


def _program_of_json(file: Path) -> tuple[Reader, Path] | None:
    if file.name == METADATA_FILE:
        return load_record3d, file
    if file.name.lower().startswith("sfm"):
        return load_meshroom, file
    try:
        values = read_object(file)
    except DatasetError:
        return None  # the reader of transforms.json says why
    if "frames" in values:
        return None
    if is_meshroom(values):
        return load_meshroom, file
    if is_record3d(values):
        return load_record3d, file
    return (load_polycam, file) if "t_00" in values else None
