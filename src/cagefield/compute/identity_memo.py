"""Memoization of arrays by the identity of their source, as long as the source lives."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

from cagefield.typing import Float32

Source = TypeVar("Source")


def memoized_by_identity(make: Callable[[Source], Float32]) -> Callable[[Source], Float32]:
    """`make` with its array remembered for each living source; the array becomes read-only."""
    known: WeakKeyDictionary[Source, Float32] = WeakKeyDictionary()

    @wraps(make)
    def once(source: Source) -> Float32:
        found = known.get(source)
        if found is None:
            found = make(source)
            found.setflags(write=False)
            known[source] = found
        return found

    return once
