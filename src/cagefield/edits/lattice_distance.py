"""Distance between a lattice and the exact map that it interpolates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.lattice import Lattice

CHUNK_POINTS = 100
"""Points at which a lattice is compared with the exact map at a time: hundredths of a second."""


def lattice_distance(
    warp: ContinuousWarp, lattice: Lattice, samples: int, proceed: Callable[[], None] | None = None
) -> tuple[float, float]:
    """(max, mean) distance in world units between canonical points of a lattice and of the exact `warp`.

    Measured at those of `samples` random points that lie in the shell (`ContinuousWarp.shell_points`).
    `proceed` is called now and then, and gives the measurement up by raising.
    """
    points, distances = warp.shell_points(samples), [np.zeros(0)]
    for first in range(0, len(points), CHUNK_POINTS):
        if proceed is not None:
            proceed()
        chunk = points[first : first + CHUNK_POINTS]
        difference = lattice.to_canonical(chunk)[0] - warp.to_canonical(chunk).points
        distances.append(np.linalg.norm(difference, axis=1))
    distance = np.concatenate(distances)
    return float(distance.max(initial=0.0)), float(distance.mean()) if len(distance) else 0.0
