"""The cost of pictures is found from those that are rendered, whatever part of it is fixed."""

from __future__ import annotations

import pytest

from cagefield.server.render_queue.frame_cost import FrameCost


@pytest.mark.parametrize("fixed", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("rate", [3e5, 1e6, 2e7])
def test_sizes_that_follow_the_cost_find_it(fixed: float, rate: float) -> None:
    cost = FrameCost()
    cost.add(800_000.0, 9 * fixed + 800_000.0 / rate, 9)
    rays = 13_000.0
    for _ in range(30):
        cost.add(rays, fixed + rays / rate)
        rays = min(max(cost.rays(0.06, 0.02), 13_000.0), 800_000.0)
    # A size is kept as the mean of its pictures, of up to 1.4 times the rays of one another.
    expected = min(max(max(0.06 - fixed, 0.02) * rate, 13_000.0), 800_000.0)
    assert rays == pytest.approx(expected, rel=0.3)


def test_noise_and_a_scene_that_becomes_slower_are_followed() -> None:
    cost = FrameCost()
    for n in range(40):
        noise = 1.0 + 0.2 * (-1) ** n
        cost.add(50_000 * (1 + n % 3), noise * (0.01 + 50_000 * (1 + n % 3) / 4e6))
    assert 0.6 * 4e6 < 1.0 / cost.per_ray < 1.7 * 4e6
    for n in range(40):
        cost.add(50_000 * (1 + n % 3), 0.04 + 50_000 * (1 + n % 3) / 1e6)
    assert cost.fixed == pytest.approx(0.04, abs=0.01)
    assert 1.0 / cost.per_ray == pytest.approx(1e6, rel=0.2)
