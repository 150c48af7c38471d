"""Children of splats that one Gaussian each does not show under an edit: rows where the map bends or the
light changes, two parts at a cut. Notation as in `splitting`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.parallel_parts import map_parts
from cagefield.edits import Copy, Delete, Discrete, Edit, Paste
from cagefield.edits.patch import SplatPatch
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import FACES, Cage
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.rendering.splats.gaussian_profile import LEAST_OPAQUE, MOST_OPAQUE, mass_across, part_below
from cagefield.typing import Array, Mask
from cagefield.warps.forward import to_deformed
from cagefield.warps.interfaces import Warp

BEND = 0.08
"""Largest b of a splat that stays whole: a turn by 9 degrees from its middle to two standard deviations."""

SMALL_SHARE = 0.02
"""Splats whose largest standard deviation is below this share of an edit's size may bend and be shaded more,
as much as they are smaller: those that stay are off by 2.5 pixels, at two of it, where an edit fills 800."""

SHADE = 0.15
"""Largest d of a splat that stays whole."""

FAINT = 0.3
"""Splats of less opacity than this may bend more, as much as they are fainter."""

MIN_DRAWN_OPACITY = 1.0 / 255.0
"""Splats of at most this opacity are not drawn, and no children."""

PART_SPLATS = 4096
"""Splats whose bend one thread computes at a time."""

SPACING = (
    (0.5, 0.55, 0.6, 0.66, 0.7, 0.75, 0.8, 0.83, 0.866, 0.9),
    (1.92, 1.77, 1.63, 1.46, 1.34, 1.20, 1.07, 1.00, 0.92, 0.85),
)
"""Widths r of children where a splat bends, three in a row, and their distances in r: of the least squared
difference to the splat's alpha along the row, summed over opacities of 0.02, 0.6 and 0.9. It is 1 % of that
at r = 0.8, 2 % at 0.7 and 8 % at 0.5; rows of 5 to 13 bring pictures no nearer to finely split ones."""

SHADED_SPACING = 1.6
"""Distance, in r, of children on which light changes; as many as reach three standard deviations. They lie in
place, where a row of three would show."""

ROW_PASSES = 16
"""Passes that fit the opacities of a row."""

WIDEST = 0.9
"""Largest r: splats that bend a little too much become rows narrower than they must be."""

LEAST_WIDTH, LEAST_SHADED_WIDTH = 0.5, 0.35
"""Least r of one splitting, where a splat bends and where light changes on it."""

REACH = 2.0
"""Standard deviations at which a splat ends, for cuts: 2 % of it may hang over."""


@dataclass(frozen=True)
class Children:
    """Children along one direction of z: of splat `parent` [C], at x [C], of width r [C], opacity [C].

    Across that direction their width is `across` [C].
    """

    parent: NDArray[np.int64]
    direction: Array
    x: Array
    r: Array
    opacity: Array
    across: Array

    def take(self, rows: NDArray[np.int64] | Mask) -> Children:
        """The children at some rows."""
        return Children(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def splat_axes(field: SplatField, rows: NDArray[np.int64]) -> Array:
    """A [M,3,3] of splats."""
    turns = rotation_matrices(field.quaternions[rows].astype(np.float64))
    return np.asarray(turns * np.exp(field.log_scales[rows].astype(np.float64))[:, None, :])


def bent_children(
    edit: Edit,
    field: SplatField,
    rows: NDArray[np.int64],
    points: Array,
    A: Array,
    size: float,
    proceed: Callable[[], None] | None,
) -> Children:
    """Rows of children for the splats over which the map of an edit of a size, world units, bends."""
    warp = edit.exact_warp
    parts = map_parts(lambda part: _bend(warp, points[part], A[part], proceed), len(rows), PART_SPLATS)
    return _rows(field, rows, np.concatenate(parts) * _weights(A, size), BEND, LEAST_WIDTH)


def _weights(A: Array, size: float) -> Array:
    """Weights [M,1] of changes over splats of axes A [M,3,3] under an edit of a size, see `SMALL_SHARE`."""
    largest = np.linalg.norm(A, axis=1).max(axis=1, keepdims=True)
    return np.asarray(np.minimum(1.0, largest / (SMALL_SHARE * size)))


def _bend(warp: Warp, points: Array, A: Array, proceed: Callable[[], None] | None) -> Array:
    """Bend [M,3] of a map along the axes A [M,3,3] of splats at points [M,3]."""
    count = len(points)
    steps = 2.0 * A.transpose(0, 2, 1)  # [M, axis, 3]
    every = np.concatenate([points[:, None], points[:, None] + steps, points[:, None] - steps], axis=1)
    # The bend over a splat is seen by the long steps of a flow as by short ones, in half of the time.
    mapped = to_deformed(warp, every.reshape(-1, 3), coarse=True, proceed=proceed)
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
    return np.asarray(bend)


def _rows(
    field: SplatField, rows: NDArray[np.int64], change: Array, most: float, least_width: float
) -> Children:
    """Rows of children for those splats [M] that change by more than `most` along an axis: change [M,3]."""
    axis, worst = change.argmax(axis=1), change.max(axis=1)
    opacity = field.opacities[rows].astype(np.float64)
    split = np.flatnonzero((worst * np.minimum(1.0, opacity / FAINT) > most) & (opacity > MIN_DRAWN_OPACITY))
    r = np.maximum(most / worst[split], least_width)
    children = _row(rows[split], np.eye(3)[axis[split]], r, opacity[split], least_width < LEAST_WIDTH)
    return children.take(np.flatnonzero(children.opacity > MIN_DRAWN_OPACITY))


def _row(
    parent: NDArray[np.int64], direction: Array, r: Array, opacity: Array, shaded: bool = False
) -> Children:
    """Rows of children of the widths r [M], at most WIDEST, along directions [M,3], for splats of an opacity
    [M]: three each, or as many as `shaded` ones have."""
    r = np.minimum(r, WIDEST)
    wide = np.sqrt(1.0 - r * r)
    half, gap = np.ones(len(r), np.int64), np.interp(r, *SPACING)
    if shaded:
        half, gap = (
            np.ceil(3.0 * wide / (SHADED_SPACING * r)).astype(np.int64),
            np.full(len(r), SHADED_SPACING),
        )
    count = 2 * half + 1
    owner = np.repeat(np.arange(len(parent)), count)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count + half, count)
    gap = gap[owner]
    x = place * gap * r[owner]
    alpha = np.minimum(opacity, MOST_OPAQUE)[owner]
    wanted = -np.log1p(-alpha * np.exp(-0.5 * x * x))  # optical depth of the splat in the middle of a child
    alpha = alpha * np.exp(-0.5 * (x / wide[owner]) ** 2)
    for _ in range(ROW_PASSES):
        depth = -np.log1p(-alpha)
        for step in (1, 2):
            beside = -np.log1p(-alpha * np.exp(-0.5 * (step * gap) ** 2))
            same = owner[step:] == owner[:-step]
            depth[step:] += np.where(same, beside[:-step], 0.0)
            depth[:-step] += np.where(same, beside[step:], 0.0)
        alpha = -np.expm1(np.log1p(-alpha) * wanted / np.maximum(depth, 1e-30))
    # The transmittance of the row beside its middle, over all the width across it, equals that of the splat.
    own, mass = mass_across(-np.expm1(-wanted)), mass_across(alpha)
    for step in (1, 2):
        beside = mass_across(alpha * np.exp(-0.5 * (step * gap) ** 2))
        same = owner[step:] == owner[:-step]
        mass[step:] += np.where(same, beside[:-step], 0.0)
        mass[:-step] += np.where(same, beside[step:], 0.0)
    across = np.where(mass > 0.0, own / np.maximum(mass, 1e-300), 1.0)
    return Children(parent[owner], direction[owner], x, r[owner], alpha, across)


def cut_children(
    edit: Discrete, field: SplatField, rows: NDArray[np.int64], points: Array, A: Array
) -> Children:
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
    below = Children(parent, direction, *part_below(alpha, t))
    above = Children(parent, -direction, *part_below(alpha, -t))
    children = concatenate_children([below, above])
    return children.take(np.flatnonzero(children.opacity > MIN_DRAWN_OPACITY))


def concatenate_children(parts: list[Children]) -> Children:
    """Children of several kinds, one after the other."""
    return Children(
        *(np.concatenate([getattr(part, n) for part in parts]) for n in Children.__dataclass_fields__)
    )


def shaded_children(
    edit: Edit,
    patch: SplatPatch,
    field: SplatField,
    rows: NDArray[np.int64],
    points: Array,
    A: Array,
    size: float,
) -> Children:
    """Rows of children for the splats over which the light of a patch changes; size as `bent_children`."""
    # The cage of a paste is in another scene.
    inside = np.zeros(len(rows), bool) if isinstance(edit, Paste) else edit.inner.contains(points)
    change = np.zeros((len(rows), 3))
    steps = A.transpose(0, 2, 1)  # [M, axis, 3]
    length = np.linalg.norm(steps, axis=2)
    for light, here in ((patch.light, ~inside), (patch.part, inside)):
        if light is not None:
            # Splats smaller than a cell of the light's grid show its noise.
            long = here[:, None] & (length > 0.5 * light.spacing.max())
            middle, step = points[np.nonzero(long)[0]], steps[long]
            change[long] = np.ptp([light.at(middle + way * step) for way in (-1.0, 0.0, 1.0)], axis=0)
    return _rows(field, rows, change * _weights(A, size), SHADE, LEAST_SHADED_WIDTH)


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
