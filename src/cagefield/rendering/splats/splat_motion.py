"""Motion of a field's splats by edits: splats that stay, move, are copied, or are hidden.

A splat is where its mean is: it goes with its mean from one of an edit's regions (design: the four regions of
an edit) as a whole. With V^c the canonical and V the deformed inner cage of a discrete edit:

- in V^c: it goes to V. A copy leaves the original, where V does not cover it; a delete leaves nothing.
- in V but not in V^c: hidden, as V shows the content of V^c.
- pasted: it goes to V; all others stay.

With a patch, splats around V^c get new light, or go, and new ones, copies of others, fill the uncovered
region.

Each edit of a stack takes the splats of the edits before it, originals and copies alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.edits import Discrete, Edit, EditMap, Paste, PreparedEdit
from cagefield.edits.grade import grade_sh, thinned_opacities
from cagefield.edits.mapped_samples import SampleGrade
from cagefield.edits.patch import SplatPatch
from cagefield.fields.sh import scale_sh_colors
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.typing import Array, Mask
from cagefield.warps.discrete import DiscreteWarp
from cagefield.warps.forward import to_deformed

MIN_LOG_GAIN = 0.01
"""The log of a change of light that is left out."""

KEPT_STACKS = 6
"""Stacks of edits of one set whose splats are kept, so that a longer stack begins where they end."""

KEPT_SPLATS = 4_000_000
"""Most moved splats that are kept of one set, 104 bytes each; the stack shown last is kept in any case."""

KEPT_PATCHES = 4
"""Patches of one set whose splats are kept."""


@dataclass(frozen=True)
class MovedSplats:
    """A field's splats under edits.

    Attributes:
        left: [N], True where splat n is not shown at its own place.
        source: [M] int64, the numbers of the splats that are shown elsewhere, any number of times.
        points: [M,3], their means in deformed space.
        jacobian: [M,3,3], d(deformed)/d(canonical) there.
        gains: [M,3], factors of their red, green and blue; None where all are 1.
        grade: matrices [M,3,3] of their colors after the gains, and factors [M] of their optical depth; None
            where no edit grades.
    """

    left: Mask
    source: NDArray[np.int64]
    points: Array
    jacobian: Array
    gains: Array | None = None
    grade: SampleGrade | None = None

    def sh(self, harmonics: NDArray[np.float32]) -> NDArray[np.float32] | None:
        """The harmonics [M,K,3] of those shown elsewhere, from the field's [N,K,3]; None for its own."""
        if self.gains is None and self.grade is None:
            return None
        return changed_sh(harmonics[self.source], self.gains, self.grade)

    def opacities(self, own: NDArray[np.float32]) -> Array:
        """Opacities [M] of those shown elsewhere, from the field's [N]; a grade is part of them."""
        values = own[self.source].astype(np.float64)
        return values if self.grade is None else thinned_opacities(values, self.grade.density)

    @classmethod
    def at_rest(cls, splats: SplatSet) -> MovedSplats:
        """Splats, all in their places; those that edits are to paste are shown nowhere."""
        none = np.zeros((0, 3))
        return cls(splats.is_pasted, np.zeros(0, np.int64), none, np.zeros((0, 3, 3)))

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
        """Moved splats without those that are True in `gone` [N]."""
        kept = ~gone[self.source]
        return replace(self.take(kept), left=self.left | gone)

    def take(self, rows: Mask) -> MovedSplats:
        """Moved splats of some rows [M] of those shown elsewhere."""
        gains = None if self.gains is None else self.gains[rows]
        grade = None if self.grade is None else self.grade.take(rows)
        return MovedSplats(self.left, self.source[rows], self.points[rows], self.jacobian[rows], gains, grade)

    def then(
        self, step: PreparedEdit, splats: SplatSet, coarse: bool, proceed: Callable[[], None] | None
    ) -> MovedSplats:
        """Moved splats after one more edit. Raises `EditError` where it cannot be evaluated."""
        moved, carried = self._moved(step, splats.field.means, coarse, proceed)
        if isinstance(step.edit, Paste):
            moved, carried = moved._with(step, splats)
        if isinstance(step.patch, SplatPatch):
            return moved._patched(step.edit, step.patch, splats, carried)
        return moved

    def _with(self, step: PreparedEdit, splats: SplatSet) -> tuple[MovedSplats, Array]:
        """(these and the pasted splats of an edit, source positions [C,3] of those last rows)."""
        assert isinstance(step.edit, Paste)
        rows = splats.pasted_rows(step)
        positions = splats.field.means[rows].astype(np.float64)
        onto = step.edit.map_between(step.edit.inner, step.edit.deformed).inverse
        inside, points, jacobian = onto(positions)
        gains = None
        if self.gains is not None:
            gains = np.concatenate([self.gains, np.ones((len(points), 3))])
        grade = self.grade
        if grade is not None or step.edit.is_graded:
            before = self.grade or SampleGrade.neutral(len(self.source))
            pasted = SampleGrade.neutral(len(points)).then(step.edit.grading, np.ones(len(points)))
            grade = SampleGrade.concatenate([before, pasted])
        return MovedSplats(
            self.left,
            np.concatenate([self.source, rows[inside]]),
            np.concatenate([self.points, points]),
            np.concatenate([self.jacobian, jacobian]),
            gains,
            grade,
        ), positions[inside]

    def _moved(
        self, step: PreparedEdit, means: NDArray[np.float32], coarse: bool, proceed: Callable[[], None] | None
    ) -> tuple[MovedSplats, Array]:
        """(these after an edit's map, source positions [C,3] of its last rows)."""
        from cagefield.rendering.splats.kernels.deformation import changes, in_boxes, times

        warp = step.exact_warp
        reach = np.concatenate([step.edit.boxes, step.edit.inner.aabb[None]])
        at_rest, elsewhere = np.empty(len(means), bool), np.empty(len(self.source), bool)
        in_boxes(means, reach, at_rest)
        if len(elsewhere):
            in_boxes(self.points, reach, elsewhere)
        still, near = np.flatnonzero(at_rest & ~self.left), np.flatnonzero(elsewhere)
        points = _joined(means[still].astype(np.float64), self.points[near])
        mapped = to_deformed(warp, points, coarse=coarse, proceed=proceed)
        moves = np.empty(len(points), bool)
        changes(points, mapped.points, mapped.jacobian, moves)
        weights = None
        if step.edit.is_graded and not isinstance(step.edit, Paste):
            inside = step.edit.inner.contains(points) if isinstance(step.edit, Discrete) else moves
            weights = step.edit.grade_weights(points, inside)
            moves |= weights > 0.0
        leaves = moves | mapped.lost
        if isinstance(warp, DiscreteWarp) and warp.keep_source and warp.inner is not None:
            leaves &= mapped.lost | warp.inner.deformed.contains(points)
        left, stays = self.left.copy(), np.ones(len(self.source), bool)
        left[still[leaves[: len(still)]]] = True
        stays[near[leaves[len(still) :]]] = False
        come = np.flatnonzero(moves & ~mapped.lost)
        jacobian = _rows_of(mapped.jacobian, come)
        again = come >= len(still)
        if again.any():
            composed = np.ascontiguousarray(jacobian[again])
            times(composed, self.jacobian[near[come[again] - len(still)]])
            jacobian[again] = composed
        gains = None
        if self.gains is not None:
            before = np.concatenate([np.ones((len(still), 3)), self.gains[near]])
            gains = np.concatenate([self.gains[stays], before[come]])
        grade = None
        if self.grade is not None or weights is not None:
            known = self.grade or SampleGrade.neutral(len(self.source))
            arrived = SampleGrade.concatenate([SampleGrade.neutral(len(still)), known.take(near)]).take(come)
            if weights is not None:
                arrived = arrived.then(step.edit.grading, weights[come])
            grade = SampleGrade.concatenate([known.take(stays), arrived])
        moved = MovedSplats(
            left,
            _joined(self.source[stays], _rows_of(_joined(still, self.source[near]), come)),
            _joined(self.points[stays], _rows_of(mapped.points, come)),
            _joined(self.jacobian[stays], jacobian),
            gains,
            grade,
        )
        return moved, _rows_of(points, come)

    def _patched(self, edit: Edit, patch: SplatPatch, splats: SplatSet, carried: Array) -> MovedSplats:
        """These with the patch of the edit that moved them; `carried` [C,3] is where its last rows were."""
        here = len(self.source) - len(carried)
        gains = np.ones((len(self.source), 3)) if self.gains is None else self.gains.copy()
        if patch.part is not None and len(carried):
            gains[here:] *= np.exp(patch.part.at(carried))[:, None]
        # Splats that the edit leaves: those in their own places, and those that earlier edits took there.
        at_rest = _under_patch(splats, patch, edit)
        is_here = ~self.left[at_rest.rows]
        still, gone, log = at_rest.rows[is_here], at_rest.gone[is_here], at_rest.log_gains[is_here]
        gone_elsewhere, log_elsewhere = _change_at(patch, edit, self.points[:here])
        lit = np.flatnonzero((np.abs(log) > MIN_LOG_GAIN) & ~gone)
        gains[:here] *= np.exp(log_elsewhere)[:, None]
        left = self.left.copy()
        left[still[gone]] = True
        left[still[lit]] = True
        kept = np.ones(len(self.source), bool)
        kept[:here] = ~gone_elsewhere
        turn = np.broadcast_to(np.eye(3), (len(lit), 3, 3))
        places = splats.field.means[still[lit]].astype(np.float64)
        parts = [
            (self.source[kept], self.points[kept], self.jacobian[kept], gains[kept]),
            (still[lit], places, turn, np.tile(np.exp(log[lit])[:, None], 3)),
        ]
        if patch.field is splats.scene:
            parts.append((patch.sources, patch.points, patch.jacobian, patch.gains))
        source, points, jacobian, gains = (np.concatenate(column) for column in zip(*parts, strict=True))
        grade = None
        if self.grade is not None:
            known = self.grade.take(kept)
            fresh = SampleGrade.neutral(len(source) - len(known.density))
            grade = SampleGrade.concatenate([known, fresh])
        return MovedSplats(left, source, points, jacobian, gains, grade)


@dataclass(frozen=True, eq=False)
class _UnderPatch:
    """Splats of a set in a patch's region: rows [R], mask of those it takes away, log gains of light.

    `inner` is V^c, within which the patch changes nothing; None of a paste.
    """

    patch: SplatPatch
    inner: Cage | None
    rows: NDArray[np.int64]
    gone: Mask
    log_gains: Array


@memoized_weakly
def _known_patches(splats: SplatSet) -> list[_UnderPatch]:
    """Latest results of `_under_patch` for a living set, most recent first."""
    return []


def _under_patch(splats: SplatSet, patch: SplatPatch, edit: Edit) -> _UnderPatch:
    """Splats of a set, all in their places, under the patch of an edit; kept while its part is dragged."""
    from cagefield.rendering.splats.kernels.deformation import in_boxes

    known = _known_patches(splats)
    inner = None if isinstance(edit, Paste) else edit.inner
    found = next((k for k in known if k.patch is patch and k.inner == inner), None)
    if found is None:
        means = splats.field.means
        inside = np.empty(len(means), bool)
        in_boxes(means, patch.region.aabb[None], inside)
        rows = np.flatnonzero(inside)
        found = _UnderPatch(patch, inner, rows, *_change_at(patch, edit, means[rows].astype(np.float64)))
    known[:] = [found, *(k for k in known if k is not found)][:KEPT_PATCHES]
    return found


def _change_at(patch: SplatPatch, edit: Edit, points: Array) -> tuple[Mask, Array]:
    """(splats [N] at points [N,3] that a patch takes away, their log gains of light [N])."""
    outside = np.ones(len(points), bool) if isinstance(edit, Paste) else ~edit.inner.contains(points)
    return patch.takes_away(points) & outside, np.where(outside, patch.light.at(points), 0.0)


def _rows_of(values: NDArray[Any], rows: NDArray[np.int64]) -> NDArray[Any]:
    """The ascending rows of values [M,...], without a copy where they are all."""
    return values if len(rows) == len(values) else values[rows]


def _joined(first: NDArray[Any], last: NDArray[Any]) -> NDArray[Any]:
    """The rows of both, without a copy where one has none."""
    if not len(first) or not len(last):
        return last if len(last) else first
    return np.concatenate([first, last])


def changed_sh(
    sh: NDArray[np.float32], gains: Array | None, grade: SampleGrade | None
) -> NDArray[np.float32]:
    """Harmonics [M,K,3] times gains [M,3], and then by the matrices of a grade."""
    lit = sh if gains is None else scale_sh_colors(sh, gains)
    return lit if grade is None else grade_sh(lit, grade.colors)


@dataclass(frozen=True)
class _KnownStack:
    """Moved splats of a field after a stack's active edits."""

    edits: tuple[PreparedEdit, ...]
    coarse: bool
    moved: MovedSplats


@memoized_weakly
def _known_stacks(splats: SplatSet) -> list[_KnownStack]:
    """Latest results of `moved_splats` for a living set, most recent first."""
    return []


def moved_splats(
    splats: SplatField | SplatSet,
    edits: EditMap,
    *,
    coarse: bool = False,
    proceed: Callable[[], None] | None = None,
) -> MovedSplats:
    """Splats under edits; what these paste is part of the set (`SplatSet.with_pastes`).

    Raises `EditError` where an edit cannot be evaluated.

    Results of the first edits are cached for a living set. `coarse` and `proceed` as for `to_deformed`.
    """
    splats, active = SplatSet.from_field(splats), edits.steps
    known = _known_stacks(splats)
    usable = [k for k in known if k.edits == active[: len(k.edits)] and (coarse or not k.coarse)]
    start = max(usable, key=lambda k: (len(k.edits), not k.coarse), default=None)
    moved, count = (start.moved, len(start.edits)) if start else (MovedSplats.at_rest(splats), 0)
    found = [start] if start else []
    for number, edit in enumerate(active[count:], start=count + 1):
        moved = moved.then(edit, splats, coarse, proceed)
        found.append(_KnownStack(active[:number], coarse, moved))
    kept = [*reversed(found), *(k for k in known if k is not start)][:KEPT_STACKS]
    sizes = np.cumsum([len(k.moved.source) for k in kept])
    known[:] = [k for n, k in enumerate(kept) if n == 0 or sizes[n] <= KEPT_SPLATS]
    return moved
