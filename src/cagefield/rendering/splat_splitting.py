"""Splats split where one Gaussian cannot follow an edit: the map bends over it, or a cut goes through it.

Notation: a splat is m + A z, z ~ N(0, 1) in three dimensions, A = Q diag(s). An edit takes it to
F(m) + J A z, which is right as far as F is affine over it. Two things are not:

- Bending. Along the axis a_i of A the second-order term of F at two standard deviations, against the length
  of what the first-order term makes of them, is

      b_i = |F(m + 2 a_i) + F(m - 2 a_i) - 2 F(m)| / (2 |F(m + 2 a_i) - F(m - 2 a_i)| / 2).

  Where b_i > BEND the splat becomes a row of narrower ones along a_i: N(0, 1) is the convolution of N(0, r^2)
  and N(0, 1 - r^2), so children of the standard deviation r at distances of SPACING r, weighted by
  N(0, 1 - r^2), add up to it, but for a ripple of 2 exp(-2 (pi / SPACING)^2) = 0.1 %. With r = BEND / b_i
  they bend by BEND at most: b is proportional to the width. Opacities are such that the row lets the ray
  through the middle of each child lose what the splat let it lose there.
- Cuts. A discrete edit takes what is inside a cage away. A splat through a face, at t standard deviations of
  its own across it, becomes the parts of it on both sides: N(0, 1) cut off at t has the mean -+ phi / Phi and
  the variance 1 -+ t phi / Phi - (phi / Phi)^2, and a child has these moments and its part of the mass.

Each child goes its own way then. Children are canonical splats; of edits in a stack, each splits what those
before it left.

Source: second-order criterion and rows of children: ours. Moments of the truncated normal distribution:
Johnson, Kotz and Balakrishnan, "Continuous Univariate Distributions" (1994), chapter 13.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from cagefield.cages import FACES, Cage
from cagefield.edits import Edit, EditStack
from cagefield.fields.splat import SplatField
from cagefield.quaternions import quaternions_of, rotation_matrices
from cagefield.rendering.moved_splats import moved_splats
from cagefield.typing import Array, Mask
from cagefield.warps.forward import to_deformed

BEND = 0.12
"""Largest b of a splat that stays whole: a turn by 7 degrees from its middle to two standard deviations."""

SPACING = 1.6
"""Distance of children, in their standard deviations."""

LEAST_WIDTH = 0.15
"""Least r of one splitting."""

ROUNDS = 3
"""Times that what was split is looked through again."""

REACH = 2.0
"""Standard deviations at which a splat ends, for cuts: 2 % of it may hang over."""

SMALL = 0.004
"""Splats whose largest standard deviation is below this share of an edit's size are not tried for bending."""

MOST_OPAQUE = 0.9999
"""Opacities are taken as at most this."""

MOST = 2.0
"""Splats there may be after splitting, against those before, beside MORE."""

MORE = 200_000


def split_for_edits(
    field: SplatField, edits: EditStack, *, proceed: Callable[[], None] | None = None
) -> SplatField:
    """The field with those splats split that one Gaussian each does not show under the edits.

    The field itself where none is. Known of a field while it lives, for the edits asked for last.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    active = edits.active
    if not active:
        return field
    known = _known.get(field)
    if known is not None and known[0] == active:
        return known[1]
    found = field
    for count, edit in enumerate(active, start=1):
        before = EditStack(active[: count - 1])
        settled: list[SplatField] = []
        for _ in range(ROUNDS):
            split = _split_once(found, before, edit, MOST * len(field) + MORE, proceed)
            if split is None:
                break
            # Children are looked through again; the others stay as they are.
            stay, children = split
            settled.append(found.take(stay))
            found = children
        if settled:
            found = _joined([*settled, found])
    _known[field] = (active, found)
    return found


_known: WeakKeyDictionary[SplatField, tuple[tuple[Edit, ...], SplatField]] = WeakKeyDictionary()


@dataclass(frozen=True)
class _Children:
    """Children along one direction of z: of splat `parent` [C], at x [C], of width r [C], opacity [C]."""

    parent: NDArray[np.int64]
    direction: Array
    x: Array
    r: Array
    opacity: Array


def _split_once(
    field: SplatField, before: EditStack, edit: Edit, most: float, proceed: Callable[[], None] | None
) -> tuple[Mask, SplatField] | None:
    """(which splats stay whole [N], the children of the others), or None where all do."""
    moved = moved_splats(field, before, proceed=proceed)
    rows = np.concatenate([np.flatnonzero(~moved.left), moved.source])
    points = np.concatenate([field.means[~moved.left].astype(np.float64), moved.points])
    jacobian = np.concatenate([np.tile(np.eye(3), (len(rows) - len(moved.source), 1, 1)), moved.jacobian])
    near = _near(edit, field, rows, points, jacobian)
    rows, points, jacobian = rows[near], points[near], jacobian[near]
    if not len(rows):
        return None
    A = jacobian @ _axes(field, rows)
    if edit.adjustment == "discrete":
        children = _cut(edit, field, rows, points, A)
    else:
        children = _bent(edit, field, rows, points, A, proceed)
    return _parted(field, children, most) if len(children.parent) else None


def _axes(field: SplatField, rows: NDArray[np.int64]) -> Array:
    """A [M,3,3] of splats."""
    turns = rotation_matrices(field.quaternions[rows].astype(np.float64))
    return np.asarray(turns * np.exp(field.log_scales[rows].astype(np.float64))[:, None, :])


def _near(
    edit: Edit, field: SplatField, rows: NDArray[np.int64], points: Array, jacobian: Array
) -> NDArray[np.int64]:
    """Which of the splats an edit may have to split."""
    boxes = np.concatenate([edit.boxes, edit.inner.aabb[None]])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    size = np.exp(field.log_scales.max(axis=1).astype(np.float64))[rows]
    size = size * np.linalg.norm(jacobian, axis=(1, 2))
    reach = REACH * size[:, None]
    inside = ((points + reach >= low) & (points - reach <= high)).all(axis=1)
    if edit.adjustment != "discrete":
        inside &= size > SMALL * float(np.linalg.norm(high - low))
    return np.flatnonzero(inside)


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
    bend[lost[:, :1] | lost[:, 1:4] | lost[:, 4:7]] = 0.0
    axis = bend.argmax(axis=1)
    worst = bend.max(axis=1)
    split = np.flatnonzero(worst > BEND)
    r = np.maximum(BEND / worst[split], LEAST_WIDTH)
    return _row(rows[split], np.eye(3)[axis[split]], r, field.opacities[rows[split]].astype(np.float64))


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
    return _Children(parent[owner], direction[owner], x, r[owner], alpha)


def _cut(edit: Edit, field: SplatField, rows: NDArray[np.int64], points: Array, A: Array) -> _Children:
    """The splats that faces go through, in two parts each; of a splat that several cut, the deepest cut."""
    best = np.full(len(rows), np.inf)
    t, direction = np.zeros(len(rows)), np.zeros((len(rows), 3))
    cuts: list[tuple[Cage, Mask]] = [(edit.inner, np.ones(len(rows), bool))]
    if not edit.deleted:
        # What lands in the deformed cage hides what stays there, but not what leaves.
        cuts.append((edit.deformed, ~edit.inner.contains(points) | edit.keep_source))
    for cage, concerned in cuts:
        for face in FACES:
            at, h = _crossing(cage, face, points, A)
            nearer = concerned & (np.abs(at) < np.minimum(best, REACH))
            best[nearer], t[nearer], direction[nearer] = np.abs(at[nearer]), at[nearer], h[nearer]
    split = np.flatnonzero(best < REACH)
    t, parent, direction = t[split], rows[split], direction[split]
    alpha = np.minimum(field.opacities[parent].astype(np.float64), MOST_OPAQUE)
    density = np.exp(-0.5 * t * t) / np.sqrt(2.0 * np.pi)
    parts = []
    for sign, mass in ((-1.0, ndtr(t)), (1.0, ndtr(-t))):
        mean = sign * density / mass
        variance = 1.0 + sign * t * density / mass - mean * mean
        r = np.sqrt(np.maximum(variance, 1e-3))
        parts.append(_Children(parent, direction, mean, r, -np.expm1(np.log1p(-alpha) * mass / r)))
    joint = [np.concatenate([getattr(part, n) for part in parts]) for n in _Children.__dataclass_fields__]
    return _Children(*joint)


def _crossing(cage: Cage, face: str, points: Array, A: Array) -> tuple[Array, Array]:
    """(t [M], unit direction [M,3] of z) of a face's plane; t is infinite where a splat does not cross it."""
    corners = cage.corners[list(FACES[face])]
    middle = corners.mean(axis=0)
    normal = np.cross(corners[3] - corners[0], corners[2] - corners[1])
    normal /= np.linalg.norm(normal)
    inwards = cage.corners.mean(axis=0) - middle
    if normal @ inwards < 0.0:
        normal = -normal
    h = A.transpose(0, 2, 1) @ normal
    width = np.maximum(np.linalg.norm(h, axis=1), 1e-300)
    t = -((points - middle) @ normal) / width
    # Where it is thickest on the plane, and a little inside.
    on_plane = points + np.einsum("mij,mj->mi", A, h) * (t / width)[:, None]
    near = np.abs(t) < REACH
    inside: Mask = np.zeros(len(points), bool)
    inside[near] = cage.contains(on_plane[near] + 1e-6 * inwards)
    return np.where(inside & near, t, np.inf), h / width[:, None]


def _parted(field: SplatField, children: _Children, most: float) -> tuple[Mask, SplatField] | None:
    """(which splats stay whole, the others' children); of too many, those of the most opaque parents."""
    parents = np.unique(children.parent)
    if len(field) + len(children.parent) > most:
        order = np.argsort(-field.opacities[parents], kind="stable")
        fits = int(len(parents) * max(0.0, most - len(field)) / len(children.parent))
        parents = parents[order[:fits]]
        kept = np.isin(children.parent, parents)
        children = _Children(*(getattr(children, n)[kept] for n in _Children.__dataclass_fields__))
        if not len(children.parent):
            return None
    n, h = children.parent, children.direction
    A = _axes(field, n)
    along = np.einsum("cij,cj->ci", A, h)
    U, s, _ = np.linalg.svd(A + ((children.r - 1.0)[:, None] * along)[:, :, None] * h[:, None, :])
    U[:, :, 2] *= np.linalg.det(U)[:, None]
    stay = np.ones(len(field), bool)
    stay[parents] = False
    return stay, SplatField(
        (field.means[n] + along * children.x[:, None]).astype(np.float32),
        np.log(np.maximum(s, 1e-30)).astype(np.float32),
        quaternions_of(U).astype(np.float32),
        children.opacity.astype(np.float32),
        field.sh[n],
        antialiased=field.antialiased,
        bounds=field.bounds,
        unbounded=field.unbounded,
    )


def _joined(parts: list[SplatField]) -> SplatField:
    names = ("means", "log_scales", "quaternions", "opacities", "sh")
    means, log_scales, quaternions, opacities, sh = (
        np.concatenate([getattr(part, name) for part in parts]) for name in names
    )
    return dataclasses.replace(
        parts[0], means=means, log_scales=log_scales, quaternions=quaternions, opacities=opacities, sh=sh
    )
