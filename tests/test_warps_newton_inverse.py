"""Newton's method for the inverse of a map."""

from __future__ import annotations

import numpy as np

from cagefield.typing import Array
from cagefield.warps.newton_inverse import inverted


def bent(x: Array) -> tuple[Array, Array]:
    """(arctan 3 x, its Jacobian): Newton's whole steps lead away from its inverse beyond |x| = 0.46."""
    y = 3.0 * x
    return np.arctan(y), (3.0 / (1.0 + y * y))[:, :, None] * np.eye(3)


def test_inverse_of_a_map_where_whole_steps_lead_away() -> None:
    rng = np.random.default_rng(0)
    points, start = rng.uniform(-1.0, 1.0, (40, 3)), rng.uniform(-4.0, 4.0, (40, 3))
    x, J = inverted(bent, points, start, 1.0)
    expected = np.tan(points) / 3.0
    # It stops at 1e-13 in the map's values, whose slope is at least 3 cos(1)^2 = 0.87.
    np.testing.assert_allclose(x, expected, atol=1e-12)
    np.testing.assert_allclose(J @ bent(expected)[1], np.broadcast_to(np.eye(3), J.shape), atol=1e-10)


def test_points_that_nothing_is_taken_to_end() -> None:
    start = np.zeros((2, 3))
    calls = []

    def counted(x: Array) -> tuple[Array, Array]:
        calls.append(len(x))
        return bent(x)

    points = np.array([[2.0, 0.0, 0.0], [0.5, 0.0, 0.0]])  # arctan is less than 1.58
    x, _ = inverted(counted, points, start, 1.0)
    assert np.isfinite(x).all() and len(calls) <= 41
    # The other point is found all the same, and is not looked at again.
    np.testing.assert_allclose(x[1], [np.tan(0.5) / 3.0, 0.0, 0.0], atol=1e-12)
    assert calls[-1] == 1


def test_points_that_are_there_are_left() -> None:
    start = np.array([[0.1, 0.2, -0.3]])
    x, J = inverted(bent, bent(start)[0], start, 1.0)
    assert np.array_equal(x, start)
    np.testing.assert_allclose(J[0], np.diag((1.0 + 9.0 * start[0] ** 2) / 3.0), rtol=1e-12)
