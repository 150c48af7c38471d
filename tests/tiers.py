"""Parameters of tests in tiers: the first with every change, the others in nightly runs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def nightly_after_first(values: Iterable[Any]) -> list[Any]:
    """Parameter sets of the values, tuples as several arguments; all but the first are nightly."""
    sets = [value if isinstance(value, tuple) else (value,) for value in values]
    return [pytest.param(*one, marks=pytest.mark.nightly if n else ()) for n, one in enumerate(sets)]


def nightly_except(values: Iterable[Any], *every_run: Any) -> list[Any]:
    """Parameter sets of the values, tuples as several arguments; all but those in `every_run` are nightly.

    Raises ValueError where `every_run` names a value that is not there.
    """
    sets = list(values)
    if missing := [value for value in every_run if value not in sets]:
        raise ValueError(f"no such parameters: {missing}")
    return [
        pytest.param(
            *(value if isinstance(value, tuple) else (value,)),
            marks=() if value in every_run else pytest.mark.nightly,
        )
        for value in sets
    ]
