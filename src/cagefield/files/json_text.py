"""JSON of untrusted files: every fault of the text is a ValueError."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

_DEEPEST = 64
_MOST_DIGITS = 300
"""Of whole numbers: more are no float."""


def loads(
    text: str | bytes,
    object_pairs_hook: Callable[[list[tuple[str, Any]]], dict[str, Any]] | None = None,
    *,
    finite: bool = True,
) -> Any:
    """The value of a JSON text; `object_pairs_hook` as in `json.loads`, with finite=False 1e999 is infinite.

    Raises ValueError (json.JSONDecodeError where it is no JSON) for a text that is nested too deeply, and for
    a number that no float holds.
    """
    try:
        value = json.loads(
            text,
            parse_int=_integer,
            parse_float=_float if finite else float,
            object_pairs_hook=object_pairs_hook,
        )
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    _check_depth(value)
    return value


def _integer(digits: str) -> int:
    if len(digits) > _MOST_DIGITS:
        raise ValueError(f"a number in it has {len(digits)} digits")
    return int(digits)


def _float(digits: str) -> float:
    number = float(digits)
    if number in (float("inf"), float("-inf")):
        raise ValueError(f"a number in it is too large ({digits[:20]})")
    return number


def _check_depth(value: Any) -> None:
    level = [value]
    for _ in range(_DEEPEST):
        level = [
            part
            for whole in level
            if isinstance(whole, (dict, list))
            for part in (whole.values() if isinstance(whole, dict) else whole)
            if isinstance(part, (dict, list))
        ]
        if not level:
            return
    raise ValueError("it is nested too deeply")
