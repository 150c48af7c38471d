"""Times of actions whose ratio counts."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import CagefieldError


def interleaved(actions: Sequence[Callable[[], object]], rounds: int) -> NDArray[np.float64]:
    """Seconds [rounds, actions]: in each round every action runs once, in turn (A B A B ...).

    What else the machine does then meets all of them alike. One round before them is not counted.

    Raises:
        CagefieldError: rounds < 1.
    """
    if rounds < 1:
        raise CagefieldError(f"rounds is {rounds}; it must be at least 1")
    seconds = np.empty((rounds + 1, len(actions)))
    for round_ in seconds:
        for index, action in enumerate(actions):
            began = time.perf_counter()
            action()
            round_[index] = time.perf_counter() - began
    return seconds[1:]
