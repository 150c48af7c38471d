"""Positions of a field's elements under edits: any number of them for each element (see the package)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap, Paste
from cagefield.typing import Array, Float32
from cagefield.warps.discrete import DiscreteWarp
from cagefield.warps.forward import to_deformed


@dataclass(frozen=True, eq=False)
class DeformedPositions:
    """Deformed positions [M,3] of elements, and the element [M] that is seen at each."""

    points: Array
    element: NDArray[np.int64]

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> DeformedPositions:
        """Some of the positions."""
        return DeformedPositions(self.points[rows], self.element[rows])


def deformed_positions(
    positions: Float32 | Array,
    edits: EditMap,
    *,
    coarse: bool = False,
    proceed: Callable[[], None] | None = None,
) -> DeformedPositions:
    """Positions at which edits show the elements at canonical positions [N,3].

    Elements that a delete takes away, and those that moved content covers, have none; those of a copy are
    also at the copy. Pastes are passed over: they move nothing of this field. `coarse` and `proceed` as for
    `warps.forward.to_deformed`.

    Raises EditError where an edit cannot be evaluated.
    """
    points = np.array(positions, dtype=np.float64)
    element = np.arange(len(points))
    for step in edits.steps:
        if isinstance(step.edit, Paste):
            continue
        near = np.zeros(len(points), bool)
        for low, high in np.concatenate([step.boxes, step.edit.inner.aabb[None]]):
            near |= ((points >= low) & (points <= high)).all(axis=1)
        rows = np.flatnonzero(near)
        if not len(rows):
            continue
        before = points[rows]
        mapped = to_deformed(step.exact_warp, before, coarse=coarse, proceed=proceed)
        stays = ~near
        warp = step.exact_warp
        if isinstance(warp, DiscreteWarp) and warp.keep_source and warp.inner is not None:
            copied = (mapped.points != before).any(axis=1)
            stays[rows[copied & ~warp.inner.deformed.contains(before)]] = True
        come = np.flatnonzero(~mapped.lost)
        points, element = (
            np.concatenate([points[stays], mapped.points[come]]),
            np.concatenate([element[stays], element[rows[come]]]),
        )
    return DeformedPositions(points, element)
