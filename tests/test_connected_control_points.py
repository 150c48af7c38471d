"""The flow of connected control points over given detours: kernels, bounds and one-to-one maps."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.edits import Continuous, Edit, dump_edits, parse_edits
from cagefield.errors import CageError, EditError
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.typing import Array
from cagefield.warps.control_point_velocity import ControlPointVelocity
from cagefield.warps.free_form import march
from random_control_points import points_around, random_edit
from test_control_point_velocity import check


def grid_around(points: ControlPoints, seed: int, edge: float = 0.25) -> DetourGrid:
    """Random detours in [0, r], 0 at the control points, smooth over some nodes."""
    y = points.local_points
    low, high = y.min(axis=0) - points.radius, y.max(axis=0) + points.radius
    shape = np.ceil((high - low) / edge).astype(int) + 3
    values = np.random.default_rng(seed).uniform(-0.5, 1.0, shape).clip(0.0) * points.radius
    base = np.floor((y - low) / edge + 0.5).astype(int)
    for i, j, k in base:
        values[i - 1 : i + 2, j - 1 : j + 2, k - 1 : k + 2] = 0.0
    return DetourGrid(low, edge, values)


def connected_edit(seed: int) -> Continuous:
    edit = random_edit(seed)
    assert isinstance(edit.inner, ControlPoints)
    points = edit.inner.with_reach(connected=True)
    return edit.replace(inner=points.with_detours(grid_around(points, seed)))


def velocity_of(edit: Continuous) -> ControlPointVelocity:
    """The velocity of an edit, also of one with more strain than is possible."""
    inner, deformed = edit.inner, edit.deformed
    assert isinstance(inner, ControlPoints) and isinstance(deformed, ControlPoints)
    return ControlPointVelocity(inner, deformed, edit.outer)


def test_detours_are_interpolated_by_quadratic_splines() -> None:
    nodes = np.stack(np.meshgrid(*(np.arange(n) for n in (6, 7, 8)), indexing="ij"), axis=-1)
    at = np.random.default_rng(0).uniform(1.0, 4.0, (500, 3))
    # Quadratic B-splines give back linear functions, and their slope.
    linear = DetourGrid((0.1, 0.2, 0.3), 0.5, nodes @ np.array([1.0, 2.0, 0.5]))
    E, dE = linear.at((0.1, 0.2, 0.3) + 0.5 * at)
    np.testing.assert_allclose(E, at @ [1.0, 2.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(dE, np.tile([2.0, 4.0, 1.0], (500, 1)), atol=1e-12)
    assert linear.slope_bound == pytest.approx(np.linalg.norm([2.0, 4.0, 1.0]))


@pytest.mark.parametrize("seed", range(3))
def test_the_slope_of_detours_is_their_derivative_and_within_its_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = DetourGrid((0, 0, 0), 0.2, rng.uniform(0.0, 1.0, (5, 6, 7)))
    q = rng.uniform(-0.3, 1.7, (20_000, 3))
    dE = grid.at(q)[1]
    h = 1e-6
    for axis, e in enumerate(h * np.eye(3)):
        difference = (grid.at(q + e)[0] - grid.at(q - e)[0]) / (2.0 * h)
        # But for points within h of where the grid ends.
        assert np.quantile(np.abs(difference - dE[:, axis]), 0.999) < 1e-6
    steepest = np.linalg.norm(dE, axis=1).max()
    assert 0.3 * grid.slope_bound < steepest <= grid.slope_bound


@pytest.mark.parametrize("seed", range(12))
def test_the_slope_of_the_velocity_is_its_derivative(seed: int) -> None:
    edit = connected_edit(seed)
    velocity, p = velocity_of(edit), points_around(edit, 400, seed)
    h = 1e-6
    for t in (0.0, 0.4, 1.0):
        _, G = velocity.at(p, t)
        for a in range(3):
            e = h * np.eye(3)[a]
            difference = (velocity.at(p + e, t)[0] - velocity.at(p - e, t)[0]) / (2.0 * h)
            error = np.abs(difference - G[:, :, a]).max(axis=1)
            assert np.quantile(error, 0.99) < 1e-6 * max(1.0, np.abs(G).max())


@pytest.mark.parametrize("seed", range(25))
def test_no_slope_exceeds_the_bound_that_steps_are_made_for(seed: int) -> None:
    edit = connected_edit(seed)
    velocity, p = velocity_of(edit), points_around(edit, 600, seed)
    bounds = velocity.slope_bounds()
    for t in np.linspace(0.0, 1.0, 17):
        steepest = np.linalg.norm(velocity.at(p, float(t))[1], ord=2, axis=(1, 2)).max()
        assert steepest <= bounds[min(int(t * len(bounds)), len(bounds) - 1)] * (1.0 + 1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_the_kernels_march_as_the_reference(seed: int) -> None:
    edit = connected_edit(seed)
    velocity, p = velocity_of(edit), points_around(edit, 300, seed)
    knots = np.linspace(0.0, 1.0, 9)
    for way in (knots, knots[::-1]):
        x, J = velocity.march(p, way)
        reference, slope = march(velocity, p, way)
        np.testing.assert_allclose(x, reference, atol=1e-11)
        np.testing.assert_allclose(J, slope, atol=1e-8 * max(1.0, np.abs(slope).max()))
        without, _ = velocity.march(p, way, jacobians=False)
        np.testing.assert_allclose(without, reference, atol=1e-11)


@pytest.mark.parametrize("seed", range(20))
def test_random_edits_do_not_fold(seed: int) -> None:
    edit = connected_edit(seed)
    if edit.is_possible:
        check(edit, seed, 300)


def test_most_random_edits_are_possible() -> None:
    assert np.mean([connected_edit(seed).is_possible for seed in range(30)]) > 0.7


@pytest.mark.parametrize("seed", range(6))
def test_points_go_where_they_are_dragged(seed: int) -> None:
    edit = connected_edit(seed)
    if edit.is_possible:
        there = edit.exact_warp.to_deformed(edit.inner.handles).points
        np.testing.assert_allclose(there, edit.deformed.handles, atol=5e-4)  # steps along steep detours


def test_no_detours_are_the_plain_edit() -> None:
    plain = random_edit(3)
    assert isinstance(plain.inner, ControlPoints)
    y: Array = plain.inner.local_points
    none = DetourGrid(y.min(axis=0) - 0.5, 0.1, np.zeros((20, 20, 20)))
    connected = plain.replace(inner=plain.inner.with_reach(connected=True, detours=none))
    p = points_around(plain, 300, 0)
    moved, same = (edit.exact_warp.to_canonical(p).points for edit in (connected, plain))
    np.testing.assert_allclose(moved, same, atol=1e-13)
    assert np.abs(same - p).max() > 0.1


def test_an_edit_without_a_field_says_what_it_needs() -> None:
    edit = Edit.points([[0, 0, 0]], radius=0.5, connected=True, name="finger").translate((0.1, 0, 0))
    edit.check()
    with pytest.raises(EditError, match=r'edit "finger": connected .* render the edit as part of a Scene'):
        edit.exact_warp  # noqa: B018
    with pytest.raises(CageError, match="leave detours out"):
        ControlPoints([[0, 0, 0]], 0.5, detours=DetourGrid((0, 0, 0), 1.0, np.zeros((3, 3, 3))))


def test_edit_files_say_connected_and_hold_no_detours() -> None:
    edit = connected_edit(0)
    text = dump_edits([edit])
    assert "connected: true" in text
    (again,) = parse_edits(text)
    assert isinstance(again.inner, ControlPoints)
    assert again.inner.connected and again.inner.detours is None
    assert again.inner == edit.inner.with_detours(None) and again.inner != edit.inner
    assert "connected" not in dump_edits([random_edit(0)])


def test_equality_and_hashes_follow_the_detours() -> None:
    one, same, other = connected_edit(1), connected_edit(1), connected_edit(1)
    assert one.inner == same.inner and hash(one) == hash(same)
    points = other.inner
    assert isinstance(points, ControlPoints)
    assert points.with_detours(grid_around(points, 99)) != one.inner
