"""Where edits take the splats of a field: which stay, which move, which are copied and which are hidden.

A splat is where its mean is: it goes with its mean from one of an edit's regions (design: the four regions of
an edit) as a whole. With V^c the canonical and V the deformed inner cage of a discrete edit:

- in V^c: it goes to V. A copy leaves the original, where V does not cover it; a delete leaves nothing.
- in V but not in V^c: hidden, for V shows what was in V^c.
- pasted: it goes to V; all others in V are hidden.

Of a stack, each edit takes what the ones before it made: originals and copies alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import Edit, EditStack
from cagefield.fields.splat import SplatField
from cagefield.rendering.pasted_splats import at_rest, pasted_rows
from cagefield.typing import Array, Mask
from cagefield.warps.discrete import DiscreteWarp
from cagefield.warps.forward import to_deformed
from cagefield.warps.inner_map import HexahedronMap

KEPT_STACKS = 6
"""Stacks of edits of one field whose splats are kept, so that a longer stack begins where they end."""

KEPT_SPLATS = 4_000_000
"""Most moved splats that are kept of one field, 104 bytes each; the stack shown last is kept in any case."""


@dataclass(frozen=True)
class MovedSplats:
    """A field's splats under edits.

    Attributes:
        left: [N], True where splat n is not shown at its own place.
        source: [M] int64, the numbers of the splats that are shown elsewhere, any number of times.
        points: [M,3], their means in deformed space.
        jacobian: [M,3,3], d(deformed)/d(canonical) there.
    """

    left: Mask
    source: NDArray[np.int64]
    points: Array
    jacobian: Array

    @classmethod
    def at_rest(cls, field: SplatField) -> MovedSplats:
        """A field's splats, all in their places; those that edits are to paste are shown nowhere."""
        none = np.zeros((0, 3))
        return cls(at_rest(field), np.zeros(0, np.int64), none, np.zeros((0, 3, 3)))

    @property
    def is_at_rest(self) -> bool:
        """True where all splats are in their places, and nowhere else."""
        return not len(self.source) and not self.left.any()

    @property
    def is_whole(self) -> bool:
        """True where each splat is shown once."""
        elsewhere = np.zeros(len(self.left), bool)
        elsewhere[self.source] = True
        return len(self.source) == np.count_nonzero(elsewhere) and np.array_equal(elsewhere, self.left)

    def without(self, gone: Mask) -> MovedSplats:
        """The same, those that are True in `gone` [N] shown nowhere."""
        kept = ~gone[self.source]
        return MovedSplats(self.left | gone, self.source[kept], self.points[kept], self.jacobian[kept])

    def then(
        self, edit: Edit, field: SplatField, coarse: bool, proceed: Callable[[], None] | None
    ) -> MovedSplats:
        """What one more edit makes of these. Raises `EditError` where it cannot be evaluated."""
        from cagefield.rendering.kernels.splat_deforming import changes, in_boxes, times

        warp, means, rows = edit.exact_warp, field.means, pasted_rows(field, edit)
        cages = [edit.inner.aabb] if edit.outer is None else [edit.inner.aabb, edit.outer.aabb]
        reach = np.concatenate([edit.boxes, np.stack(cages)])
        at_rest, elsewhere = np.empty(len(means), bool), np.empty(len(self.source), bool)
        in_boxes(means, reach, at_rest)
        if len(elsewhere):
            in_boxes(self.points, reach, elsewhere)
        still, near = np.flatnonzero(at_rest & ~self.left), np.flatnonzero(elsewhere)
        points = np.concatenate([means[still].astype(np.float64), self.points[near]])
        mapped = to_deformed(warp, points, coarse=coarse, proceed=proceed)
        moves = np.empty(len(points), bool)
        changes(points, mapped.points, mapped.jacobian, moves)
        leaves = moves | mapped.lost
        if isinstance(warp, DiscreteWarp) and warp.keep_source and warp.inner is not None:
            leaves &= mapped.lost | warp.inner.deformed.contains(points)
        left, stays = self.left.copy(), np.ones(len(self.source), bool)
        left[still[leaves[: len(still)]]] = True
        stays[near[leaves[len(still) :]]] = False
        come = np.flatnonzero(moves & ~mapped.lost)
        jacobian = mapped.jacobian[come]
        again = come >= len(still)
        if again.any():
            composed = np.ascontiguousarray(jacobian[again])
            times(composed, self.jacobian[near[come[again] - len(still)]])
            jacobian[again] = composed
        pasted = HexahedronMap(edit.deformed, edit.inner)(means[rows].astype(np.float64))
        fresh = rows[pasted[0]]
        return MovedSplats(
            left,
            np.concatenate([self.source[stays], np.concatenate([still, self.source[near]])[come], fresh]),
            np.concatenate([self.points[stays], mapped.points[come], pasted[1]]),
            np.concatenate([self.jacobian[stays], jacobian, pasted[2]]),
        )


@dataclass(frozen=True)
class _KnownStack:
    """What a stack's active edits made of a field."""

    edits: tuple[Edit, ...]
    coarse: bool
    moved: MovedSplats


known_stacks: WeakKeyDictionary[SplatField, list[_KnownStack]] = WeakKeyDictionary()


def moved_splats(
    field: SplatField,
    edits: EditStack,
    *,
    coarse: bool = False,
    proceed: Callable[[], None] | None = None,
) -> MovedSplats:
    """A field's splats under edits, with those that they paste behind them (`pasted_splats.with_pasted`).

    Raises `EditError` where an edit cannot be evaluated.

    What the first of the edits made is kept between calls. `coarse` and `proceed` as for `to_deformed`.
    """
    active = edits.active
    known = known_stacks.setdefault(field, [])
    usable = [k for k in known if k.edits == active[: len(k.edits)] and (coarse or not k.coarse)]
    start = max(usable, key=lambda k: (len(k.edits), not k.coarse), default=None)
    moved, count = (start.moved, len(start.edits)) if start else (MovedSplats.at_rest(field), 0)
    found = [start] if start else []
    for number, edit in enumerate(active[count:], start=count + 1):
        moved = moved.then(edit, field, coarse, proceed)
        found.append(_KnownStack(active[:number], coarse, moved))
    kept = [*reversed(found), *(k for k in known if k is not start)][:KEPT_STACKS]
    sizes = np.cumsum([len(k.moved.source) for k in kept])
    known[:] = [k for n, k in enumerate(kept) if n == 0 or sizes[n] <= KEPT_SPLATS]
    return moved
