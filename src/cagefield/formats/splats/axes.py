"""Coordinate axes of splat files, and conversions of splats between them.

Axes are named by the directions of x, y and z, seen from a camera that looks at the scene: right or left, up
or down, front (towards the camera) or back; "rdf" in 3DGS' PLY, "rub" in SPZ and glTF. A conversion flips the
sign of some coordinates; rotations follow, and harmonics that are odd in these coordinates change sign.

Source: nianticlabs/spz, src/cc/splat-types.h (CoordinateConverter).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from cagefield.fields import sh as spherical_harmonics
from cagefield.fields.splat_field import Offset
from cagefield.formats.splats.splat_table import SplatBatch, SplatTable
from cagefield.typing import Array

Axes = Literal["rdf", "rub", "luf", "ruf", "ldb", "rdb", "ldf", "lub"]
AXES: tuple[str, ...] = get_args(Axes)
PLY_AXES: Axes = "rdf"
"""Axes of 3DGS' PLY and of splat tables."""


def axis_signs(source: str, target: str) -> Array:
    """Factors [3] of x, y and z, 1 or -1, from source to target axes."""
    return np.array([1.0 if a == b else -1.0 for a, b in zip(source, target, strict=True)])


def convert_axes(batch: SplatBatch, source: str, target: str) -> SplatBatch:
    """Splats in target axes; mirrored where the two have different handedness."""
    flip = axis_signs(source, target)
    if (flip > 0).all():
        return batch
    # R' = F R F: a rotation by the same angle about the axis F r, mirrored once more where det F < 0.
    turn = np.concatenate([[1.0], flip * np.prod(flip)])
    return SplatBatch(
        batch.means * flip.astype(np.float32),
        batch.log_scales,
        batch.quaternions * turn.astype(np.float32),
        batch.opacities,
        batch.sh * _harmonic_signs(batch.sh.shape[1], flip)[None, :, None],
    )


def _harmonic_signs(count: int, flip: Array) -> Array:
    """Factors [K] of the harmonics: Y(F d) = factor Y(d)."""
    degree = int(np.sqrt(count)) - 1
    d = np.array([[0.48, 0.6, 0.64]])
    return np.sign(
        spherical_harmonics.sh_basis(d * flip, degree)[0] * spherical_harmonics.sh_basis(d, degree)[0]
    )


@dataclass(frozen=True, eq=False)
class ConvertedTable:
    """Table in a format's axes, with harmonics of the format's degree at most."""

    table: SplatTable
    axes: str
    sh_degree: int

    @property
    def count(self) -> int:
        return self.table.count

    @property
    def antialiased(self) -> bool:
        return self.table.antialiased

    @property
    def discs(self) -> bool:
        return self.table.discs

    @property
    def offset(self) -> Offset:
        x, y, z = (axis_signs(PLY_AXES, self.axes) * np.array(self.table.offset) + 0.0).tolist()
        return x, y, z

    def batches(self) -> Iterator[SplatBatch]:
        return (self._of(batch) for batch in self.table.batches())

    def sorted_batches(self) -> Iterator[SplatBatch]:
        return (self._of(batch) for batch in self.table.sorted_batches())

    def _of(self, batch: SplatBatch) -> SplatBatch:
        coefficients = replace(batch, sh=batch.sh[:, : (self.sh_degree + 1) ** 2])
        return convert_axes(coefficients, PLY_AXES, self.axes)
