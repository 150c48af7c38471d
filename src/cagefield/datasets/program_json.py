"""JSON files of capture programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from cagefield import json_text
from cagefield.errors import DatasetError
from cagefield.regular_files import MOST_TEXT, read_bytes


def read_object(path: Path, most: int = MOST_TEXT) -> dict[str, Any]:
    """The object of a JSON file of at most `most` bytes; numbers may be infinite or no numbers.

    Raises DatasetError where it is not one.
    """
    try:
        values = json_text.loads(read_bytes(path, most).decode("utf-8-sig"), finite=False)
    except json.JSONDecodeError as error:
        raise DatasetError(
            f"{path}: not valid JSON at line {error.lineno}, column {error.colno} ({error.msg}); "
            "the file may be cut off, copy it again"
        ) from None
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path}: cannot be read ({error})") from None
    if not isinstance(values, dict):
        raise DatasetError(f"{path}: must be a JSON object; export it again")
    return values


def objects_of(where: str, values: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """The list of objects at a key; empty where there is none. Raises DatasetError for anything else."""
    found = values.get(key) or []
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        raise DatasetError(f"{where}: key {key!r} must be a list of objects")
    return found
