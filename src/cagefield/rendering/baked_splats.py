"""Edited splats as ordinary ones: a field in which nothing is left of its edits."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from cagefield.edits import EditStack
from cagefield.fields.splat import SplatField
from cagefield.quaternions import quaternions_of
from cagefield.rendering.deformed_splats import Places, deformed_splats
from cagefield.rendering.moved_splats import moved_splats
from cagefield.rendering.splat_splitting import split_for_edits
from cagefield.sh_rotation import rotated_sh


def baked_splats(
    field: SplatField,
    edits: EditStack,
    *,
    preserve_opacity: bool = True,
    split: bool = True,
    proceed: Callable[[], None] | None = None,
) -> SplatField:
    """The splats that edits make of a field, in deformed space; the field itself without edits.

    Covariances J C J^T become rotations and scales, harmonics are turned by R of J = R S (see
    `deformed_splats`); splats that the map bends over, or that a cut goes through, are split first unless
    `split` is False. Those that no edit reaches are as they were, bit for bit.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    if not edits.active:
        return field
    parted = split_for_edits(field, edits, proceed=proceed) if split else field
    splats = deformed_splats(parted, edits, preserve_opacity=preserve_opacity, proceed=proceed)
    moved = moved_splats(parted, edits, proceed=proceed)
    if moved.is_at_rest:
        return parted
    places = Places(moved)
    here = places.moved
    full = splats.covariances[here][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].astype(np.float64).reshape(-1, 3, 3)
    variances, axes = np.linalg.eigh(full)
    axes[:, :, 2] *= np.linalg.det(axes)[:, None]
    sh = splats.sh
    if splats.rotations is not None:
        sh = places.put(sh, rotated_sh(sh[here], splats.rotations[here]))
    log_scales = (0.5 * np.log(np.maximum(variances, 1e-60))).astype(np.float32)
    made = SplatField(
        splats.means,
        places.put(places.of(parted.log_scales), log_scales),
        places.put(places.of(parted.quaternions), quaternions_of(axes).astype(np.float32)),
        splats.opacities,
        sh,
        antialiased=field.antialiased,
        unbounded=field.unbounded,
    )
    low, high = np.minimum(field.bounds[0], made.bounds[0]), np.maximum(field.bounds[1], made.bounds[1])
    return dataclasses.replace(made, bounds=np.stack([low, high]))
