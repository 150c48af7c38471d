"""Edited splats as a field of their own, as a file of splats can hold them.

Notation: J = d(deformed)/d(canonical) at a splat's mean, R diag(s) its own axes and scales. Its covariance
becomes J C J^T = A A^T with A = J R diag(s) = U S V^T, so U are its new axes and S its new scales. Color
turns by P, the rotation of J's polar decomposition J = P (P^T J): see `sh_rotation`.

Which splats move, which are copied and which are hidden: `moved_splats`; opacity: `deformed_splats`; those
that the map bends over, or that a cut goes through, are split first: `splat_splitting`.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap
from cagefield.fields.sh_rotation import rotate_sh_each
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.quaternions import quaternions_from_matrices, rotation_matrices
from cagefield.rendering.splats.splat_motion import MovedSplats, moved_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splitting import split_of
from cagefield.typing import Array, Float32


def baked_splats(
    splats: SplatField | SplatSet, edits: EditMap, *, preserve_opacity: bool = True, split: bool = True
) -> SplatField:
    """The splats that edits make of a field; those that no edit reaches come first, as they were.

    Its box is the field's, grown by where edits take something.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    return baked_set(splats, edits, preserve_opacity=preserve_opacity, split=split).field


def baked_set(
    splats: SplatField | SplatSet, edits: EditMap, *, preserve_opacity: bool = True, split: bool = True
) -> SplatSet:
    """`baked_splats` with their provenance: `origins` says which paste each is from, -1 for the scene's own.

    Its splats are in deformed space, pasted ones too. Raises as `baked_splats`.
    """
    splats = SplatSet.from_field(splats).with_pastes(edits)
    field = splats.field
    if not edits.steps:
        return splats
    moved = moved_splats(splats, edits)
    parts, origins = [], []
    found = split_of(splats, edits) if split else None
    if found is not None:
        moved = moved.without(found.parents)
        children = moved_splats(found.children, edits)
        parts.append(_baked(found.children.field, children, preserve_opacity))
        origins.append(_origins(found.children, children))
    parts.insert(0, _baked(field, moved, preserve_opacity))
    origins.insert(0, _origins(splats, moved))
    boxes = np.concatenate([field.bounds[None], *(step.boxes for step in edits.steps)])
    means, log_scales, quaternions, opacities, sh = (
        np.concatenate([part[n] for part in parts]) for n in range(5)
    )
    baked = dataclasses.replace(
        field,
        means=means,
        log_scales=log_scales,
        quaternions=quaternions,
        opacities=opacities,
        sh=sh,
        bounds=np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]),
    )
    return SplatSet(baked, baked, np.concatenate(origins), splats.parts)


def _origins(splats: SplatSet, moved: MovedSplats) -> NDArray[np.int32]:
    """Origins of the rows of `_baked`."""
    return np.concatenate([splats.origins[~moved.left], splats.origins[moved.source]])


def where_they_are(field: SplatField, moved: MovedSplats, preserve_opacity: bool = True) -> SplatField:
    """A field's splats where they are: those in their own places first, then the rows of `moved`."""
    means, log_scales, quaternions, opacities, sh = _baked(field, moved, preserve_opacity)
    return dataclasses.replace(
        field, means=means, log_scales=log_scales, quaternions=quaternions, opacities=opacities, sh=sh
    )


def _baked(field: SplatField, moved: MovedSplats, preserve_opacity: bool) -> tuple[Float32, ...]:
    """Means, log scales, quaternions, opacities and harmonics of a field's splats where they are."""
    kept, source = ~moved.left, moved.source
    axes = rotation_matrices(field.quaternions[source].astype(np.float64))
    axes = axes * np.exp(field.log_scales[source].astype(np.float64))[:, None]
    turned, scales, _ = np.linalg.svd(moved.jacobian @ axes)
    turned[np.linalg.det(turned) < 0.0, :, 2] *= -1.0
    sh = moved.sh(field.sh)
    opacities = moved.opacities(field.opacities)
    if not preserve_opacity:
        growth = np.cbrt(np.abs(np.linalg.det(moved.jacobian)))
        opacities = 1.0 - (1.0 - opacities) ** growth
    elsewhere = (
        moved.points,
        np.log(np.maximum(scales, 1e-30)),
        quaternions_from_matrices(turned),
        opacities,
        rotate_sh_each(field.sh[source] if sh is None else sh, _polar_rotations(moved.jacobian)),
    )
    own = (field.means, field.log_scales, field.quaternions, field.opacities, field.sh)
    return tuple(
        np.concatenate([values[kept], there], dtype=np.float32)
        for values, there in zip(own, elsewhere, strict=True)
    )


def _polar_rotations(jacobian: Array) -> Array:
    """P [N,3,3] of J = P S with S symmetric and positive."""
    u, _, vt = np.linalg.svd(jacobian)
    return np.asarray(u @ vt)
