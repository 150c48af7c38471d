"""The record that a batch of rays leaves for each slot of the grid, in an accumulator.

A record has HEAD + 3K floats: density gradient, density curvature sum_c (dC_c/ds)^2, colour curvature w^2,
largest weight, then the 3K colour gradients (basis-major). On a CPU each worker adds into its own
accumulator, so that no atomics are needed and the sums do not depend on timing; on a GPU one accumulator is
shared, with atomic adds.
"""

from cagefield.compute.quadrants import qd

HEAD = 4
"""Floats of a record before its colour gradients."""


@qd.func
def add(target: qd.template(), at: qd.i32, value: qd.f32, gpu: qd.template()):
    """target[at] += value, atomically on a GPU only."""
    if qd.static(gpu):
        qd.atomic_add(target[at], value)
    else:
        target[at] = target[at] + value
