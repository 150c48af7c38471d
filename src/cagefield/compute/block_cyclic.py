"""How the items of a kernel's loop are dealt to the CPU's threads.

Quadrants cuts a loop into `compute.devices.parts` contiguous parts, none of them shorter than LEAST turns.
Where
items cost unlike much one thread waits for the others, and a few costly items are all done by one. Dealt out
like cards, some at a time (a block-cyclic distribution), they keep all threads busy:

    deal = loops.deal_of(items)

    for n in range(turns(deal)):
        i = dealt(n, deal)
        if i < items:
            ...

On a GPU the items keep their order.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.quadrants import qd

LEAST = 512
"""Turns of a loop that Quadrants does not cut."""

UNIT = 64
"""Items that are dealt together: threads should not write to the same cache line in turn."""

Deal = qd.types.vector(3, qd.i32)


def deal_of(items: int, unit: int = UNIT) -> NDArray[np.int32]:
    """The argument (turns, parts, unit) of a kernel that loops over so many items; see the module."""
    parts = 1 if devices.is_gpu() else devices.parts()
    units = -(-items // unit)
    least = -(-LEAST // unit) if parts > 1 else 1
    return devices.ints((max(-(-units // parts), least), parts, unit))


@qd.func
def dealt(n: qd.i32, deal: Deal):
    """The item of turn n; there is none where it is not less than their number."""
    k = n // deal[2]
    return ((k % deal[0]) * deal[1] + k // deal[0]) * deal[2] + n % deal[2]


@qd.func
def turns(deal: Deal):
    """How many turns the loop takes."""
    return deal[0] * deal[1] * deal[2]
