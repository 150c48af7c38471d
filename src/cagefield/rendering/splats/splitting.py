"""Splats split where one Gaussian cannot follow an edit: the map bends over it, or a cut or the edge of
a shadow goes through it.

Notation: a splat is m + A z, z ~ N(0, 1) in three dimensions, A = Q diag(s). An edit takes it to
F(m) + J A z, which is right as far as F is affine over it, and in one colour. Three things are not:

- Bending. Along the axis a_i of A the second-order term of F at two standard deviations, against the length
  of the first-order term, is

      b_ii = |F(m + 2 a_i) + F(m - 2 a_i) - 2 F(m)| / |F(m + 2 a_i) - F(m - 2 a_i)|,

  and with another axis the mixed term, which a twist has where the axes themselves stay straight,

      b_ij = |(J(m + 2 a_i) - J(m - 2 a_i)) a_j| / max over k = i, j of |F(m + 2 a_k) - F(m - 2 a_k)|.

  b_i is the largest of them. Where b_i > BEND the splat becomes a row of narrower ones along a_i: N(0, 1) is
  the convolution of N(0, r^2) and N(0, 1 - r^2), so children of the standard deviation r at distances of
  SPACING r, weighted by N(0, 1 - r^2), add up to it, but for a ripple of 2 exp(-2 (pi / SPACING)^2) = 0.1 %.
  With r = BEND / b_i they bend by BEND at most: b is proportional to the width. It is not where J jumps, on
  the faces of cages, and splats across these are split ROUNDS times. Opacities are such that
  the ray through the middle of each child loses as much in the row as it lost in the splat there. Optical
  depths add up, and
  are flatter than the splat's opacity where that is large: children as wide as the splat across the row would
  make it thicker, each round again. They are narrower, so that the depth on all the width is the splat's.
- Cuts. A discrete edit takes the inside of a cage away. A splat through a face, at t standard deviations of
  its own across it, becomes the parts of it on both sides. A ray at u standard deviations from its middle has
  the optical depth T(u) = -log(1 - a exp(-u^2 / 2)), a the opacity. A child has the integral, mean and
  variance over u of T below or above t, and across u the width that gives it T's integral over that half of a
  plane. Of faint splats T is a normal distribution, and children have its moments where it is cut off.
- Light. A patch (`edits.patch`) multiplies a splat's colours by one number. Where the log of that changes by
  d > SHADE among m - a_i, m and m + a_i the splat becomes a row along a_i as where it bends, with
  r = SHADE / d, faint ones where it changes by more. It does not where a_i is shorter than half an edge of
  the light's grid.

Each child goes its own way then. Children are canonical splats; of edits in a stack, each splits the splats
of those before it.

Source: ours. For faint splats a cut has the moments of the truncated normal distribution: Johnson, Kotz and
Balakrishnan, "Continuous Univariate Distributions" (1994), chapter 13.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.edits import Copy, Delete, Discrete, Edit, EditMap, Paste, PreparedEdit, PreparedStack
from cagefield.edits.patch import SplatPatch
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import FACES, Cage
from cagefield.geometry.quaternions import quaternions_from_matrices, rotation_matrices
from cagefield.rendering.splats.gaussian_profile import (
    ENDS,
    LEAST_OPAQUE,
    MOST_OPAQUE,
    mass_across,
    part_between,
)
from cagefield.rendering.splats.splat_motion import MovedSplats, moved_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.typing import Array, Mask
from cagefield.warps.forward import to_deformed

BEND = 0.08
"""Largest b of a splat that stays whole: a turn by 9 degrees from its middle to two standard deviations."""

SHADE = 0.15
"""Largest d of a splat that stays whole."""

FAINT = 0.3
"""Splats of less opacity than this may bend more, as much as they are fainter."""

MIN_DRAWN_OPACITY = 1.0 / 255.0
"""Splats of at most this opacity are not drawn, and no children."""

SPACING = 1.6
"""Distance of children, in their standard deviations."""

LEAST_WIDTH = 0.35
"""Least r of one splitting."""

ROUNDS = 3
"""Rounds in which split splats are examined again."""

CUTS = 2
"""Rounds in which splats across a cut, or a shadow's edge, are split."""

REACH = 2.0
"""Standard deviations at which a splat ends, for cuts: 2 % of it may hang over."""

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
    known = _known_splits(splats)
    if known and known[0][0] == active:
        return known[0][1]
    most = (MOST - 1.0) * len(splats) + MORE
    parents = np.zeros(len(splats), bool)
    children: SplatSet | None = None
    sources = np.zeros(0, np.int64)
    for count, step in enumerate(active):
        before = PreparedStack(active[:count])
        parts: list[_Part] = []
        if children is not None:
            stay, others = _settled(children, before, step, None, most - len(children), proceed)
            parts = [
                (children.take(stay), sources[stay]),
                *((part, sources[rows]) for part, rows in others),
            ]
        stay, others = _settled(
            splats, before, step, parents, most - sum(len(part) for part, _ in parts), proceed
        )
        parents |= ~stay
        parts += others
        if parts:
            children = SplatSet.concatenate([part for part, _ in parts])
            sources = np.concatenate([rows for _, rows in parts])
    split = None if children is None else Split(parents, children, sources)
    known[:] = [(active, split)]
    return split


@memoized_weakly
def _known_splits(splats: SplatSet) -> list[tuple[tuple[PreparedEdit, ...], Split | None]]:
    """Latest result of `split_of` for a living set, with its edits; none at first."""
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
    for turn in range(CUTS if isinstance(step.edit, Discrete) else ROUNDS):
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


@dataclass(frozen=True)
class _Children:
    """Children along one direction of z: of splat `parent` [C], at x [C], of width r [C], opacity [C].

    Across that direction their width is `across` [C].
    """

    parent: NDArray[np.int64]
    direction: Array
    x: Array
    r: Array
    opacity: Array
    across: Array

    def take(self, rows: NDArray[np.int64] | Mask) -> _Children:
        """Some of them."""
        return _Children(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


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
    A = np.concatenate([_axes(field, rest), moved.jacobian[elsewhere] @ _axes(field, others)])
    edit = step.edit
    if isinstance(edit, Discrete):
        children = _cut(edit, field, rows, points, A)
        if isinstance(step.patch, SplatPatch):
            whole = np.flatnonzero(~np.isin(rows, children.parent))
            lit = _shaded(edit, step.patch, field, rows[whole], points[whole], A[whole])
            children = _together([children, lit])
    else:
        children = _bent(edit, field, rows, points, A, proceed)
    return _parted(splats, children, room) if len(children.parent) else None


def _axes(field: SplatField, rows: NDArray[np.int64]) -> Array:
    """A [M,3,3] of splats."""
    turns = rotation_matrices(field.quaternions[rows].astype(np.float64))
    return np.asarray(turns * np.exp(field.log_scales[rows].astype(np.float64))[:, None, :])


def _near(
    step: PreparedEdit, field: SplatField, moved: MovedSplats
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which splats in their own places [.], and which of those that moved [.], an edit may have to split."""
    from cagefield.rendering.splats.kernels.deformation import within_reach, within_reach_at_rest

    boxes = np.concatenate([step.boxes, step.edit.inner.aabb[None]])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    # Stretches are Frobenius' norms, that of nothing is sqrt(3).
    is_cut = isinstance(step.edit, Discrete)
    least = 0.0 if is_cut else _UNSTRETCHED * SMALL * float(np.linalg.norm(high - low))
    rest, elsewhere = np.empty(len(field), bool), np.empty(len(moved.source), bool)
    scales = field.log_scales
    within_reach_at_rest(field.means, moved.left, scales, low, high, REACH, least, _UNSTRETCHED, rest)
    if len(elsewhere):
        stretch = np.linalg.norm(moved.jacobian, axis=(1, 2))
        within_reach(moved.points, moved.source, scales, low, high, REACH, least, stretch, elsewhere)
    return np.flatnonzero(rest), np.flatnonzero(elsewhere)


_UNSTRETCHED = float(np.sqrt(3.0))


def _bent(
    edit: Edit,
    field: SplatField,
    rows: NDArray[np.int64],
    points: Array,
    A: Array,
    proceed: Callable[[], None] | None,
) -> _Children:
    warp, count = edit.exact_warp, len(rows)
    steps = 2.0 * A.transpose(0, 2, 1)  # [M, axis, 3]
    every = np.concatenate([points[:, None], points[:, None] + steps, points[:, None] - steps], axis=1)
    mapped = to_deformed(warp, every.reshape(-1, 3), proceed=proceed)
    F, lost = mapped.points.reshape(count, 7, 3), mapped.lost.reshape(count, 7)
    length = np.linalg.norm(F[:, 1:4] - F[:, 4:7], axis=2)
    second = np.linalg.norm(F[:, 1:4] + F[:, 4:7] - 2.0 * F[:, :1], axis=2)
    bend = np.where(length > 0.0, second / np.maximum(length, 1e-300), 0.0)
    J = mapped.jacobian.reshape(count, 7, 3, 3)
    shear = np.linalg.norm((J[:, 1:4] - J[:, 4:7]) @ A[:, None], axis=2)  # [M, i, j]
    shear /= np.maximum(np.maximum(length[:, :, None], length[:, None, :]), 1e-300)
    shear[:, [0, 1, 2], [0, 1, 2]] = 0.0
    bend = np.maximum(bend, shear.max(axis=2))
    bend[lost[:, :1] | lost[:, 1:4] | lost[:, 4:7]] = 0.0
    return _rows(field, rows, bend, BEND)


def _rows(field: SplatField, rows: NDArray[np.int64], change: Array, most: float) -> _Children:
    """Rows of children for those splats [M] that change by more than `most` along an axis: change [M,3]."""
    axis, worst = change.argmax(axis=1), change.max(axis=1)
    opacity = field.opacities[rows].astype(np.float64)
    split = np.flatnonzero((worst * np.minimum(1.0, opacity / FAINT) > most) & (opacity > MIN_DRAWN_OPACITY))
    r = np.maximum(most / worst[split], LEAST_WIDTH)
    children = _row(rows[split], np.eye(3)[axis[split]], r, opacity[split])
    return children.take(np.flatnonzero(children.opacity > MIN_DRAWN_OPACITY))


def _row(parent: NDArray[np.int64], direction: Array, r: Array, opacity: Array) -> _Children:
    """Rows of children of the widths r [M] along directions [M,3], for splats of an opacity [M]."""
    wide = np.sqrt(1.0 - r * r)
    half = np.ceil(3.0 * wide / (SPACING * r)).astype(np.int64)
    count = 2 * half + 1
    owner = np.repeat(np.arange(len(parent)), count)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count + half, count)
    x = place * SPACING * r[owner]
    alpha = np.minimum(opacity, MOST_OPAQUE)[owner]
    wanted = -np.log1p(-alpha * np.exp(-0.5 * x * x))  # optical depth of the splat in the middle of a child
    alpha = alpha * np.exp(-0.5 * (x / wide[owner]) ** 2)
    for _ in range(8):
        depth = -np.log1p(-alpha)
        for step in (1, 2):
            beside = -np.log1p(-alpha * np.exp(-0.5 * (step * SPACING) ** 2))
            same = owner[step:] == owner[:-step]
            depth[step:] += np.where(same, beside[:-step], 0.0)
            depth[:-step] += np.where(same, beside[step:], 0.0)
        alpha = -np.expm1(np.log1p(-alpha) * wanted / np.maximum(depth, 1e-30))
    # The transmittance of the row beside its middle, over all the width across it, equals that of the splat.
    own, mass = mass_across(-np.expm1(-wanted)), mass_across(alpha)
    for step in (1, 2):
        beside = mass_across(alpha * np.exp(-0.5 * (step * SPACING) ** 2))
        same = owner[step:] == owner[:-step]
        mass[step:] += np.where(same, beside[:-step], 0.0)
        mass[:-step] += np.where(same, beside[step:], 0.0)
    across = np.where(mass > 0.0, own / np.maximum(mass, 1e-300), 1.0)
    return _Children(parent[owner], direction[owner], x, r[owner], alpha, across)


def _cut(edit: Discrete, field: SplatField, rows: NDArray[np.int64], points: Array, A: Array) -> _Children:
    """The splats that faces go through, in two parts each; of a splat that several cut, the deepest cut."""
    best = np.full(len(rows), np.inf)
    t, direction = np.zeros(len(rows)), np.zeros((len(rows), 3))
    # A paste hides nothing; its cage is in another scene, where what is pasted was cut already.
    cuts: list[tuple[Cage, Mask]] = (
        [] if isinstance(edit, Paste) else [(edit.inner, np.ones(len(rows), bool))]
    )
    if not isinstance(edit, Delete | Paste):
        # Splats that land in the deformed cage hide those that stay there, but not those that leave.
        cuts.append((edit.deformed, ~edit.inner.contains(points) | isinstance(edit, Copy)))
    size = np.linalg.norm(A, axis=(1, 2))
    for cage, concerned in cuts:
        for face in FACES:
            n, at, h = _crossing(cage, face, points, A, size)
            nearer = concerned[n] & (np.abs(at) < np.minimum(best[n], REACH))
            n, at = n[nearer], at[nearer]
            best[n], t[n], direction[n] = np.abs(at), at, h[nearer]
    split = np.flatnonzero((best < REACH) & (field.opacities[rows] > LEAST_OPAQUE))
    t, parent, direction = t[split], rows[split], direction[split]
    alpha = np.minimum(field.opacities[parent].astype(np.float64), MOST_OPAQUE)
    parts = [
        _Children(parent, direction, *part_between(alpha, low, high))
        for low, high in ((np.full(len(t), -ENDS), t), (t, np.full(len(t), ENDS)))
    ]
    return _together(parts)


def _together(parts: list[_Children]) -> _Children:
    return _Children(
        *(np.concatenate([getattr(part, n) for part in parts]) for n in _Children.__dataclass_fields__)
    )


def _shaded(
    edit: Edit, patch: SplatPatch, field: SplatField, rows: NDArray[np.int64], points: Array, A: Array
) -> _Children:
    """Rows of children for the splats over which the light of a patch changes."""
    # The cage of a paste is in another scene.
    inside = np.zeros(len(rows), bool) if isinstance(edit, Paste) else edit.inner.contains(points)
    change = np.zeros((len(rows), 3))
    steps = A.transpose(0, 2, 1)  # [M, axis, 3]
    for light, here in ((patch.light, ~inside), (patch.part, inside)):
        if light is not None:
            along = [points[here, None] + way * steps[here] for way in (-1.0, 0.0, 1.0)]
            change[here] = np.ptp([light.at(at.reshape(-1, 3)).reshape(-1, 3) for at in along], axis=0)
            # Splats smaller than a cell of the light's grid show its noise.
            change[here] *= np.linalg.norm(steps[here], axis=2) > 0.5 * light.spacing.max()
    return _rows(field, rows, change, SHADE)


def _crossing(
    cage: Cage, face: str, points: Array, A: Array, size: Array
) -> tuple[NDArray[np.int64], Array, Array]:
    """(which splats [K] cross a face's plane in the face, t [K], unit directions [K,3] of z).

    `size` [M] is no less than a standard deviation in any direction.
    """
    corners = cage.corners[list(FACES[face])]
    middle = corners.mean(axis=0)
    normal = np.cross(corners[3] - corners[0], corners[2] - corners[1])
    normal /= np.linalg.norm(normal)
    inwards = cage.corners.mean(axis=0) - middle
    if normal @ inwards < 0.0:
        normal = -normal
    away = (points - middle) @ normal
    n = np.flatnonzero(np.abs(away) < REACH * size)
    h = A[n].transpose(0, 2, 1) @ normal
    width = np.maximum(np.linalg.norm(h, axis=1), 1e-300)
    t = -away[n] / width
    near = np.abs(t) < REACH
    n, h, width, t = n[near], h[near], width[near], t[near]
    # Where it is thickest on the plane, and a little inside.
    on_plane = points[n] + np.einsum("mij,mj->mi", A[n], h) * (t / width)[:, None]
    inside = cage.contains(on_plane + 1e-6 * inwards)
    return n[inside], t[inside], (h / width[:, None])[inside]


def _parted(
    splats: SplatSet, children: _Children, room: float
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
    A = _axes(field, n)
    along = np.einsum("cij,cj->ci", A, h)
    across = children.across[:, None]
    U, s, _ = np.linalg.svd(
        across[:, None] * A + ((children.r[:, None] - across) * along)[:, :, None] * h[:, None, :]
    )
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
