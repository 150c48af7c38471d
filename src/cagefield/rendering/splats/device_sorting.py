"""Sorting and prefix sums of arrays on the compute device: the host side of `kernels.device_sort`."""

from __future__ import annotations

from typing import Any

import numpy as np

from cagefield.compute.device_buffers import DeviceBuffers
from cagefield.rendering.splats.kernels import device_sort as kernels

MIN_CHUNK, MAX_CHUNK = 32, 1024
"""Fewest and most items that one thread sorts."""

SORTING_THREADS = 8192
"""Threads that a sort occupies before they get more than MIN_CHUNK items."""


def passes_of(max_key: int) -> int:
    """Number of digits in keys up to `max_key`."""
    return -(-max(1, max_key.bit_length()) // kernels.DIGIT_BITS)


def scan_scratch(number: int, buffers: DeviceBuffers) -> tuple[Any, Any]:
    """Scratch memory (sums, tops) for scans of up to `number` values."""
    blocks = -(-number // kernels.SCAN_BLOCK)
    sums = buffers.take("scan_sums", blocks, np.int32)
    return sums, buffers.take("scan_tops", -(-blocks // kernels.SCAN_BLOCK), np.int32)


def sort_scratch(number: int, name: str, buffers: DeviceBuffers, scanned: int = 0) -> kernels.SortArgs:
    """Scratch memory for a sort of `number` items, and for scans of up to `scanned` values beside it.

    `name` tells the owner's sorts apart: a result may lie in the scratch memory of that name.
    """
    chunk = min(MAX_CHUNK, max(MIN_CHUNK, -(-number // SORTING_THREADS)))
    counts = kernels.DIGITS * -(-number // chunk)
    sums, tops = scan_scratch(max(counts, scanned), buffers)
    return kernels.SortArgs(
        counts=buffers.take("digit_counts", counts, np.int32),
        sums=sums,
        tops=tops,
        other_keys=buffers.take(f"{name}_other_keys", number, np.int32),
        other_values=buffers.take(f"{name}_other_values", number, np.int32),
        chunk=chunk,
    )


def exclusive_scan(values: Any, number: int, buffers: DeviceBuffers) -> None:
    """Replace the first `number` values, int32, by the sums of those before them."""
    kernels.exclusive_scan(values, *scan_scratch(number, buffers), number)


def sort_by_key(
    keys: Any, values: Any, number: int, max_key: int, name: str, buffers: DeviceBuffers
) -> tuple[Any, Any]:
    """(keys, values) in stable order of the keys, int32 in [0, max_key]; the arguments are overwritten."""
    scratch, passes = sort_scratch(number, name, buffers), passes_of(max_key)
    kernels.sort(keys, values, scratch, number, passes)
    return (scratch.other_keys, scratch.other_values) if passes % 2 else (keys, values)
