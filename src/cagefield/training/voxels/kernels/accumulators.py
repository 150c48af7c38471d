"""Accumulator records: sums over a batch of rays for each slot of the grid.

A record has HEADER_FLOATS + 3K floats: density gradient, density curvature sum_c (dC_c/ds)^2, color curvature
w^2, maximum weight, then the 3K color gradients (basis-major). On a CPU each worker adds to its own
accumulator, without atomics, so the sums do not depend on timing; on a GPU all workers share one accumulator,
to which vertices add the samples around them (`kernels.sample_lists`), or workers by atomic adds.

A batch meets few of a large grid's slots. Each accumulator has flags, one for each group of consecutive slots
(spatial neighbors: slots are in brick order), so that passes after the march read the groups met alone: on
a grid of 2.5 million slots a look at each record takes longer than the march.
"""

from cagefield.compute.quadrants import qd

HEADER_FLOATS = 4
"""Floats of a record before its color gradients."""

GROUP_BITS = 4
"""Binary logarithm of the number of consecutive slots that share a flag on a CPU; on a GPU none do."""


@qd.func
def add(target: qd.template(), at: qd.i32, value: qd.f32, gpu: qd.template()):
    """target[at] += value, atomically on a GPU only."""
    if qd.static(gpu):
        qd.atomic_add(target[at], value)
    else:
        target[at] = target[at] + value


@qd.func
def add_max(target: qd.template(), at: qd.i32, value: qd.f32, gpu: qd.template()):
    """target[at] = max(target[at], value), atomically on a GPU only."""
    if qd.static(gpu):
        qd.atomic_max(target[at], value)
    else:
        target[at] = qd.max(target[at], value)
