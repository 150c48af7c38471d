"""Morton codes: positions along a space-filling curve that preserves locality.

Source: Morton, "A Computer Oriented Geodetic Data Base" (1966).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.typing import AnyArray

_BITS_PER_AXIS = 21  # 63 bits in total
_SPREAD_MASKS = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def morton_codes(points: AnyArray, low: AnyArray, high: AnyArray) -> NDArray[np.uint64]:
    """Morton codes [N] of points [N,3] within a box: interleaved bits of x, y and z, x lowest."""
    size = np.maximum(np.asarray(high, np.float64) - low, 1e-300)
    share = np.clip((np.asarray(points, np.float64) - low) / size, 0.0, 1.0)
    cells = (share * (2**_BITS_PER_AXIS - 1)).astype(np.uint64)
    code = np.zeros(len(cells), np.uint64)
    for axis in range(3):
        bits = cells[:, axis]
        for shift, mask in _SPREAD_MASKS:
            bits = (bits | bits << np.uint64(shift)) & np.uint64(mask)
        code |= bits << np.uint64(axis)
    return code
