"""Parsing of numbers in files of other programs: JSON numbers, or numbers in text."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.errors import DatasetError

FloatArray = npt.NDArray[np.float64]

_MAX_NUMBER_CHARACTERS = 400  # characters of a number


def parse_number(where: str, value: Any) -> float:
    """Finite number of a JSON value or a text. Raises DatasetError, which begins with `where`."""
    number = _float(value)
    if number is None or not np.isfinite(number):
        raise DatasetError(f"{where} must be a finite number, got {value!r:.40}")
    return number


def parse_numbers(where: str, values: Any, count: int) -> FloatArray:
    """Array [count] of the numbers of a list, or of a text with spaces between them, finite or not.

    Raises DatasetError, which begins with `where`.
    """
    parts = (
        values.split()
        if isinstance(values, str) and len(values) <= count * _MAX_NUMBER_CHARACTERS
        else values
    )
    if isinstance(parts, list) and len(parts) == count:
        numbers = [_float(part) for part in parts]
        if None not in numbers:
            return np.array(numbers, dtype=np.float64)
    raise DatasetError(f"{where} must be {count} numbers, got {values!r:.80}")


def parse_pixel_count(where: str, value: Any) -> int:
    """Whole number of pixels, at least 1. Raises DatasetError, which begins with `where`."""
    count = parse_number(where, value)
    if count < 1 or count != int(count):
        raise DatasetError(f"{where} must be a whole number of pixels, got {value!r:.40}")
    return int(count)


def _float(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    if isinstance(value, str) and len(value) > _MAX_NUMBER_CHARACTERS:
        return None
    try:
        return float(value)
    except (ValueError, OverflowError):
        return None
