"""Arrays that are made once in the life of what they are made from."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

from cagefield.typing import Float32

Source = TypeVar("Source")


def kept(make: Callable[[Source], Float32]) -> Callable[[Source], Float32]:
    """`make`, called once for each source while it lives; what it returns becomes read-only."""
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
