"""Splat files by their names' ends."""

from __future__ import annotations

from pathlib import Path

from cagefield.errors import FieldError
from cagefield.fields.splat import SplatField
from cagefield.formats.splat_ply import read_splat_ply, write_splat_ply


def read_splats(path: str | Path, axes: str | None = None) -> SplatField:
    """The splats of a file. Raises FieldError where there are none."""
    if Path(path).suffix.lower() != ".ply":
        raise FieldError(f"{path}: splats are read from .ply; give such a file")
    return read_splat_ply(path)


def write_splats(field: SplatField, path: str | Path, axes: str | None = None) -> None:
    """Writes splats to a file, complete or not at all."""
    if Path(path).suffix.lower() != ".ply":
        raise FieldError(f"{path}: splats are written as .ply; give such a name")
    write_splat_ply(path, field)
