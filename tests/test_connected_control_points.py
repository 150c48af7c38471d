"""Detours of connected control points on a grid, and edits with them; see `test_control_point_velocity`."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.edits.random_edits.control_points import (
    connected_edit,
    grid_around,
    points_around,
    random_edit,
)

from cagefield.edits import Edit, dump_edits, parse_edits
from cagefield.errors import CageError, EditError
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.typing import Array


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
