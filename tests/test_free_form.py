from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest

from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.free_form import (
    BOUND_TIMES,
    MAX_PROVEN_STEPS,
    PROVEN,
    FreeFormFlow,
    march,
    proven_knots,
)
from cagefield.warps.interfaces import NoInnerMap

OUTER = Cage.box((0, 0, 0), 4.0)


@dataclass(frozen=True)
class Turning:
    """Rigid rotation about z by `angle` in the closed form, everywhere."""

    angle: float

    def at(self, points: Array, t: float) -> tuple[Array, Array]:
        G = self.angle * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        return points @ G.T, np.broadcast_to(G, (len(points), 3, 3))

    def slope_bounds(self) -> Array:
        return np.full(len(BOUND_TIMES) - 1, self.angle)

    def march(self, points: Array, knots: Array, jacobians: bool = True) -> tuple[Array, Array]:
        x, J = march(self, points, knots)
        return x, J[: len(x) if jacobians else 0]

    def problem(self) -> str | None:
        return None


def test_a_step_at_the_bound_differs_from_the_identity_by_a_contraction() -> None:
    def lipschitz(s: float) -> float:
        return s + s**2 / 2 + s**3 / 6 + s**4 / 24

    assert lipschitz(PROVEN) < 1.0 < lipschitz(1.01 * PROVEN)


@pytest.mark.parametrize("strain", [0.05, 0.25, 0.5, 0.69])
def test_no_step_is_longer_than_is_proven(strain: float) -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        bounds = np.exp(rng.normal(0.0, 2.0, 64))
        knots = proven_knots(bounds, strain)
        assert knots[0] == 0.0 and knots[-1] == 1.0 and (np.diff(knots) > 0.0).all()
        if len(knots) - 1 > MAX_PROVEN_STEPS:
            continue
        # Bounds over a finer grid of times than the intervals.
        for low, high in pairwise(knots):
            t = np.linspace(low, high, 200)[1:-1]
            at = bounds[np.minimum((t * 64).astype(int), 63)]
            assert (high - low) * at.max() <= PROVEN + 1e-12
            assert at.mean() * (high - low) <= strain * 1.05


def test_a_velocity_without_a_bound_is_refused() -> None:
    bounds = np.ones(64)
    bounds[10] = np.inf
    assert len(proven_knots(bounds, 0.25)) > MAX_PROVEN_STEPS

    class Endless(Turning):
        def slope_bounds(self) -> Array:
            return bounds

    assert "would be strained by inf" in (FreeFormFlow(Endless(1.0), OUTER).problem() or "")
    assert FreeFormFlow(Turning(1.0), OUTER).problem() is None


def test_the_march_is_of_fourth_order_and_its_jacobian_that_of_the_steps() -> None:
    velocity, p = Turning(2.0), np.array([[1.0, 0.5, 0.2], [-0.3, 0.1, 0.7]])
    c, s = np.cos(2.0), np.sin(2.0)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    errors = []
    for steps in (8, 16, 32):
        x, J = march(velocity, p, np.linspace(0.0, 1.0, steps + 1))
        errors.append(np.abs(x - p @ R.T).max())
        np.testing.assert_allclose(x, np.einsum("nij,nj->ni", J, p), atol=1e-14)  # the map is linear
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.9).all() and (orders < 4.2).all()


def test_to_deformed_is_the_inverse_of_to_canonical_as_computed() -> None:
    flow = FreeFormFlow(Turning(2.0), OUTER, strain=0.6)
    p = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 3))
    canonical, J = flow.to_canonical(p)
    back, K = flow.to_deformed(canonical)
    np.testing.assert_allclose(back, p, atol=1e-12)
    np.testing.assert_allclose(J @ K, np.broadcast_to(np.eye(3), J.shape), atol=1e-12)
    # Forwards by steps, the error of the integration is left.
    forwards = flow.march_to_deformed(canonical)[0]
    assert 1e-9 < np.abs(forwards - p).max() < 1e-2


def test_nodes_are_displacements_with_x_fastest() -> None:
    flow = FreeFormFlow(Turning(0.3), OUTER)
    nodes = flow.sample(5, NoInnerMap()).reshape(5, 5, 5, 3)
    at = np.array([[-2.0 + 4.0 * 1 / 4, -2.0 + 4.0 * 3 / 4, 0.0]])
    np.testing.assert_allclose(nodes[2, 3, 1], (flow.to_canonical(at)[0] - at)[0], atol=1e-6)
