"""Lines of text that say what a scene holds and what its edits do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from cagefield import hexahedron
from cagefield.errors import EditError
from cagefield.fields.contraction import uncontract
from cagefield.hexahedron import Array
from cagefield.warps.continuous import ContinuousWarp

if TYPE_CHECKING:
    from cagefield.cages import Cage
    from cagefield.edits import Edit
    from cagefield.fields.voxel import VoxelField


def describe_edits(edits: Iterable[Edit], field: VoxelField) -> list[str]:
    """Per edit, in the order of the stack: a line on what it is, and indented ones on what it changes.

    The shares are of the field's stored voxels inside the canonical inner cage and in the shell around it. An
    edit that cannot be evaluated says why.
    """
    positions, voxel = _vertex_positions(field), float(min(field.voxel_size))
    lines: list[str] = []
    for number, edit in enumerate(edits, start=1):
        lines += [f"{number}. {_title(edit)}", *("   " + line for line in _details(edit, positions, voxel))]
    return lines or ["no edits"]


def _title(edit: Edit) -> str:
    name = f'"{edit.name}": ' if edit.name else ""
    hidden = "" if edit.enabled else " (hidden)"
    if edit.deleted:
        kind = "delete"
    elif edit.adjustment == "discrete":
        kind = "discrete copy" if edit.keep_source else "discrete move"
    else:
        how = "exact" if edit.lattice is None else f"lattice of {edit.lattice}^3 nodes"
        kind = f"continuous, {edit.shell} shell, {how}"
    return f"{name}{kind}{hidden}"


def _details(edit: Edit, positions: Array, voxel: float) -> Iterable[str]:
    inside = edit.inner.contains(positions)
    share = float(inside.mean()) if len(positions) else 0.0
    if edit.deleted:
        yield f"empties {share:.1%} of the field's voxels"
        return
    for operation in edit.operations:
        yield f"{operation.noun} {operation}"
    if not edit.changes_anything:
        yield "changes nothing: the inner cage is where it was"
        return
    reach = np.linalg.norm(edit.deformed.corners - edit.inner.corners, axis=1).max()
    yield (
        f"{share:.1%} of the field's voxels follow the cage, whose corners move by up to {reach:.4g}; "
        f"its volume becomes {_volume(edit.deformed) / _volume(edit.inner):.3g} times what it was"
    )
    try:
        warp = edit.exact_warp
    except EditError as error:
        yield f"cannot be evaluated: {error}"
        return
    if isinstance(warp, ContinuousWarp):
        gives = float((warp.outer.contains(positions) & ~inside).mean()) if len(positions) else 0.0
        ratio = warp.shell.least_ratio()
        state = "does not fold" if ratio > 0.0 else "folds, and is allowed to"
        yield f"{gives:.1%} of them give way; the shell {state} (least volume ratio {ratio:.3f})"
        if edit.lattice is not None:
            worst, mean = edit.lattice_error()
            yield f"the lattice is off by {mean / voxel:.2g} voxels on average, {worst / voxel:.2g} at most"


def _volume(cage: Cage) -> float:
    """Volume of a hexahedron: the mean of the Bernstein coefficients of its Jacobian determinant."""
    return float(hexahedron.determinant_coefficients(cage.corners).mean())


def _vertex_positions(field: VoxelField) -> Array:
    """Canonical positions [M,3] of the field's stored vertices, world units."""
    grid = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
    lower, upper = field.grid_bounds
    positions: Array = lower + grid / (np.array(field.resolution) - 1) * (upper - lower)
    return field.center + field.half_size * uncontract(positions) if field.contracted else positions
