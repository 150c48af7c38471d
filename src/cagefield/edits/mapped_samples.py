"""Samples after a map between deformed and canonical space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.typing import Array, Mask


@dataclass(frozen=True)
class CanonicalSamples:
    """Samples of deformed space, taken to canonical space.

    points [N,3]; viewdirs [N,3] unit, d^c = J d / |J d|, and stretch [N], |J d| for unit d (both None where
    no view directions were given); jacobian [N,3,3], d(canonical)/d(deformed); layer [N], the field read at
    the point: 0 the canonical field, n the n-th of `EditStack.layers`, -1 nothing.
    """

    points: Array
    viewdirs: Array | None
    stretch: Array | None
    jacobian: Array
    layer: NDArray[np.int64]

    @property
    def emptied(self) -> Mask:
        """[N], True where the field must be read as empty."""
        return np.asarray(self.layer < 0)


@dataclass(frozen=True)
class DeformedPoints:
    """Canonical points, taken to deformed space.

    points [N,3]; jacobian [N,3,3], d(deformed)/d(canonical); hidden [N], True where nothing in the deformed
    scene shows the canonical point (deleted, or covered by moved content).
    """

    points: Array
    jacobian: Array
    hidden: Mask


@dataclass(frozen=True)
class KernelSamples:
    """`CanonicalSamples` of a kernel, in float32 and without the Jacobian."""

    points: NDArray[np.float32]
    viewdirs: NDArray[np.float32]
    stretch: NDArray[np.float32]
    layer: NDArray[np.int64]
