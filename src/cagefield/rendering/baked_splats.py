"""Edited splats as a field of their own, as a file of splats can hold them.

Notation: J = d(deformed)/d(canonical) at a splat's mean, R diag(s) its own axes and scales. Its covariance
becomes J C J^T = A A^T with A = J R diag(s) = U S V^T, so U are its new axes and S its new scales. Colour
turns by P, the rotation of J's polar decomposition J = P (P^T J): its harmonics k' give along d what k gave
along P^T d. For enough directions D, Y(D) k' = Y(D P) k has one solution k', which is exact.

Which splats move, which are copied and which are hidden: `moved_splats`; opacity: `deformed_splats`.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditStack
from cagefield.fields.splat import SplatField
from cagefield.quaternions import rotation_matrices
from cagefield.rendering.moved_splats import moved_splats
from cagefield.sh import sh_basis
from cagefield.typing import Array, Float32

BLOCK = 1 << 16
"""Splats whose harmonics are turned at a time."""

DIRECTIONS = 32
"""Directions that harmonics are compared along: twice their number for degree 3."""


def baked_splats(field: SplatField, edits: EditStack, *, preserve_opacity: bool = True) -> SplatField:
    """The splats that edits make of a field; those that no edit reaches come first, as they were.

    Its box is the field's, grown by where edits take something.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    if not edits.active:
        return field
    moved = moved_splats(field, edits)
    kept = ~moved.left
    own = field.take(moved.source)
    axes = (
        rotation_matrices(own.quaternions.astype(np.float64))
        * np.exp(own.log_scales.astype(np.float64))[:, None]
    )
    turned, scales, _ = np.linalg.svd(moved.jacobian @ axes)
    turned[np.linalg.det(turned) < 0.0, :, 2] *= -1.0
    opacities = own.opacities.astype(np.float64)
    if not preserve_opacity:
        growth = np.cbrt(np.abs(np.linalg.det(moved.jacobian)))
        opacities = 1.0 - (1.0 - opacities) ** growth
    boxes = np.concatenate([field.bounds[None], *(edit.boxes for edit in edits.active)])
    return dataclasses.replace(
        field,
        means=np.concatenate([field.means[kept], moved.points.astype(np.float32)]),
        log_scales=np.concatenate(
            [field.log_scales[kept], np.log(np.maximum(scales, 1e-30))], dtype=np.float32
        ),
        quaternions=np.concatenate([field.quaternions[kept], quaternions_of(turned)], dtype=np.float32),
        opacities=np.concatenate([field.opacities[kept], opacities], dtype=np.float32),
        sh=np.concatenate([field.sh[kept], turned_harmonics(own.sh, polar_rotations(moved.jacobian))]),
        bounds=np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]),
    )


def polar_rotations(jacobian: Array) -> Array:
    """P [N,3,3] of J = P S with S symmetric and positive."""
    u, _, vt = np.linalg.svd(jacobian)
    return np.asarray(u @ vt)


def turned_harmonics(sh: Float32, rotations: Array) -> Float32:
    """Coefficients [N,K,3] that show along d what `sh` [N,K,3] shows along P^T d, P = rotations [N,3,3]."""
    degree = int(np.sqrt(sh.shape[1])) - 1
    out = np.array(sh, np.float32)
    if degree == 0:
        return out
    directions = np.random.default_rng(0).normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    back = np.linalg.pinv(sh_basis(directions, degree))
    for start in range(0, len(sh), BLOCK):
        rows = slice(start, start + BLOCK)
        seen = np.einsum("kj,nji->nki", directions, rotations[rows])
        basis = sh_basis(seen.reshape(-1, 3), degree).reshape(*seen.shape[:2], -1)
        out[rows] = np.einsum("ik,nkj,njc->nic", back, basis, sh[rows].astype(np.float64), optimize=True)
    return out


def quaternions_of(rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit quaternions [N,4] (w, x, y, z) of rotations [N,3,3]."""
    from scipy.spatial.transform import Rotation

    if not len(rotations):
        return np.zeros((0, 4))
    return np.roll(Rotation.from_matrix(rotations).as_quat(), 1, axis=1)
