"""Sorting and prefix sums of arrays on the compute device: the host side of `kernels.device_sort`."""

from __future__ import annotations

from typing import Any

import numpy as np

from cagefield.compute.device_buffers import DeviceBuffers
from cagefield.rendering.splats.kernels import device_sort as kernels


def exclusive_scan(values: Any, number: int, buffers: DeviceBuffers) -> None:
    """Replace the first `number` values, int32, by the sums of those before them."""
    blocks = -(-number // kernels.SCAN_BLOCK)
    top_blocks = -(-blocks // kernels.SCAN_BLOCK)
    kernels.exclusive_scan(
        values,
        buffers.take("scan_sums", blocks, np.int32),
        buffers.take("scan_tops", top_blocks, np.int32),
        number,
        blocks,
        top_blocks,
    )


def sort_by_key(
    keys: Any, values: Any, number: int, max_key: int, name: str, buffers: DeviceBuffers
) -> tuple[Any, Any]:
    """(keys, values) in stable order of the keys, int32 from 0 to `max_key`; the arguments are overwritten.

    `name` tells the owner's sorts apart: the results may lie in memory of that name.
    """
    chunks = -(-number // kernels.CHUNK)
    counts = buffers.take("digit_counts", kernels.DIGITS * chunks, np.int32)
    other_keys = buffers.take(f"{name}_other_keys", number, np.int32)
    other_values = buffers.take(f"{name}_other_values", number, np.int32)
    for shift in range(0, max(1, max_key.bit_length()), kernels.DIGIT_BITS):
        kernels.count_digits(keys, counts, number, chunks, shift)
        exclusive_scan(counts, kernels.DIGITS * chunks, buffers)
        kernels.move_items(keys, values, counts, other_keys, other_values, number, chunks, shift)
        keys, values, other_keys, other_values = other_keys, other_values, keys, values
    return keys, values
