"""Splats split where one Gaussian cannot follow an edit: the map bends over it, or a cut or the edge of
a shadow goes through it.

Notation: a splat is m + A z, z ~ N(0, 1) in three dimensions, A = Q diag(s). An edit takes it to
F(m) + J A z, which is right as far as F is affine over it, and in one color. Three things are not:

- Bending. Along the axis a_i of A the second-order term of F at two standard deviations, against the length
  of the first-order term, is

      b_ii = |F(m + 2 a_i) + F(m - 2 a_i) - 2 F(m)| / |F(m + 2 a_i) - F(m - 2 a_i)|,

  and with another axis the mixed term, which a twist has where the axes themselves stay straight,

      b_ij = |(J(m + 2 a_i) - J(m - 2 a_i)) a_j| / max over k = i, j of |F(m + 2 a_k) - F(m - 2 a_k)|.

  b_i is the largest of them. Where b_i > BEND the splat becomes a row of three narrower ones along a_i:
  N(0, 1) is the convolution of N(0, r^2) and N(0, 1 - r^2), so children of the standard deviation r, weighted
  by N(0, 1 - r^2), add up to it, at the distances of SPACING to a few per cent.
  With r = BEND / b_i they bend by BEND at most: b is proportional to the width. Of small splats b counts less
  (`split_children.SMALL_SHARE`). It is not where J jumps, on
  the faces of cages, and splats across these are split ROUNDS times. Opacities are such that
  the ray through the middle of each child loses as much in the row as it lost in the splat there. Optical
  depths add up, and
  are flatter than the splat's opacity where that is large: children as wide as the splat across the row would
  make it thicker, each round again. They are narrower, so that the depth on all the width is the splat's.
- Cuts. A discrete edit takes the inside of a cage away. A splat through a face, at t standard deviations of
  its own across it, becomes two, one for the part of it on either side: nearest to its alpha there and to
  none beyond the face, in the least squares of `gaussian_profile.PARTS`. Of alpha a exp(-(u^2 + v^2) / 2) a
  cut across u is a factor, so they are as wide as it along the face.
- Light. A patch (`edits.patch`) multiplies a splat's colors by one number. Where the log of that changes by
  d > SHADE among m - a_i, m and m + a_i the splat becomes a row along a_i as where it bends, with
  r = SHADE / d, faint and small ones where it changes by more. It does not where a_i is shorter than half
  an edge of the light's grid.

Each child goes its own way then. Children are canonical splats; of edits in a stack, each splits the splats
of those before it. Steps of light alone come last, whatever their place in the stack: results of the others
do not depend on them, and stay valid when light arrives (`_known_states`).

Source: ours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.edits import Discrete, EditMap, PreparedEdit, PreparedStack
from cagefield.edits.patch import SplatPatch
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.quaternions import quaternions_from_matrices
from cagefield.rendering.splats.splat_motion import MovedSplats, moved_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.split_children import (
    REACH,
    Children,
    bent_children,
    concatenate_children,
    cut_children,
    shaded_children,
    splat_axes,
)
from cagefield.typing import Array, Mask

ROUNDS = 2
"""Rounds in which splats that bend, or the light on which changes, are split: a third one brings pictures no
nearer to finely split ones."""

CUTS = 1
"""Rounds in which splats across a cut, or in its shadow, are split: a second one takes away parts of parts
that hang over, and doubles their number, but brings pictures no nearer to finely split ones."""

SMALL = 0.0035
"""Splats whose largest standard deviation is below this share of an edit's size are not tried for bending:
3 pixels where the edit fills a picture of 800."""

MOST = 2.0
"""Splats there may be after splitting, against those before, beside MORE; parents count."""

MORE = 200_000


@dataclass(frozen=True, eq=False)
class Split:
    """Split splats of a set: `parents` [N] are True where `children` replace a splat.

    `sources` [C] are the numbers of the children's parents.
    """

    parents: Mask
    children: SplatSet
    sources: NDArray[np.int64]


def split_for_edits(splats: SplatField | SplatSet, edits: EditMap) -> SplatSet:
    """Set `with_pastes` with those splats split that one Gaussian each does not show under the edits.

    The set itself where none is; children come last. Raises as `split_of`.
    """
    splats = SplatSet.from_field(splats).with_pastes(edits)
    split = split_of(splats, edits)
    return splats if split is None else SplatSet.concatenate([splats.take(~split.parents), split.children])


def split_of(
    splats: SplatField | SplatSet, edits: EditMap, *, proceed: Callable[[], None] | None = None
) -> Split | None:
    """Split of the splats that one Gaussian each cannot represent under the edits, or None.

    Rows are those of the set `with_pastes`. Cached for a living set and its latest edits.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    active = edits.steps
    if not active:
        return None
    splats = SplatSet.from_field(splats).with_pastes(edits)
    order = _splitting_order(active)
    known = _known_states(splats)
    shared = 0
    while shared < min(len(known), len(order)) and known[shared][0] == order[shared]:
        shared += 1
    split = known[shared - 1][1] if shared else None
    states = known[:shared]
    for step, before in order[shared:]:
        split = _split_by_step(splats, split, PreparedStack(before), step, proceed)
        states.append(((step, before), split))
    known[:] = states
    return split


_Step = tuple[PreparedEdit, tuple[PreparedEdit, ...]]
"""A step, and those that move the splats before it."""


def _splitting_order(active: tuple[PreparedEdit, ...]) -> list[_Step]:
    """The steps in the order in which they split: those of light alone last."""
    moving = [
        (step, tuple(other for other in active[:count] if not other.is_light_alone))
        for count, step in enumerate(active)
        if not step.is_light_alone
    ]
    return moving + [(step, active[:count]) for count, step in enumerate(active) if step.is_light_alone]


def _split_by_step(
    splats: SplatSet,
    split: Split | None,
    before: EditMap,
    step: PreparedEdit,
    proceed: Callable[[], None] | None,
) -> Split | None:
    """Split of a set after one more step, from that of those before."""
    most = (MOST - 1.0) * len(splats) + MORE
    parents = np.zeros(len(splats), bool) if split is None else split.parents
    parts: list[_Part] = []
    if split is not None:
        children, sources = split.children, split.sources
        stay, others = _settled(children, before, step, None, most - len(children), proceed)
        parts = [(children.take(stay), sources[stay]), *((part, sources[rows]) for part, rows in others)]
    room = most - sum(len(part) for part, _ in parts)
    stay, others = _settled(splats, before, step, parents, room, proceed)
    parts += others
    if not parts:
        return None
    return Split(
        parents | ~stay,
        SplatSet.concatenate([part for part, _ in parts]),
        np.concatenate([rows for _, rows in parts]),
    )


@memoized_weakly
def _known_states(splats: SplatSet) -> list[tuple[_Step, Split | None]]:
    """Latest splits of a living set, after each of its steps in their order; none at first."""
    return []


_Part = tuple[SplatSet, NDArray[np.int64]]
"""Children, and the numbers of the splats that they are of."""


def _settled(
    splats: SplatSet,
    before: EditMap,
    step: PreparedEdit,
    gone: Mask | None,
    room: float,
    proceed: Callable[[], None] | None,
) -> tuple[Mask, list[_Part]]:
    """(which splats stay whole [N], children of the others), children split again where they must be."""
    stay, done, found = np.ones(len(splats), bool), list[_Part](), splats
    sources = np.arange(len(splats))
    is_cut = isinstance(step.edit, Discrete) and not step.is_light_alone
    for turn in range(CUTS if is_cut else ROUNDS):
        split = _split_once(found, before, step, gone if turn == 0 else None, room, proceed)
        if split is None:
            break
        if turn == 0:
            stay = split[0]
        else:
            done.append((found.take(split[0]), sources[split[0]]))
        found, sources = split[1], sources[split[2]]
        room -= len(found)
    return stay, done if found is splats else [*done, (found, sources)]


def _split_once(
    splats: SplatSet,
    before: EditMap,
    step: PreparedEdit,
    gone: Mask | None,
    room: float,
    proceed: Callable[[], None] | None,
) -> tuple[Mask, SplatSet, NDArray[np.int64]] | None:
    """(which splats stay whole [N], the others' children, whose they are); None where all do, or are gone."""
    field, moved = splats.field, moved_splats(splats, before, proceed=proceed)
    if gone is not None and gone.any():
        moved = moved.without(gone)
    rest, elsewhere = _near(step, field, moved)
    others = moved.source[elsewhere]
    rows = np.concatenate([rest, others])
    if not len(rows):
        return None
    points = np.concatenate([field.means[rest].astype(np.float64), moved.points[elsewhere]])
    A = np.concatenate([splat_axes(field, rest), moved.jacobian[elsewhere] @ splat_axes(field, others)])
    edit = step.edit
    if step.is_light_alone:
        assert isinstance(step.patch, SplatPatch)
        children = shaded_children(edit, step.patch, field, rows, points, A, _size(step))
    elif isinstance(edit, Discrete):
        children = cut_children(edit, field, rows, points, A)
        if isinstance(step.patch, SplatPatch):
            whole = np.flatnonzero(~np.isin(rows, children.parent))
            lit = shaded_children(edit, step.patch, field, rows[whole], points[whole], A[whole], _size(step))
            children = concatenate_children([children, lit])
    else:
        children = bent_children(edit, field, rows, points, A, _size(step), proceed)
    return _parted(splats, children, room) if len(children.parent) else None


def _near(
    step: PreparedEdit, field: SplatField, moved: MovedSplats
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which splats in their own places [.], and which of those that moved [.], an edit may have to split."""
    from cagefield.rendering.splats.kernels.deformation import within_reach, within_reach_at_rest

    low, high = _bounds(step)
    # Stretches are Frobenius' norms, that of nothing is sqrt(3).
    is_cut = isinstance(step.edit, Discrete)
    least = 0.0 if is_cut else _UNSTRETCHED * SMALL * _size(step)
    rest, elsewhere = np.empty(len(field), bool), np.empty(len(moved.source), bool)
    scales = field.log_scales
    within_reach_at_rest(field.means, moved.left, scales, low, high, REACH, least, _UNSTRETCHED, rest)
    if len(elsewhere):
        stretch = np.linalg.norm(moved.jacobian, axis=(1, 2))
        within_reach(moved.points, moved.source, scales, low, high, REACH, least, stretch, elsewhere)
    return np.flatnonzero(rest), np.flatnonzero(elsewhere)


def _bounds(step: PreparedEdit) -> tuple[Array, Array]:
    """(least [3], largest [3]) coordinates of what an edit changes, and of its inner cage."""
    boxes = np.concatenate([step.boxes, step.edit.inner.aabb[None]])
    return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)


def _size(step: PreparedEdit) -> float:
    """Diagonal of `_bounds`, world units."""
    low, high = _bounds(step)
    return float(np.linalg.norm(high - low))


_UNSTRETCHED = float(np.sqrt(3.0))


def _parted(
    splats: SplatSet, children: Children, room: float
) -> tuple[Mask, SplatSet, NDArray[np.int64]] | None:
    """(which splats stay whole, the others' children, whose); if too many, of the most opaque parents."""
    field, parents = splats.field, np.unique(children.parent)
    if len(children.parent) > room:
        order = np.argsort(-field.opacities[parents], kind="stable")
        fits = int(len(parents) * max(0.0, room) / len(children.parent))
        parents = parents[order[:fits]]
        kept = np.isin(children.parent, parents)
        children = children.take(kept)
        if not len(children.parent):
            return None
    n, h = children.parent, children.direction
    A = splat_axes(field, n)
    along = np.einsum("cij,cj->ci", A, h)
    across = children.across[:, None]
    shape = across[:, None] * A + ((children.r[:, None] - across) * along)[:, :, None] * h[:, None, :]
    variances, U = np.linalg.eigh(shape @ shape.transpose(0, 2, 1))
    # The shortest axis last: that of a disc is its normal.
    s, U = np.sqrt(np.maximum(variances[:, ::-1], 0.0)), np.ascontiguousarray(U[:, :, ::-1])
    U[:, :, 2] *= np.linalg.det(U)[:, None]
    stay = np.ones(len(field), bool)
    stay[parents] = False
    parted = SplatField(
        (field.means[n] + along * children.x[:, None]).astype(np.float32),
        np.log(np.maximum(s, 1e-30)).astype(np.float32),
        quaternions_from_matrices(U).astype(np.float32),
        children.opacity.astype(np.float32),
        field.sh[n],
        antialiased=field.antialiased,
        discs=field.discs,
        bounds=field.bounds,
        unbounded=field.unbounded,
    )
    return stay, splats.inherit_origins(parted, n), n
