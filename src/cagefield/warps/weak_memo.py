"""Arrays that are made once in the life of what they are made from."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

Source = TypeVar("Source")
Numbers = NDArray[np.float32]


def kept(make: Callable[[Source], Numbers]) -> Callable[[Source], Numbers]:
    """`make`, called once for each source while it lives; what it returns becomes read-only."""
    known: WeakKeyDictionary[Source, Numbers] = WeakKeyDictionary()

    @wraps(make)
    def once(source: Source) -> Numbers:
        found = known.get(source)
        if found is None:
            found = make(source)
            found.setflags(write=False)
            known[source] = found
        return found

    return once
