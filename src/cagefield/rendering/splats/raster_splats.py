"""Splats in deformed space, the input of the rasterizer: those of a SplatField, deformed by edits.

Notation: J = d(deformed)/d(canonical) at a splat's mean, J = R S its polar decomposition, C its covariance.
An edit takes the mean along, C to J C J^T, and color is evaluated at R^T d.

Opacity. A splat lets the ray through its mean lose the share o, whichever way the ray goes. With
`preserve_opacity` a stretched density is multiplied by the stretch of the ray through it, so that ray
still loses o: a splat keeps its opacity, exactly. Without (the paper), the ray's optical depth grows as its
way through the splat does. This length depends on its direction, and a splat has one opacity: it gets the
mean of it, o' = 1 - (1 - o)^(|det J|^(1/3)), which is exact where J scales all directions alike.
Kept is the default. Against 16 scenes and parts really scaled by .5 to 1.8, of 4x4 pixels for each, it
is 0.02 dB better in the mean (-0.01 to 0.14). At the photos' own size it is -0.03 dB (-0.25 to 0.03): the
pixels' blur widens splats that shrink, and less opacity hides that (benchmarks/results/opacity_splats.md). It
matters little, as trained splats are nearly opaque: nine tenths of a digger's lose 90 % and more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.edits import EditMap
from cagefield.edits.mapped_samples import SampleGrade
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.rendering.splats.kernels.splat_args import SplatArgs
from cagefield.rendering.splats.splat_motion import MovedSplats, changed_sh, moved_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.typing import Array, Float32, Mask

if TYPE_CHECKING:
    from cagefield.rendering.splats.splitting import Split


@dataclass(frozen=True, eq=False)
class DeformedSplats:
    """N splats in deformed space (world units).

    Attributes:
        means: [N,3] float32.
        covariances: [N,6] float32: xx, xy, xz, yy, yz, zz.
        opacities: [N] float32 in [0, 1].
        sh: [N, (degree+1)^2, 3] float32, as the field has them: evaluated along the canonical direction.
        rotations: [N,3,3] float32, or None where no splat was turned: R of J = R S, J = d(deformed) /
            d(canonical) at the mean. The color of splat n seen along d is that of its harmonics at R^T d.
        antialiased: as SplatField.
        tangents: [N,6] float32 of discs: a, b along their first two axes, each as long as its standard
            deviation; None where splats are no discs.
    """

    means: Float32
    covariances: Float32
    opacities: Float32
    sh: Float32
    rotations: Float32 | None = None
    antialiased: bool = False
    tangents: Float32 | None = None

    def __post_init__(self) -> None:
        # Numba compiles a kernel again for arrays that may be written, and again for those with strides.
        for name in ("means", "covariances", "opacities", "sh", "rotations", "tangents"):
            values = getattr(self, name)
            if values is not None and (values.flags.writeable or not values.flags.c_contiguous):
                object.__setattr__(self, name, _frozen(np.ascontiguousarray(values).view()))

    def __len__(self) -> int:
        return len(self.means)

    def kernel_args(self) -> SplatArgs:
        """Arguments of the Numba kernels."""
        rotations = NO_ROTATIONS if self.rotations is None else self.rotations
        return SplatArgs(self.means, self.covariances, self.opacities, self.sh, rotations)

    @classmethod
    def of_field(cls, field: SplatField) -> DeformedSplats:
        """The splats of a field without edits, made once while it lives."""
        return _undeformed_splats(field)


@memoized_weakly
def _undeformed_splats(field: SplatField) -> DeformedSplats:
    return DeformedSplats(
        field.means,
        _frozen(covariances_of(field.quaternions, field.log_scales)),
        field.opacities,
        field.sh,
        antialiased=field.antialiased,
        tangents=_frozen(_tangents_of(field)) if field.discs else None,
    )


NO_ROTATIONS: Float32 = np.empty((0, 3, 3), np.float32)
"""Kernel argument for rotations where no splat is rotated."""
NO_ROTATIONS.setflags(write=False)


def deformed_splats(
    splats: SplatField | SplatSet,
    edits: EditMap,
    *,
    preserve_opacity: bool = True,
    coarse: bool = False,
    split: Split | None = None,
    whole: DeformedSplats | None = None,
    proceed: Callable[[], None] | None = None,
) -> DeformedSplats:
    """The splats that edits make of a field, those that are hidden left out; the field's own where none does.

    A splat goes with its mean as a whole, see `moved_splats`, or its children do in its place, where it is
    `split`; those that no edit reaches are as they were, bit for bit. Maps are exact, whatever lattices the
    edits have, and kept for a living SplatSet and stacks that begin alike. `coarse` integrates a flow shell
    with long steps, for pictures while something moves. `whole` are more splats, which come last. `proceed`
    is called now and then, and gives the work up by raising.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    splats = SplatSet.from_field(splats).with_pastes(edits)
    moved = moved_splats(splats, edits, coarse=coarse, proceed=proceed)
    more = [] if whole is None else [whole]
    if split is not None:
        moved = moved.without(split.parents)
        others = moved_splats(split.children, edits, coarse=coarse, proceed=proceed)
        more.insert(0, deformed_where(split.children.field, others, preserve_opacity))
    return deformed_where(splats.field, moved, preserve_opacity, *more)


def deformed_where(
    field: SplatField, moved: MovedSplats, preserve_opacity: bool, *more: DeformedSplats
) -> DeformedSplats:
    """The splats of a field where they are, in the order of `Places`, and `more` after them."""
    base = DeformedSplats.of_field(field)
    if moved.is_at_rest and not more:
        return base
    means, covariances, own, rotations = _carried(field, moved, preserve_opacity)
    places = Places(moved)
    tangents = None
    if base.tangents is not None:
        along = np.einsum("mij,mtj->mti", moved.jacobian, base.tangents[moved.source].reshape(-1, 2, 3))
        carried = along.reshape(-1, 6).astype(np.float32)
        tangents = places.put(base.tangents, carried, *(part.tangents for part in more))
    turned = len(rotations) > 0 and float(np.abs(rotations - _NO_TURN).max()) > _TURNED
    every = None
    if turned or any(part.rotations is not None for part in more):
        still = np.broadcast_to(_NO_TURN, (len(field), 3, 3))
        every = places.put(still, rotations, *(_rotations_of(part) for part in more))
    return DeformedSplats(
        places.put(base.means, means, *(part.means for part in more)),
        places.put(base.covariances, covariances, *(part.covariances for part in more)),
        places.put(base.opacities, own, *(part.opacities for part in more)),
        places.put(base.sh, moved.sh(field.sh), *(part.sh for part in more)),
        every,
        field.antialiased,
        tangents,
    )


def _rotations_of(splats: DeformedSplats) -> Float32:
    return np.broadcast_to(_NO_TURN, (len(splats), 3, 3)) if splats.rotations is None else splats.rotations


def _carried(
    field: SplatField, moved: MovedSplats, preserve_opacity: bool
) -> tuple[Float32, Float32, Float32 | None, Float32]:
    """(means [M,3], covariances [M,6], opacities [M], or None for their own, R [M,3,3]) of the moved
    splats."""
    from cagefield.rendering.splats.kernels.deformation import deform

    count = len(moved.source)
    covariances, rotations = np.empty((count, 6), np.float32), np.empty((count, 3, 3), np.float32)
    growth = np.empty(count)
    deform(moved.source, moved.jacobian, field.quaternions, field.log_scales, covariances, rotations, growth)
    own = None
    if not preserve_opacity or moved.grade is not None:
        before = moved.opacities(field.opacities)
        own = (before if preserve_opacity else 1.0 - (1.0 - before) ** growth).astype(np.float32)
    return moved.points.astype(np.float32), covariances, own, rotations


@dataclass(frozen=True, eq=False)
class ChangedSplats:
    """Difference between an edited and an unedited field of N splats: M new splats, and the hidden ones.

    N counts those that edits paste (`SplatSet.with_pastes`), which are hidden where they are.

    Attributes:
        hidden: [N], True where the field's splat is not shown as it is.
        sources: [M] int64, splats of the field that have the harmonics of the new ones.
        splats: the M new ones; their `sh` are those of their sources, times `gains`.
        gains: [M,3], factors of their sources' red, green and blue; None where all are 1.
        colors: [M,3,3], matrices of their sources' colors after the gains; None where no edit grades.
        rows: [M] int64, their originals: splats of the field, and, from N on, children of the split.
        jacobian: [M,3,3], d(deformed)/d(canonical) at their means.
    """

    hidden: Mask
    sources: NDArray[np.int64]
    splats: DeformedSplats
    rows: NDArray[np.int64]
    jacobian: Array
    gains: Float32 | None = None
    colors: Float32 | None = None

    def of_whole(self, removed: Mask) -> ChangedSplats:
        """The difference to a whole field, whose splats True in `removed` [N] were left out: hidden ones."""
        kept = np.flatnonzero(~removed)
        hidden = removed.copy()
        hidden[kept] = self.hidden
        # Rows of children follow those of the field.
        on_field = self.rows < len(kept)
        rows = np.where(on_field, kept[np.minimum(self.rows, len(kept) - 1)], self.rows + removed.sum())
        return replace(self, hidden=hidden, sources=kept[self.sources], rows=rows)


def changed_splats(
    splats: SplatField | SplatSet,
    edits: EditMap,
    *,
    preserve_opacity: bool = True,
    coarse: bool = False,
    split: Split | None = None,
    proceed: Callable[[], None] | None = None,
) -> ChangedSplats:
    """How `deformed_splats`, with the same arguments, differ from the field's own."""
    splats = SplatSet.from_field(splats).with_pastes(edits)
    moved = moved_splats(splats, edits, coarse=coarse, proceed=proceed)
    if split is not None:
        moved = moved.without(split.parents)
    field = splats.field
    means, covariances, own, rotations = _carried(field, moved, preserve_opacity)
    opacities = field.opacities[moved.source] if own is None else own
    sources, made_of, jacobian, gains = moved.source, moved.source, moved.jacobian, moved.gains
    grade = moved.grade
    if split is not None:
        others = moved_splats(split.children, edits, coarse=coarse, proceed=proceed)
        more = deformed_where(split.children.field, others, preserve_opacity)
        resting = np.flatnonzero(~others.left)
        rows = np.concatenate([resting, others.source])
        in_order = np.argsort(rows) if others.is_whole else np.arange(len(rows))
        rows = rows[in_order]
        turns = _rotations_of(more)
        means, covariances = (
            np.concatenate([means, more.means]),
            np.concatenate([covariances, more.covariances]),
        )
        opacities, rotations = np.concatenate([opacities, more.opacities]), np.concatenate([rotations, turns])
        sources = np.concatenate([sources, split.sources[rows]])
        made_of = np.concatenate([made_of, len(field) + rows])
        of_children = np.tile(np.eye(3), (len(more), 1, 1))
        of_children[Places(others).moved] = others.jacobian
        jacobian = np.concatenate([jacobian, of_children])
        if gains is not None or others.gains is not None:
            own_gains = np.concatenate([np.ones((len(resting), 3)), _gains_of(others)])[in_order]
            gains = np.concatenate([_gains_of(moved), own_gains])
        if grade is not None or others.grade is not None:
            resting_grade = SampleGrade.neutral(len(resting))
            own_grade = SampleGrade.concatenate([resting_grade, _grade_of(others)]).take(in_order)
            grade = SampleGrade.concatenate([_grade_of(moved), own_grade])
    sh = changed_sh(field.sh[sources], gains, grade)
    new = DeformedSplats(means, covariances, opacities, sh, rotations, field.antialiased)
    told = None if gains is None else gains.astype(np.float32)
    colors = None if grade is None else grade.colors.astype(np.float32)
    return ChangedSplats(moved.left, sources, new, made_of, jacobian, told, colors)


def _gains_of(moved: MovedSplats) -> Array:
    return np.ones((len(moved.source), 3)) if moved.gains is None else moved.gains


def _grade_of(moved: MovedSplats) -> SampleGrade:
    return moved.grade or SampleGrade.neutral(len(moved.source))


_NO_TURN = np.eye(3, dtype=np.float32)

_TURNED = 1e-6
"""Rotations by less than this, radians, are none."""


class Places:
    """Where moved splats are among those that are drawn: in their own rows, where each is shown once."""

    def __init__(self, moved: MovedSplats) -> None:
        self.rows: NDArray[np.int64] = np.arange(len(moved.left))
        """Numbers of the splats that are drawn, in their order."""
        self.moved = moved.source
        """Rows of those that moved."""
        self._are_own = moved.is_whole
        if not self._are_own:
            kept = np.flatnonzero(~moved.left)
            self.rows = np.concatenate([kept, moved.source])
            self.moved = np.arange(len(kept), len(self.rows))

    def put(self, values: Float32, moved: Float32 | None, *more: Float32 | None) -> Float32:
        """The values of the splats that are drawn, of the field's [N,...].

        Values of moved splats are `moved` [M,...], or their own where it is None; `more` come after them.
        """
        from cagefield.rendering.splats.kernels.deformation import gather, scatter

        parts = [part for part in more if part is not None]
        if self._are_own and moved is None and not parts:
            return values
        count = len(self.rows)
        width = int(np.prod(values.shape[1:]))
        out = np.empty((count + sum(map(len, parts)), *values.shape[1:]), np.float32)
        if self._are_own:
            out[:count] = values
        else:
            gather(values.reshape(len(values), width), self.rows, out[:count].reshape(count, width))
        if moved is not None:
            scatter(moved.reshape(len(moved), width), self.moved, out[:count].reshape(count, width))
        for part in parts:
            out[count : count + len(part)] = part
            count += len(part)
        return _frozen(out)


def _frozen(values: Float32) -> Float32:
    values.setflags(write=False)
    return values


def covariances_of(quaternions: Float32, log_scales: Float32) -> Float32:
    """R diag(s^2) R^T as [N,6] float32 (xx, xy, xz, yy, yz, zz)."""
    out = np.empty((len(quaternions), 6), np.float32)
    for start in range(0, len(out), _BLOCK):
        rows = slice(start, start + _BLOCK)
        scales = np.exp(log_scales[rows].astype(np.float64))
        axes = rotation_matrices(quaternions[rows].astype(np.float64)) * scales[:, None, :]
        out[rows] = (axes @ axes.transpose(0, 2, 1)).reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]]
    return out


def _tangents_of(field: SplatField) -> Float32:
    """The tangents [N,6] of a field's discs."""
    axes = rotation_matrices(field.quaternions.astype(np.float64))[:, :, :2]
    scaled = axes * np.exp(field.log_scales[:, None, :2].astype(np.float64))
    return scaled.transpose(0, 2, 1).reshape(-1, 6).astype(np.float32)


_BLOCK = 1 << 16
"""Splats whose covariances are worked out at a time, in float64."""
