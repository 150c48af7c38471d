"""JSON files of capture programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cagefield.datasets.transforms.transforms_json import read_json
from cagefield.errors import DatasetError
from cagefield.files.safe_open import MOST_TEXT


def read_object(path: Path, most: int = MOST_TEXT) -> dict[str, Any]:
    """The object of a JSON file of at most `most` bytes; numbers may be infinite or no numbers.

    Raises DatasetError where it is not one.
    """
    return read_json(path, most, "of a capture program; export it again")


def objects_of(where: str, values: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """The list of objects at a key; empty where there is none. Raises DatasetError for anything else."""
    found = values.get(key) or []
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        raise DatasetError(f"{where}: key {key!r} must be a list of objects")
    return found
