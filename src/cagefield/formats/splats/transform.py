"""Affine transformation x' = M x + t of splats.

Notation: R diag(s) are a splat's axes and scales, C = R diag(s^2) R^T its covariance. C' = M C M^T = A A^T
with A = M R diag(s) = U S V^T: the new axes are U, the new scales S. Harmonics rotate by P, the rotation or
rotoreflection of the polar decomposition M = P (P^T M), as for edited splats: exact where M is a
similarity. Under P = -Q, Q a rotation, harmonics of odd degree change their sign.

Source: Zwicker et al., "EWA Splatting" (2002), for C'; `sh_rotation` for the harmonics.
"""

from __future__ import annotations

import numpy as np

from cagefield.fields.sh_rotation import rotate_sh
from cagefield.formats.splats.splat_table import SplatBatch
from cagefield.geometry.quaternions import quaternions_from_matrices, rotation_matrices
from cagefield.typing import AnyArray, Array


def transform_splats(batch: SplatBatch, matrix: Array) -> SplatBatch:
    """Splats under the affine map of a matrix [4,4]; means in float64.

    Quaternions may have any length; splats with non-finite values stay invalid.
    """
    M, shift = matrix[:3, :3], matrix[:3, 3]
    if np.array_equal(M, np.eye(3)):
        return batch if not shift.any() else _with_means(batch, batch.means.astype(np.float64) + shift)
    u, stretch, vt = np.linalg.svd(M)
    P = u @ vt
    means = batch.means.astype(np.float64) @ M.T + shift
    axes, is_number = _axes(batch.quaternions)
    log_scales = batch.log_scales.astype(np.float64)
    if np.allclose(stretch, stretch[0], rtol=1e-6, atol=0.0):
        turned = np.sign(np.linalg.det(P)) * P @ axes
        with np.errstate(divide="ignore"):
            log_scales = log_scales + np.log(stretch.mean())
    else:
        is_number &= np.isfinite(np.exp(np.minimum(log_scales, 300.0))).all(axis=1)
        scales = np.exp(np.minimum(np.where(is_number[:, None], log_scales, 0.0), 300.0))
        turned, lengths, _ = np.linalg.svd((M @ axes) * scales[:, None])
        turned[np.linalg.det(turned) < 0.0, :, 2] *= -1.0
        with np.errstate(divide="ignore"):
            log_scales = np.where(is_number[:, None], np.log(lengths), np.nan)
    quaternions = np.where(is_number[:, None], quaternions_from_matrices(turned), np.nan)
    return SplatBatch(means, log_scales, quaternions, batch.opacities, _rotate_harmonics(batch.sh, P))


def _with_means(batch: SplatBatch, means: AnyArray) -> SplatBatch:
    return SplatBatch(means, batch.log_scales, batch.quaternions, batch.opacities, batch.sh)


def _axes(quaternions: AnyArray) -> tuple[Array, AnyArray]:
    """(rotations [n,3,3], mask [n] of finite quaternions); the identity for length 0."""
    values = quaternions.astype(np.float64)
    is_number = np.asarray(np.isfinite(values).all(axis=1))
    values = np.where(is_number[:, None], values, 0.0)
    length = np.linalg.norm(values, axis=1, keepdims=True)
    unit = np.where(length > 0.0, values / np.maximum(length, 1e-300), (1.0, 0.0, 0.0, 0.0))
    return np.asarray(rotation_matrices(unit), np.float64), is_number


def _rotate_harmonics(sh: AnyArray, P: Array) -> AnyArray:
    """Harmonics [n,K,3] of functions f(P^T d)."""
    degree = int(np.sqrt(sh.shape[1])) - 1
    if not degree:
        return sh
    is_mirrored = np.linalg.det(P) < 0.0
    turned = rotate_sh(sh, -P if is_mirrored else P)
    if is_mirrored:
        odd = np.concatenate([np.full(2 * l + 1, 1.0 - 2.0 * (l % 2)) for l in range(degree + 1)])  # noqa: E741
        turned = turned * odd[None, :, None].astype(np.float32)
    return turned
