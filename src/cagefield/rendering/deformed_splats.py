"""Splats in deformed space, as the rasteriser draws them: a SplatField's, or what edits make of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditStack
from cagefield.fields.splat import SplatField

Float32 = NDArray[np.float32]


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
        """The splats of a field without edits."""
        return cls(
            field.means,
            covariances_of(field.quaternions, field.log_scales),
            field.opacities,
            field.sh,
            None,
            field.antialiased,
        )


def rotation_matrices(quaternions: NDArray[np.floating]) -> NDArray[np.floating]:
    """Rotations [N,3,3] of unit quaternions [N,4] (w, x, y, z)."""
    w, x, y, z = quaternions.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def covariances_of(quaternions: Float32, log_scales: Float32) -> Float32:
    """R diag(s^2) R^T as [N,6] float32 (xx, xy, xz, yy, yz, zz)."""
    axes = (
        rotation_matrices(quaternions.astype(np.float64)) * np.exp(log_scales.astype(np.float64))[:, None, :]
    )
    full = axes @ axes.transpose(0, 2, 1)
    return np.ascontiguousarray(full.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]], np.float32)


def deformed_splats(
    field: SplatField,
    edits: EditStack,
    *,
    coarse: bool = False,
    proceed: Callable[[], None] | None = None,
) -> DeformedSplats:
    """The field's splats under an edit stack: mean' = to_deformed(mean), covariance' = J C J^T."""
    plain = DeformedSplats.of_field(field)
    if not edits.active:
        return plain
    moved = edits.to_deformed(field.means)
    kept = ~moved.hidden
    J = moved.jacobian[kept]
    full = plain.covariances[kept][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    covariances = (J @ full @ J.transpose(0, 2, 1)).reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]]
    U, _, V = np.linalg.svd(J)
    return DeformedSplats(
        moved.points[kept].astype(np.float32),
        np.ascontiguousarray(covariances, np.float32),
        field.opacities[kept],
        field.sh[kept],
        np.ascontiguousarray(U @ V, np.float32),
        field.antialiased,
    )
