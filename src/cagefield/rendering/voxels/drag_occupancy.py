"""Occupancy during a drag: one edit of a stack is replaced again and again while the others stay.

The result of the edits before it is computed once, and so are the images of the points of a coarse pass
under the edits after it. Then a refresh maps each corner by the one edit alone, however many others there
are.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap, PreparedEdit, PreparedStack
from cagefield.edits.device_stack import DeviceStack
from cagefield.rendering.voxels import occupancy_continuous as smooth
from cagefield.rendering.voxels.device_grid import DeviceGrid
from cagefield.rendering.voxels.occupancy import Occupancy
from cagefield.rendering.voxels.occupancy_deformed import deform


def replaced_place(before: EditMap, after: EditMap) -> int | None:
    """The place of the only active edit that differs, where another one's box meets its own; else None."""
    old, new = before.steps, after.steps
    if len(old) != len(new):
        return None
    places = [n for n in range(len(new)) if old[n] != new[n]]
    if len(places) != 1:
        return None
    own = new[places[0]].bounds
    others = [edit.bounds for n, edit in enumerate(new) if n != places[0]]
    meets = any((box[0] <= own[1]).all() and (own[0] <= box[1]).all() for box in others)
    return places[0] if meets else None


@dataclass(frozen=True)
class DraggedEdit:
    """The edit that a drag replaces, among the fixed edits."""

    fixed: FixedEdits
    stack: DeviceStack

    def near_bricks(
        self, grid: DeviceGrid, lower: NDArray[np.int64], count: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """As `occupancy_continuous.near_bricks` of the whole stack, coarsely."""
        starts = self.fixed.starts(grid, lower, count)
        return smooth.near_bricks(self.fixed.below, grid, self.stack, lower, count, starts, coarse=True)


@dataclass(frozen=True)
class FixedEdits:
    """Edits before and after the dragged one.

    `below` is the occupancy under the earlier edits; `_starts` are corners mapped by the later ones.
    """

    earlier: tuple[PreparedEdit, ...]
    later: tuple[PreparedEdit, ...]
    below: Occupancy
    _starts: dict[tuple[int, ...], NDArray[np.float32]] = field(default_factory=dict)

    @classmethod
    def build(cls, edits: EditMap, place: int, canonical: Occupancy, grid: DeviceGrid) -> FixedEdits:
        """Fixed edits around a place among the active edits, none of which is discrete."""
        active = edits.steps
        earlier = DeviceStack.from_stack(PreparedStack(active[:place]))
        below = deform(canonical, grid, earlier, jumps=False, coarse=True)
        return cls(active[:place], active[place + 1 :], below)

    def fits(self, edits: EditMap, place: int) -> bool:
        """True where the edits at all other places are the fixed ones."""
        active = edits.steps
        return self.earlier == active[:place] and self.later == active[place + 1 :]

    def with_dragged(self, edit: PreparedEdit) -> DraggedEdit:
        """The dragged edit among the fixed ones."""
        return DraggedEdit(self, DeviceStack.from_stack(PreparedStack([edit])))

    def starts(
        self, grid: DeviceGrid, lower: NDArray[np.int64], count: NDArray[np.int64]
    ) -> NDArray[np.float32] | None:
        """Where the later edits take the points of a coarse pass; None without later ones."""
        if not self.later:
            return None
        key = (*lower.tolist(), *count.tolist())
        if key not in self._starts:
            self._starts.clear()
            later = DeviceStack.from_stack(PreparedStack(self.later))
            self._starts[key] = smooth.coarse_corners(grid, later, lower, count)
        return self._starts[key]
