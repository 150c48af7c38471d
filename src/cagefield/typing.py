"""Array types by element type; shapes are in docstrings."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""The default: coordinates, matrices, everything of the float64 reference."""

Float32: TypeAlias = NDArray[np.float32]
"""Stored fields, kernel arguments and rendered images."""

UInt8: TypeAlias = NDArray[np.uint8]
"""Pixels and masks of bits."""

Int: TypeAlias = NDArray[np.intp]
"""Indices."""

Mask: TypeAlias = NDArray[np.bool_]

AnyArray: TypeAlias = NDArray[Any]
"""Any numeric element type."""
