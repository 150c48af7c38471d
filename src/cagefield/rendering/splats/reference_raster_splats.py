"""Splats of a field deformed by edits, step by step in float64: the oracle of `deformed_splats`."""

from __future__ import annotations

import numpy as np

from cagefield.edits import Copy, Edit, EditMap, EditStack, Paste, PreparedStack
from cagefield.edits.grade import grade_sh
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.rendering.splats.splat_provenance import SplatSet


def deformed_splats_reference(
    splats: SplatField | SplatSet, edits: EditMap, *, preserve_opacity: bool = True
) -> DeformedSplats:
    """The splats that edits make of a field, in any order: those of all that is shown of each splat's mean.

    Each edit alone is `EditStack.to_deformed` of a stack of one; a copy leaves the original besides.
    """
    splats = SplatSet.from_field(splats).with_pastes(edits)
    field, source = splats.field, np.flatnonzero(~splats.is_pasted)
    p, J = field.means[source].astype(np.float64), np.tile(np.eye(3), (len(source), 1, 1))
    colors, density = np.tile(np.eye(3), (len(source), 1, 1)), np.ones(len(source))
    for step in edits.steps:
        edit = step.edit
        mapped = PreparedStack([step]).to_deformed(p)
        shown = ~mapped.hidden
        weights = edit.grade_weights(p, edit.inner.contains(p) & (not isinstance(edit, Paste)))
        graded = edit.grading.matrices(weights) @ colors
        thinned = edit.grading.density_factors(weights) * density
        after = (source, mapped.points, mapped.jacobian @ J, graded, thinned)
        parts = [tuple(values[shown] for values in after)]
        if isinstance(edit, Paste):
            rows = splats.pasted_rows(step)
            there = EditStack([Edit.move(edit.inner, operations=edit.operations)])
            moved = there.to_deformed(field.means[rows])
            inside = edit.inner.contains(field.means[rows].astype(np.float64))
            ones = np.ones(int(inside.sum()))
            grade = edit.grading.matrices(ones), edit.grading.density_factors(ones)
            parts.append((rows[inside], moved.points[inside], moved.jacobian[inside], *grade))
        elif isinstance(edit, Copy):
            original = edit.inner.contains(p) & ~edit.deformed.contains(p)
            parts.append(tuple(values[original] for values in (source, p, J, colors, density)))
        source, p, J, colors, density = (np.concatenate([part[n] for part in parts]) for n in range(5))
    axes = rotation_matrices(field.quaternions.astype(np.float64))
    axes = J @ (axes * np.exp(field.log_scales.astype(np.float64))[:, None, :])[source]
    C = axes @ axes.transpose(0, 2, 1)
    U, _, Vt = np.linalg.svd(J)
    opacities = 1.0 - (1.0 - field.opacities[source].astype(np.float64)) ** density
    if not preserve_opacity:
        opacities = 1.0 - (1.0 - opacities) ** np.cbrt(np.abs(np.linalg.det(J)))
    return DeformedSplats(
        p.astype(np.float32),
        C.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]].astype(np.float32),
        opacities.astype(np.float32),
        grade_sh(field.sh[source], colors) if edits.is_graded else field.sh[source],
        (U @ Vt).astype(np.float32),
        field.antialiased,
        axes[:, :, :2].transpose(0, 2, 1).reshape(-1, 6).astype(np.float32) if field.discs else None,
    )
