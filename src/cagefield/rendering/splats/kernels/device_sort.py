"""Stable radix sort and exclusive prefix sums on Quadrants' devices.

Least significant digit first, 8 bits a pass. One thread sorts a chunk of items: it counts the digits of its
chunk, an exclusive scan of the counts (digit by digit, chunk by chunk within) gives the position of each
chunk's first item of each digit, and the thread moves its items there in their order. No atomics and no
shared memory: the order depends on nothing but the keys, and every device runs the same code. Functions are
called at the top level of kernels: each of their loops is a launch of its own on the device, and a kernel of
many loops is one call of the host.

Source: Knuth, "The Art of Computer Programming", volume 3, section 5.2.5; Blelloch, "Prefix sums and their
applications" (1990).
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import I32

DIGIT_BITS = 8
DIGITS = 1 << DIGIT_BITS

SCAN_BLOCK = 128
"""Values that one thread sums in a level of a scan."""


@dataclass(frozen=True, eq=False)
class SortArgs:
    """Scratch memory of sorts and scans, int32.

    counts [DIGITS * ceil(number / chunk)], other_keys and other_values [number]; sums and tops have an item
    for each SCAN_BLOCK values of a scan, and of sums.
    """

    counts: I32
    sums: I32
    tops: I32
    other_keys: I32
    other_values: I32
    chunk: qd.i32


@qd.func
def scan_blocks(values: qd.template(), sums: qd.template(), tops: qd.template(), number: qd.i32):
    """Replace values [number] by the sums of those before them."""
    blocks = (number + SCAN_BLOCK - 1) // SCAN_BLOCK
    top_blocks = (blocks + SCAN_BLOCK - 1) // SCAN_BLOCK
    qd.loop_config(block_dim=64)
    for b in range(blocks):
        total = 0
        for i in range(b * SCAN_BLOCK, qd.min((b + 1) * SCAN_BLOCK, number)):
            total += values[i]
        sums[b] = total
    qd.loop_config(block_dim=64)
    for b in range(top_blocks):
        total = 0
        for i in range(b * SCAN_BLOCK, qd.min((b + 1) * SCAN_BLOCK, blocks)):
            total += sums[i]
        tops[b] = total
    for _ in range(1):
        total = 0
        for i in range(top_blocks):
            here = tops[i]
            tops[i] = total
            total += here
    qd.loop_config(block_dim=64)
    for b in range(top_blocks):
        total = tops[b]
        for i in range(b * SCAN_BLOCK, qd.min((b + 1) * SCAN_BLOCK, blocks)):
            here = sums[i]
            sums[i] = total
            total += here
    qd.loop_config(block_dim=64)
    for b in range(blocks):
        total = sums[b]
        for i in range(b * SCAN_BLOCK, qd.min((b + 1) * SCAN_BLOCK, number)):
            here = values[i]
            values[i] = total
            total += here


@qd.func
def sort_digit(
    keys: qd.template(),
    values: qd.template(),
    sorted_keys: qd.template(),
    sorted_values: qd.template(),
    scratch: SortArgs,
    number: qd.i32,
    shift: qd.template(),
):
    """Write keys and values [number] in stable order of the digit at bit `shift` of the keys."""
    chunks = (number + scratch.chunk - 1) // scratch.chunk
    qd.loop_config(block_dim=64)
    for c in range(chunks):
        for d in range(DIGITS):
            scratch.counts[d * chunks + c] = 0
        for i in range(c * scratch.chunk, qd.min((c + 1) * scratch.chunk, number)):
            at = ((keys[i] >> shift) & (DIGITS - 1)) * chunks + c
            scratch.counts[at] = scratch.counts[at] + 1
    scan_blocks(scratch.counts, scratch.sums, scratch.tops, DIGITS * chunks)
    qd.loop_config(block_dim=64)
    for c in range(chunks):
        for i in range(c * scratch.chunk, qd.min((c + 1) * scratch.chunk, number)):
            at = ((keys[i] >> shift) & (DIGITS - 1)) * chunks + c
            to = scratch.counts[at]
            scratch.counts[at] = to + 1
            sorted_keys[to] = keys[i]
            sorted_values[to] = values[i]


@qd.func
def sort_digits(
    keys: qd.template(), values: qd.template(), scratch: SortArgs, number: qd.i32, passes: qd.template()
):
    """Sort by the lowest `passes` digits; for odd `passes` the result is in the other arrays of `scratch`."""
    for digit in qd.static(range(passes)):
        if qd.static(digit % 2 == 0):
            sort_digit(
                keys, values, scratch.other_keys, scratch.other_values, scratch, number, digit * DIGIT_BITS
            )
        else:
            sort_digit(
                scratch.other_keys, scratch.other_values, keys, values, scratch, number, digit * DIGIT_BITS
            )


@qd.kernel(fastcache=True)
def exclusive_scan(values: I32, sums: I32, tops: I32, number: qd.i32):
    """Replace values [number] by the sums of those before them; see `SortArgs`."""
    scan_blocks(values, sums, tops, number)


@qd.kernel(fastcache=True)
def sort(keys: I32, values: I32, scratch: SortArgs, number: qd.i32, passes: qd.template()):
    """Sort keys [number], none of them negative, and their values; see `sort_digits`."""
    sort_digits(keys, values, scratch, number, passes)
