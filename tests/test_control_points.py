from __future__ import annotations

import numpy as np
import pytest

from cagefield.errors import CageError
from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import MAX_CONTROL_POINTS, ControlPoints

THREE = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.0, 2.0, 0]])


def test_operations_move_all_points_about_the_pivot() -> None:
    cage = ControlPoints(THREE, 0.5)
    assert np.allclose(cage.pivot, THREE.mean(axis=0))
    turned = cage.rotate((0, 0, np.pi / 2))
    R = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned.handles, cage.pivot + (THREE - cage.pivot) @ R.T, atol=1e-15)
    np.testing.assert_allclose(turned.linear, R, atol=1e-15)
    grown = turned.scale(2.0)
    np.testing.assert_allclose(grown.handles - cage.pivot, 2.0 * (turned.handles - cage.pivot))
    # The space around the points goes along: distances are measured before the linear map.
    np.testing.assert_allclose(grown.local_points, cage.local_points, atol=1e-15)
    moved = grown.translate((1, 2, 3)).move_point(1, (0, 0, 0.5))
    assert isinstance(moved, ControlPoints) and np.allclose(moved.pivot - cage.pivot, (1, 2, 3))
    np.testing.assert_allclose(moved.handles[1] - grown.handles[1], (1, 2, 3.5))


def test_corners_are_the_box_of_the_reach_and_turn_along() -> None:
    cage = ControlPoints(THREE, 0.5)
    np.testing.assert_allclose(cage.aabb, [[-0.5, -0.5, -0.5], [1.5, 2.5, 0.5]])
    np.testing.assert_allclose(cage.corners[[0, 7]], cage.aabb)
    turned = cage.rotate((0, 0, 0.3))
    R = turned.linear
    np.testing.assert_allclose(turned.corners, cage.pivot + (cage.corners - cage.pivot) @ R.T)
    stretched = cage.scale((2.0, 1.0, 1.0))
    np.testing.assert_allclose(stretched.aabb[1, 0] - stretched.points[:, 0].max(), 1.0)  # twice the radius


def test_contains_is_within_the_radius_of_a_point() -> None:
    cage = ControlPoints(THREE, 0.5)
    p = np.array([[0.49, 0, 0], [0.5, 0.1, 0], [1.3, 0.3, 0], [0, 2.0, 0.5], [0.5, 1.0, 0]])
    assert cage.contains(p).tolist() == [True, False, True, True, False]
    assert cage.coordinates(p)[1].tolist() == [True, False, True, True, False]
    assert cage.scale((2.0, 1.0, 1.0)).contains([[0.15, 0, 0]]).all()


def test_equality_knows_radius_falloff_and_kind() -> None:
    cage = ControlPoints(THREE, 0.5)
    assert cage == ControlPoints(THREE, 0.5) and hash(cage) == hash(ControlPoints(THREE, 0.5))
    for other in (
        ControlPoints(THREE, 0.6),
        ControlPoints(THREE, 0.5, "root"),
        ControlPoints(THREE[:2], 0.5),
        cage.translate((0, 0, 1e-12)),
        Cage(cage.corners, pivot=cage.pivot),
    ):
        assert cage != other and other != cage and not cage.has_shape_of(other)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ControlPoints([[0, 0]], 1), "1 to 256 points of 3 numbers, got shape \\[1, 2\\]"),
        (lambda: ControlPoints([], 1), "1 to 256 points of 3 numbers"),
        (lambda: ControlPoints(np.zeros((MAX_CONTROL_POINTS + 1, 3)), 1), "got shape \\[257, 3\\]"),
        (lambda: ControlPoints("nose", 1), "got 'nose'"),
        (lambda: ControlPoints([[0, 0, 0], [0, np.nan, 0]], 1), "control point 1 must be finite"),
        (lambda: ControlPoints([[0, 0, 0], [1, 0, 0], [0, 0, 0]], 1), "control points 0 and 2 are both at"),
        (lambda: ControlPoints(THREE, 0), "positive and finite, got 0"),
        (lambda: ControlPoints(THREE, np.nan), "positive and finite, got nan"),
        (lambda: ControlPoints(THREE, "wide"), "must be a number, got 'wide'"),
        (lambda: ControlPoints(THREE, 1, "gauss"), 'falloff must be one of smooth, .*, got "gauss"'),
        (lambda: ControlPoints(THREE, 1, linear=-np.eye(3)), "positive determinant, got -1"),
        (lambda: ControlPoints(THREE, 1).move_corner(0, (1, 0, 0)), "no corners, .* use move_point"),
        (lambda: ControlPoints(THREE, 1).move_face("+x", (1, 0, 0)), "no corners, .* use move_point"),
        (lambda: ControlPoints(THREE, 1).subdivided((1, 1, 1)), "no cells"),
        (lambda: ControlPoints(THREE, 1).move_point(3, (1, 0, 0)), "3"),
    ],
)
def test_impossible_points_are_refused_in_one_line(make: object, message: str) -> None:
    with pytest.raises(CageError, match=message) as caught:
        make()  # type: ignore[operator]
    assert "\n" not in str(caught.value)
