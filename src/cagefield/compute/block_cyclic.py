"""Block-cyclic distribution of a kernel loop's items over the CPU's threads.

Quadrants cuts a loop into `compute.devices.parts` contiguous parts, none shorter than MIN_PART_TURNS. Where
items differ in cost, one thread gets the costly ones and the others wait for it. A block-cyclic distribution
gives every thread blocks of ITEMS_PER_BLOCK items in turn:

    schedule = block_cyclic_schedule(items)

    for n in range(turn_count(schedule)):
        i = scheduled_item(n, schedule)
        if i < items:
            ...

On a GPU the items keep their order.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.quadrants import qd

MIN_PART_TURNS = 512
"""Turns of a loop that Quadrants does not divide among threads."""

ITEMS_PER_BLOCK = 64
"""Consecutive items of one thread: two threads should not write to one cache line in turn."""

Schedule = qd.types.vector(3, qd.i32)


def block_cyclic_schedule(items: int, unit: int = ITEMS_PER_BLOCK) -> NDArray[np.int32]:
    """Kernel argument (turns, parts, unit) [3] int32 of a loop over `items`; see the module."""
    parts = 1 if devices.is_gpu() else devices.parts()
    units = -(-items // unit)
    least = -(-MIN_PART_TURNS // unit) if parts > 1 else 1
    return devices.ints((max(-(-units // parts), least), parts, unit))


@qd.func
def scheduled_item(n: qd.i32, schedule: Schedule):
    """Item index of turn n; turns whose index is not below the number of items have none."""
    k = n // schedule[2]
    return ((k % schedule[0]) * schedule[1] + k // schedule[0]) * schedule[2] + n % schedule[2]


@qd.func
def turn_count(schedule: Schedule):
    """Number of turns of the loop."""
    return schedule[0] * schedule[1] * schedule[2]
