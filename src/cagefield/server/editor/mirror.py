"""Mirrored edits: cages and operations across a plane normal to one of the world's axes.

A mirrored cage would be inside out, so its corners are numbered the other way along the axis of that name:
corner k of the mirrored cage is the mirror image of corner k ^ (1 << axis). Every operation A becomes F A F,
F the reflection; in the mirrored cage's own axes F has the same signs, so `axes="cage"` keeps its meaning.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.edits import Edit
from cagefield.edits import operations as ops
from cagefield.edits.operations import Operation, Triple
from cagefield.geometry.cage import FACES, Cage
from cagefield.typing import Array


def mirror_edit(edit: Edit, axis: int, at: float) -> Edit:
    """The edit across the plane where coordinate `axis` is `at`."""
    settings = edit.shell_settings
    if settings.outer is not None:
        settings = replace(settings, outer=settings.outer.mirrored(axis, at))
    return edit.with_shell_settings(settings).replace(
        inner=edit.inner.mirrored(axis, at),
        operations=tuple(mirrored_operation(operation, axis, edit.inner) for operation in edit.operations),
    )


def mirrored_operation(operation: Operation, axis: int, cage: Cage) -> Operation:
    """Operation on the mirrored cage that corresponds to `operation` on the cage."""
    if isinstance(operation, ops.Translate):
        return ops.Translate(_flipped(operation.by, axis))
    if isinstance(operation, ops.Rotate):
        F = _reflection(axis)
        R = Rotation.from_euler("XYZ", operation.degrees, degrees=True).as_matrix()
        x, y, z = ops.euler_degrees(Rotation.from_matrix(F @ R @ F)).tolist()
        return ops.Rotate((x, y, z), operation.axes)
    if isinstance(operation, ops.Scale | ops.Mirror):
        return operation
    if isinstance(operation, ops.Shear):
        name = "xyz"[axis]
        factors = operation.factors.items()
        values = {pair: -value if name in pair and value else value for pair, value in factors}
        return ops.Shear(**values, axes=operation.axes)
    if isinstance(operation, ops.Bend | ops.Twist | ops.Taper):
        return _mirrored_along_axis(operation, "xyz"[axis])
    by = _flipped(operation.by, axis)
    if isinstance(operation, ops.MoveCorner):
        return ops.MoveCorner(operation.corner ^ 1 << axis, by)
    if isinstance(operation, ops.MoveEdge):
        i, j = sorted(k ^ 1 << axis for k in operation.edge)
        return ops.MoveEdge((i, j), by)
    if isinstance(operation, ops.MovePoint):
        return ops.MovePoint(cage.mirrored_handle(operation.point, axis), by)
    if isinstance(operation, ops.MovePoints):
        points = tuple(cage.mirrored_handle(k, axis) for k in operation.points)
        return replace(operation, points=points, by=by)
    if isinstance(operation, ops.MoveFace):
        return ops.MoveFace(_other_face(operation.face, axis), by)
    return ops.MoveCorners(tuple(k ^ 1 << axis for k in operation.corners), by)


def _mirrored_along_axis(operation: ops.Bend | ops.Twist | ops.Taper, mirrored: str) -> Operation:
    """A bend, twist or taper of a lattice whose own axis `mirrored` is numbered the other way."""
    ends = {"start": "end", "middle": "middle", "end": "start"}
    fixed = ends[operation.fixed] if operation.axis == mirrored else operation.fixed
    if isinstance(operation, ops.Twist):
        return replace(operation, degrees=-operation.degrees, fixed=fixed)
    if isinstance(operation, ops.Taper):
        factor = 1.0 / operation.factor if operation.axis == mirrored else operation.factor
        return replace(operation, factor=factor, fixed=fixed)
    towards = operation.towards or "yzx"["xyz".index(operation.axis)]
    return replace(
        operation, degrees=-operation.degrees if towards == mirrored else operation.degrees, fixed=fixed
    )


def _other_face(face: str, axis: int) -> str:
    corners = {k ^ 1 << axis for k in FACES[face]}
    return next(name for name, ids in FACES.items() if set(ids) == corners)


def _flipped(by: Triple, axis: int) -> Triple:
    x, y, z = (-value if n == axis and value else value for n, value in enumerate(by))
    return x, y, z


def _reflection(axis: int) -> Array:
    F = np.eye(3)
    F[axis, axis] = -1.0
    return F
