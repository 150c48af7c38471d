"""Checks of a checkpoint's contents against the forms that a training writes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import CagefieldError

MAX_COUNT = 2**53
"""Largest count; every whole number up to it is exact as a float."""

ArrayForm = tuple[str, tuple[int | str, ...]]
"""(name of the dtype, lengths); a letter stands for one length that several arrays share."""


@contextmanager
def reject_damage(path: Path) -> Iterator[None]:
    """Turn errors of inconsistent contents into one-line CagefieldErrors that say to start anew."""
    try:
        yield
    except (KeyError, ValueError, TypeError, IndexError, OverflowError, AttributeError) as error:
        if isinstance(error, CagefieldError):
            raise
        reason = " ".join(str(error).split())
        raise CagefieldError(f"{path}: a damaged checkpoint ({reason:.120}); start anew") from error


def check_arrays(arrays: Mapping[str, NDArray[Any]], forms: Mapping[str, ArrayForm]) -> dict[str, int]:
    """Length of each letter in `forms`. Raises ValueError for an array of another form."""
    lengths: dict[str, int] = {}
    for name, (dtype, shape) in forms.items():
        if name not in arrays:
            raise ValueError(f"it has no {name}")
        array = arrays[name]
        fits = array.dtype == np.dtype(dtype) and array.ndim == len(shape)
        for length, wanted in zip(array.shape, shape, strict=False):
            fits &= length == (lengths.setdefault(wanted, length) if isinstance(wanted, str) else wanted)
        if not fits:
            expected = ", ".join(str(lengths.get(str(length), length)) for length in shape)
            raise ValueError(f"{name} is {array.dtype} {list(array.shape)!s:.40}, not {dtype} [{expected}]")
    return lengths


def check_finite(arrays: Mapping[str, NDArray[Any]], names: tuple[str, ...]) -> None:
    """Check that the named arrays are finite. Raises ValueError."""
    for name in names:
        if not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} holds NaN or infinity")


def check_counts(values: Mapping[str, Any], **most: int) -> None:
    """Check that the named values are whole numbers from 0 to `most`. Raises ValueError."""
    for name, highest in most.items():
        value = values[name]
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= highest:
            raise ValueError(f"{name} is {value!s:.20}, not a whole number up to {highest}")


def check_run(values: Mapping[str, Any], loss: str) -> None:
    """Check the step, the seconds and the value named `loss` of a run. Raises ValueError."""
    check_counts(values, step=MAX_COUNT)
    for name, value in (("seconds", values["seconds"]), (loss, values[loss])):
        if not isinstance(value, (int, float)) or value < 0 or math.isinf(value):
            raise ValueError(f"{name} is {value!s:.20}, not a number from 0")
    if math.isnan(values["seconds"]):
        raise ValueError("seconds is no number")
