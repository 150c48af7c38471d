"""Numbers in files of other programs: JSON's, or text as some programs write them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.errors import DatasetError

FloatArray = npt.NDArray[np.float64]

_MAX_DIGITS = 400  # characters of a number


def as_number(where: str, value: Any) -> float:
    """A finite number, or text that is one. Raises DatasetError, which begins with `where`."""
    found = _float(value)
    if found is None or not np.isfinite(found):
        raise DatasetError(f"{where} must be a finite number, got {value!r:.40}")
    return found


def as_numbers(where: str, values: Any, count: int) -> FloatArray:
    """`count` numbers of a list, or of text with spaces between them, finite or not.

    Raises DatasetError, which begins with `where`.
    """
    parts = values.split() if isinstance(values, str) and len(values) <= count * _MAX_DIGITS else values
    if isinstance(parts, list) and len(parts) == count:
        found = [_float(part) for part in parts]
        if None not in found:
            return np.array(found, dtype=np.float64)
    raise DatasetError(f"{where} must be {count} numbers, got {values!r:.80}")


def as_size(where: str, value: Any) -> int:
    """A whole number of pixels, from 1. Raises DatasetError, which begins with `where`."""
    found = as_number(where, value)
    if found < 1 or found != int(found):
        raise DatasetError(f"{where} must be a whole number of pixels, got {value!r:.40}")
    return int(found)


def _float(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    if isinstance(value, str) and len(value) > _MAX_DIGITS:
        return None
    try:
        return float(value)
    except (ValueError, OverflowError):
        return None
