"""JSON files of capture programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cagefield.datasets.transforms.transforms_json import read_json
from cagefield.errors import DatasetError
from cagefield.files.safe_open import MAX_TEXT_BYTES


def read_object(path: Path, max_bytes: int = MAX_TEXT_BYTES) -> dict[str, Any]:
    """Object of a JSON file of at most `max_bytes`; numbers may be infinite or NaN.

    Raises DatasetError where the content is no object.
    """
    return read_json(path, max_bytes, "of a capture program; export it again")


def read_objects(where: str, values: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """List of objects at a key; empty where there is none. Raises DatasetError for anything else."""
    objects = values.get(key) or []
    if not isinstance(objects, list) or not all(isinstance(one, dict) for one in objects):
        raise DatasetError(f"{where}: key {key!r} must be a list of objects")
    return objects
