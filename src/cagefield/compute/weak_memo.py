"""Memoization of values for living sources: equal sources share a value."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

import numpy as np

Source = TypeVar("Source")
Value = TypeVar("Value")


def memoized_weakly(make: Callable[[Source], Value]) -> Callable[[Source], Value]:
    """`make` with its value remembered for each living source; an array becomes read-only.

    A value that holds its source keeps the source alive: values hold no source.
    """
    known: WeakKeyDictionary[Source, Value] = WeakKeyDictionary()

    @wraps(make)
    def once(source: Source) -> Value:
        if source not in known:
            made = make(source)
            if isinstance(made, np.ndarray):
                made.setflags(write=False)
            known[source] = made
        return known[source]

    return once
