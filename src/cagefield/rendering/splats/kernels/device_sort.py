"""Stable radix sort and exclusive prefix sums on Quadrants' devices.

Least significant digit first, 8 bits a pass. One thread sorts a chunk of CHUNK items: it counts the digits of
its chunk, an exclusive scan of the counts (digit by digit, chunk by chunk within) gives the position of each
chunk's first item of each digit, and the thread moves its items there in their order. No atomics and no
shared memory: the order depends on nothing but the keys, and every device runs the same code.

Source: Knuth, "The Art of Computer Programming", volume 3, section 5.2.5; Blelloch, "Prefix sums and their
applications" (1990).
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import I32

DIGIT_BITS = 8
DIGITS = 1 << DIGIT_BITS

CHUNK = 256
"""Items that one thread sorts."""

SCAN_BLOCK = 128
"""Values that one thread sums in a level of a scan."""


@qd.kernel(fastcache=True)
def exclusive_scan(values: I32, sums: I32, tops: I32, number: qd.i32, blocks: qd.i32, top_blocks: qd.i32):
    """Replace values [number] by the sums of those before them.

    `sums` [blocks] and `tops` [top_blocks] are scratch; blocks = ceil(number / SCAN_BLOCK), and `top_blocks`
    from blocks likewise.
    """
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


@qd.kernel(fastcache=True)
def count_digits(keys: I32, counts: I32, number: qd.i32, chunks: qd.i32, shift: qd.i32):
    """Write counts [DIGITS,chunks] of the digit at bit `shift` of keys [number], none of them negative."""
    qd.loop_config(block_dim=64)
    for c in range(chunks):
        for d in range(DIGITS):
            counts[d * chunks + c] = 0
        for i in range(c * CHUNK, qd.min((c + 1) * CHUNK, number)):
            at = ((keys[i] >> shift) & (DIGITS - 1)) * chunks + c
            counts[at] = counts[at] + 1


@qd.kernel(fastcache=True)
def move_items(
    keys: I32,
    values: I32,
    positions: I32,
    sorted_keys: I32,
    sorted_values: I32,
    number: qd.i32,
    chunks: qd.i32,
    shift: qd.i32,
):
    """Move keys and values to `positions` [DIGITS,chunks], the scanned counts of `count_digits`."""
    qd.loop_config(block_dim=64)
    for c in range(chunks):
        for i in range(c * CHUNK, qd.min((c + 1) * CHUNK, number)):
            at = ((keys[i] >> shift) & (DIGITS - 1)) * chunks + c
            to = positions[at]
            positions[at] = to + 1
            sorted_keys[to] = keys[i]
            sorted_values[to] = values[i]
