"""Values of `transforms*.json`: tolerant JSON, numbers in text, pose matrices."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera_checks import RIGID_TOLERANCE
from cagefield.errors import DatasetError
from cagefield.files import json_text
from cagefield.files.safe_open import MAX_TEXT_BYTES, read_bytes

FloatArray = npt.NDArray[np.float64]

_UTF16_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
# A pattern without an end is taken to the end of the text, so that each character is looked at once.
_STRING = r'"[^"\\]*(?:\\.[^"\\]*)*(?:"|\Z)'
_COMMENT_PATTERN = re.compile(_STRING + r"|//[^\n]*|/\*.*?(?:\*/|\Z)", re.DOTALL)
_COMMA_PATTERN = re.compile(_STRING + r"|,(?=\s*[}\]])", re.DOTALL)


def read_json(
    path: Path, max_bytes: int = MAX_TEXT_BYTES, expected: str = "with the key 'frames'"
) -> dict[str, Any]:
    """Object of a JSON file of at most `max_bytes`, in UTF-8, or UTF-16 with its byte order mark.

    Comments and trailing commas are ignored; `expected` names the object's content in an error. NaN and
    infinite numbers are kept: the reader of a value checks it.

    Raises DatasetError, with line and column, where the content is no JSON object.
    """
    try:
        content = read_bytes(path, max_bytes)
        text = content.decode(_UTF16_MARKS.get(content[:2], "utf-8-sig"))
        try:
            values = json_text.loads(text, finite=False)
        except json.JSONDecodeError:
            values = json_text.loads(_to_strict_json(text), finite=False)
    except json.JSONDecodeError as error:
        raise DatasetError(
            f"{path}: not valid JSON at line {error.lineno}, column {error.colno} ({error.msg}); "
            "the file may be cut off, copy it again"
        ) from None
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path}: cannot be read ({error})") from None
    if not isinstance(values, dict):
        raise DatasetError(f"{path}: must be a JSON object {expected}")
    return values


def _to_strict_json(text: str) -> str:
    """Text without comments (their line breaks stay) and without commas before a closing bracket."""
    return _blank_matches(_COMMA_PATTERN, _blank_matches(_COMMENT_PATTERN, text))


def _blank_matches(pattern: re.Pattern[str], text: str) -> str:
    """Text with spaces in place of the pattern's matches outside of strings; line breaks stay."""
    parts, copied_to = list[str](), 0
    for match in pattern.finditer(text):
        begin, end = match.span()
        if text[begin] != '"':
            parts += [
                text[copied_to:begin],
                "\n".join(" " * len(line) for line in text[begin:end].split("\n")),
            ]
            copied_to = end
    return "".join([*parts, text[copied_to:]])


def read_number(where: str, source: dict[str, Any], key: str) -> float | None:
    """Finite number of a key, given as a number or text; None where the key is missing or null.

    Raises DatasetError for anything else.
    """
    value = source.get(key)
    if value is None:
        return None
    result = math.nan
    if isinstance(value, (int, float, str)) and not isinstance(value, bool):
        try:
            result = float(value)
        except ValueError:
            result = math.nan
    if not math.isfinite(result):
        raise DatasetError(f"{where}: key {key!r} must be a finite number, got {value!r:.40}")
    return result


def read_matrix(where: str, value: Any) -> FloatArray:
    """Matrix [4,4] of 3 or 4 rows; its entries may be text, and need not be finite."""
    try:
        result = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        result = np.empty(0)
    if result.shape == (3, 4):
        result = np.concatenate([result, [[0.0, 0.0, 0.0, 1.0]]])
    if result.shape != (4, 4):
        raise DatasetError(f"{where} must be 4 rows (or 3) of 4 numbers")
    return result


def remove_scale(pose: FloatArray) -> tuple[FloatArray, float]:
    """(pose [4,4] without the uniform scale of its 3x3 part, that scale); the scale is 1 where there
    is none.
    """
    part = pose[:3, :3]
    scale = float(np.cbrt(np.linalg.det(part)))
    if not (0 < scale < np.inf) or abs(scale**2 - 1.0) <= RIGID_TOLERANCE:
        return pose, 1.0
    rotation = part / scale
    if float(np.abs(rotation.T @ rotation - np.eye(3)).max()) > RIGID_TOLERANCE:
        return pose, 1.0
    pose = pose.copy()
    pose[:3, :3] = rotation
    return pose, scale


def read_box(where: str, value: object) -> npt.NDArray[np.float64]:
    """Scene box [2,3] that a file gives as [[min], [max]]."""
    try:
        box = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        box = np.full((2, 3), np.nan)
    if box.shape != (2, 3) or not np.isfinite(box).all() or not (box[0] < box[1]).all():
        raise DatasetError(f"{where}: key 'aabb' must be [[min x, y, z], [max x, y, z]], got {value!r:.80}")
    return box
