"""Samples after a map between deformed and canonical space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.edits.grade import Grade
from cagefield.typing import Array, Mask


@dataclass(frozen=True)
class SampleGrade:
    """Grade of samples by the edits of a stack: colors [N,3,3], matrices of rgb; density [N], factors."""

    colors: Array
    density: Array

    @classmethod
    def neutral(cls, count: int) -> SampleGrade:
        """Grade of samples that nothing changes."""
        return cls(np.tile(np.eye(3), (count, 1, 1)), np.ones(count))

    @classmethod
    def concatenate(cls, grades: Sequence[SampleGrade]) -> SampleGrade:
        """Grade of the samples of several, one after the other."""
        colors = np.concatenate([grade.colors for grade in grades])
        return cls(colors, np.concatenate([grade.density for grade in grades]))

    def take(self, rows: NDArray[Any] | slice) -> SampleGrade:
        """Grade of some samples."""
        return SampleGrade(self.colors[rows], self.density[rows])

    def then(self, grade: Grade, weights: Array) -> SampleGrade:
        """These grades followed by a later edit's, at its weights [N]."""
        density = self.density * grade.density_factors(weights)
        return SampleGrade(grade.matrices(weights) @ self.colors, density)


@dataclass(frozen=True)
class CanonicalSamples:
    """Samples of deformed space, taken to canonical space.

    points [N,3]; viewdirs [N,3] unit, d^c = J d / |J d|, and stretch [N], |J d| for unit d (both None where
    no view directions were given); jacobian [N,3,3], d(canonical)/d(deformed); layer [N], the field read at
    the point: 0 the canonical field, n the n-th of `EditStack.layers`, -1 nothing; grade, None where no edit
    grades colors.
    """

    points: Array
    viewdirs: Array | None
    stretch: Array | None
    jacobian: Array
    layer: NDArray[np.int64]
    grade: SampleGrade | None = None

    @property
    def emptied(self) -> Mask:
        """[N], True where the field must be read as empty."""
        return np.asarray(self.layer < 0)


@dataclass(frozen=True)
class DeformedPoints:
    """Canonical points, taken to deformed space.

    points [N,3]; jacobian [N,3,3], d(deformed)/d(canonical); hidden [N], True where nothing in the deformed
    scene shows the canonical point (deleted, or covered by moved content).
    """

    points: Array
    jacobian: Array
    hidden: Mask


@dataclass(frozen=True)
class KernelSamples:
    """`CanonicalSamples` of a kernel, in float32 and without the Jacobian."""

    points: NDArray[np.float32]
    viewdirs: NDArray[np.float32]
    stretch: NDArray[np.float32]
    layer: NDArray[np.int64]
    grade: SampleGrade | None = None
