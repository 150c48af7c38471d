"""Edited splats as a field of their own, as a file of splats can hold them.

Notation: J = d(deformed)/d(canonical) at a splat's mean, R diag(s) its own axes and scales. Its covariance
becomes J C J^T = A A^T with A = J R diag(s) = U S V^T, so U are its new axes and S its new scales. Colour
turns by P, the rotation of J's polar decomposition J = P (P^T J): see `sh_rotation`.

Which splats move, which are copied and which are hidden: `moved_splats`; opacity: `deformed_splats`; those
that the map bends over, or that a cut goes through, are split first: `splat_splitting`.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from cagefield.edits import EditStack
from cagefield.fields.splat import SplatField
from cagefield.quaternions import quaternions_of, rotation_matrices
from cagefield.rendering.moved_splats import moved_splats
from cagefield.rendering.splat_splitting import split_for_edits
from cagefield.sh_rotation import rotated_sh
from cagefield.typing import Array


def baked_splats(
    field: SplatField, edits: EditStack, *, preserve_opacity: bool = True, split: bool = True
) -> SplatField:
    """The splats that edits make of a field; those that no edit reaches come first, as they were.

    Its box is the field's, grown by where edits take something.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    if not edits.active:
        return field
    if split:
        field = split_for_edits(field, edits)
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
        sh=np.concatenate([field.sh[kept], rotated_sh(own.sh, _polar_rotations(moved.jacobian))]),
        bounds=np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]),
    )


def _polar_rotations(jacobian: Array) -> Array:
    """P [N,3,3] of J = P S with S symmetric and positive."""
    u, _, vt = np.linalg.svd(jacobian)
    return np.asarray(u @ vt)
