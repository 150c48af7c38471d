"""Mirrored edits do to mirrored points what the edits do to the points."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.edits import Edit
from cagefield.edits import operations as ops
from cagefield.geometry.cage import Cage
from cagefield.server.editor.mirror import mirror_edit, mirrored_operation

INNER = Cage.box((0.2, 0.1, -0.1), (0.5, 0.4, 0.3), (0.3, -0.2, 0.5))
OPERATIONS: tuple[ops.Operation, ...] = (
    ops.Translate((0.05, -0.03, 0.02)),
    ops.Rotate((20, -30, 10)),
    ops.Rotate((10, 5, 25), "cage"),
    ops.Scale((1.1, 0.9, 1.2)),
    ops.Scale((0.9, 1.1, 0.8), "cage"),
    ops.Shear(xy=0.1, yz=-0.05, zx=0.08),
    ops.MoveCorner(3, (0.03, 0.02, -0.01)),
    ops.MoveEdge((2, 6), (0.02, -0.02, 0.03)),
    ops.MoveFace("-y", (0.01, -0.04, 0.02)),
    ops.MoveCorners((1, 4, 6), (-0.02, 0.01, 0.01)),
    ops.Mirror("y"),
)


def reflected(points: np.ndarray, axis: int, at: float) -> np.ndarray:
    out = points.copy()
    out[:, axis] = 2.0 * at - out[:, axis]
    return out


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    "operation", OPERATIONS, ids=lambda o: f"{type(o).__name__} {getattr(o, 'axes', '')}"
)
def test_every_operation_is_the_mirror_image_of_itself(axis: int, operation: ops.Operation) -> None:
    edit = Edit.move(INNER).then(operation)
    other = mirror_edit(edit, axis, 0.3)
    rng = np.random.default_rng(0)
    points = INNER.corners.mean(axis=0) + rng.uniform(-0.3, 0.3, (200, 3))
    there = reflected(edit.exact_warp.to_canonical(points).points, axis, 0.3)
    found = other.exact_warp.to_canonical(reflected(points, axis, 0.3)).points
    # Both go through the same arithmetic up to rounding; angles pass through Euler angles once more.
    np.testing.assert_allclose(found, there, atol=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_mirrored_cage_is_a_valid_one_and_twice_is_the_same(axis: int) -> None:
    twice = INNER.mirrored(axis, 0.25).mirrored(axis, 0.25)
    np.testing.assert_allclose(twice.corners, INNER.corners, atol=1e-12)
    np.testing.assert_allclose(twice.pivot, INNER.pivot, atol=1e-12)


POINTS = Edit.points([[0.1, 0, 0], [-0.2, 0.2, 0]], radius=0.4)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    "operation",
    [*OPERATIONS[:6], ops.MovePoint(1, (0.1, 0.05, -0.1)), ops.MovePoints((0, 1), (0.1, 0, 0.1))],
    ids=lambda o: f"{type(o).__name__} {getattr(o, 'axes', '')}",
)
def test_control_points_are_mirrored_with_their_operations(axis: int, operation: ops.Operation) -> None:
    edit = POINTS.rotate((0.1, 0, 0.2)).then(operation)
    other = mirror_edit(edit, axis, 0.3)
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (200, 3))
    there = reflected(edit.exact_warp.to_canonical(points).points, axis, 0.3)
    found = other.exact_warp.to_canonical(reflected(points, axis, 0.3)).points
    assert np.abs(there - reflected(points, axis, 0.3)).max() > 0.03
    # The steps of both are the same, but for rounding of their bounds.
    np.testing.assert_allclose(found, there, atol=1e-6)
    np.testing.assert_allclose(
        np.sort(other.outer.aabb, axis=0), np.sort(reflected(edit.outer.aabb, axis, 0.3), axis=0)
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_lattice_is_mirrored_with_its_points(axis: int) -> None:
    lattice = INNER.subdivided((1, 2, 3))
    moved = lattice.move_point(7, (0.02, -0.01, 0.03)).move_points((0, 11), (-0.02, 0.01, 0.0))
    other = lattice.mirrored(axis, 0.3)
    for operation in (ops.MovePoint(7, (0.02, -0.01, 0.03)), ops.MovePoints((0, 11), (-0.02, 0.01, 0.0))):
        other = mirrored_operation(operation, axis, lattice).apply(other)
    expected = moved.mirrored(axis, 0.3)
    np.testing.assert_allclose(other.handles, expected.handles, atol=1e-12)
    # Its inside is the mirror image, too.
    inside = INNER.corners.mean(axis=0) + np.random.default_rng(0).uniform(-0.3, 0.3, (300, 3))
    assert np.array_equal(moved.contains(inside), expected.contains(reflected(inside, axis, 0.3)))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    "operation",
    [
        ops.Bend("z", 40.0, "x"),
        ops.Bend("x", -30.0, "y", "end"),
        ops.Bend("y", 30.0, fixed="middle"),
        ops.Twist("z", 50.0),
        ops.Twist("x", 50.0, "middle"),
        ops.Taper("y", 0.6),
        ops.Taper("z", 0.6, "end"),
    ],
)
def test_bends_twists_and_tapers_are_mirrored(axis: int, operation: ops.Bend | ops.Twist | ops.Taper) -> None:
    lattice = INNER.subdivided((2, 2, 3))
    image = mirrored_operation(operation, axis, lattice).apply(lattice.mirrored(axis, 0.3))
    np.testing.assert_allclose(image.handles, operation.apply(lattice).mirrored(axis, 0.3).handles, atol=1e-9)
