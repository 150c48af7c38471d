"""Splats in deformed space, as the rasteriser draws them: a SplatField's, or what edits make of them.

Notation: J = d(deformed)/d(canonical) at a splat's mean, J = R S its polar decomposition, C its covariance.
An edit takes the mean along, C to J C J^T, and colour is evaluated at R^T d.

Opacity. A splat lets the ray through its mean lose the share o, whichever way the ray goes. With
`preserve_opacity` a stretched density is multiplied by what the ray through it was stretched, so that ray
still loses o: a splat keeps its opacity, exactly. Without (the paper), the ray's optical depth grows as its
way through the splat does. That depends on its direction, and a splat has one opacity: it gets the mean of
it, o' = 1 - (1 - o)^(|det J|^(1/3)), which is exact where J scales all directions alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditStack
from cagefield.fields.splat import SplatField
from cagefield.quaternions import rotation_matrices
from cagefield.rendering.moved_splats import MovedSplats, moved_splats
from cagefield.typing import Float32


@dataclass(frozen=True, eq=False)
class DeformedSplats:
    """N splats in deformed space (world units).

    Attributes:
        means: [N,3] float32.
        covariances: [N,6] float32: xx, xy, xz, yy, yz, zz.
        opacities: [N] float32 in [0, 1].
        sh: [N, (degree+1)^2, 3] float32, as the field has them: evaluated along the canonical direction.
        rotations: [N,3,3] float32, or None where no splat was turned: R of J = R S, J = d(deformed) /
            d(canonical) at the mean. The colour of splat n seen along d is that of its harmonics at R^T d.
        antialiased: as SplatField.
    """

    means: Float32
    covariances: Float32
    opacities: Float32
    sh: Float32
    rotations: Float32 | None = None
    antialiased: bool = False

    def __len__(self) -> int:
        return len(self.means)

    @classmethod
    def of_field(cls, field: SplatField) -> DeformedSplats:
        """The splats of a field without edits, made once while it lives."""
        found = _of_fields.get(field)
        if found is None:
            covariances = _frozen(covariances_of(field.quaternions, field.log_scales))
            found = cls(field.means, covariances, field.opacities, field.sh, None, field.antialiased)
            _of_fields[field] = found
        return found


_of_fields: WeakKeyDictionary[SplatField, DeformedSplats] = WeakKeyDictionary()


def deformed_splats(
    field: SplatField,
    edits: EditStack,
    *,
    preserve_opacity: bool = True,
    coarse: bool = False,
    proceed: Callable[[], None] | None = None,
) -> DeformedSplats:
    """The splats that edits make of a field, those that are hidden left out; the field's own where none does.

    A splat goes with its mean as a whole, see `moved_splats`; those that no edit reaches are as they were,
    bit for bit. Maps are exact, whatever lattices the edits have, and kept between calls for stacks that
    begin alike. `coarse` integrates a flow shell with long steps, for pictures while something moves.
    `proceed` is called now and then, and gives the work up by raising.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    base = DeformedSplats.of_field(field)
    moved = moved_splats(field, edits, coarse=coarse, proceed=proceed)
    if moved.is_at_rest:
        return base
    from cagefield.rendering.kernels.splat_deforming import deform

    count = len(moved.source)
    covariances, rotations = np.empty((count, 6), np.float32), np.empty((count, 3, 3), np.float32)
    growth = np.empty(count)
    deform(moved.source, moved.jacobian, field.quaternions, field.log_scales, covariances, rotations, growth)
    means = moved.points.astype(np.float32)
    places = Places(moved)
    opacities = places.of(field.opacities)
    if not preserve_opacity:
        own = field.opacities[moved.source].astype(np.float64)
        opacities = places.put(opacities, (1.0 - (1.0 - own) ** growth).astype(np.float32))
    turned = count > 0 and float(np.abs(rotations - np.eye(3, dtype=np.float32)).max()) > _TURNED
    every = None
    if turned:
        every = places.put(np.tile(np.eye(3, dtype=np.float32), (places.total, 1, 1)), rotations)
    return DeformedSplats(
        places.put(places.of(base.means), means),
        places.put(places.of(base.covariances), covariances),
        opacities,
        places.of(base.sh),
        every,
        field.antialiased,
    )


_TURNED = 1e-6
"""Rotations by less than this, radians, are none."""


class Places:
    """Where moved splats are among those that are drawn: in their own rows, where each is shown once."""

    def __init__(self, moved: MovedSplats) -> None:
        self._rows: NDArray[np.int64] | None = None
        self.moved = moved.source
        """Rows of those that moved."""
        self.total = len(moved.left)
        """Splats that are drawn."""
        if not moved.is_whole:
            kept = np.flatnonzero(~moved.left)
            self._rows = np.concatenate([kept, moved.source])
            self.moved = np.arange(len(kept), len(self._rows))
            self.total = len(self._rows)

    def of(self, values: Float32) -> Float32:
        """The values of the splats that are drawn, of the field's [N,...]."""
        return values if self._rows is None else _frozen(values[self._rows])

    def put(self, values: Float32, moved: Float32) -> Float32:
        """Values of the splats that are drawn, with those of moved ones [M,...] in their places."""
        values = values.copy()
        values[self.moved] = moved
        return _frozen(values)


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


_BLOCK = 1 << 16
"""Splats whose covariances are worked out at a time, in float64."""
