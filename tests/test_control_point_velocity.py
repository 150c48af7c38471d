from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from benchmarks.edits.random_edits.control_points import OUTER, connected_edit, points_around, random_edit

from cagefield.edits import Continuous, Edit
from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.point_deformers import FALLOFF_CURVES, falloff_weight
from cagefield.warps.control_point_velocity import ControlPointVelocity
from cagefield.warps.falloff_curves import ROOT_END, STEEPEST, curve
from cagefield.warps.free_form import EXACT_STEP_STRAIN, MAX_PROVEN_STEPS, FreeFormFlow, march
from tiers import nightly_except

RandomEdit = Callable[[int], Continuous]


@pytest.fixture(params=[random_edit, connected_edit], ids=["plain", "connected"])
def draw(request: pytest.FixtureRequest) -> RandomEdit:
    """Random edits by seed: of plain control points, and of connected ones over given detours."""
    drawn: RandomEdit = request.param
    return drawn


def velocity_of(edit: Continuous) -> ControlPointVelocity:
    """The velocity of an edit, also of one with more strain than is possible."""
    inner, deformed = edit.inner, edit.deformed
    assert isinstance(inner, ControlPoints) and isinstance(deformed, ControlPoints)
    return ControlPointVelocity(inner, deformed, edit.outer)


@pytest.mark.parametrize("name", FALLOFF_CURVES)
def test_curves_are_those_of_3d_editors_but_where_their_slope_has_no_bound(name: str) -> None:
    s = np.linspace(0.0, 1.0, 20_001)
    w, slope = curve(name, s)
    assert w[0] == 0.0 and w[-1] == 1.0 and (np.diff(w) >= 0.0).all()
    argument = {"sphere": s * (2.0 - s), "root": s}.get(name)
    proper = s > 0.0 if argument is None else argument >= ROOT_END[name]
    np.testing.assert_allclose(w[proper], falloff_weight(1.0 - s, 1.0, name)[proper], atol=1e-15)
    # The derivative, and that nothing is steeper than what steps are made for.
    middle = np.diff(w) / np.diff(s)
    between = curve(name, 0.5 * (s[1:] + s[:-1]))[1]
    # The step squared times the third derivative, and at q = e half a jump of the second.
    np.testing.assert_allclose(middle[1:], between[1:], atol=1e-3)
    assert slope.max() <= STEEPEST[name] * (1.0 + 1e-12) and slope.max() > 0.99 * STEEPEST[name]
    assert curve(name, np.array([-0.1, 1.1]))[0].tolist() == [0.0, 1.0]


def test_a_point_goes_where_it_is_dragged_and_takes_its_surroundings_along() -> None:
    edit = Edit.points([[0, 0, 0]], radius=0.5).translate((0.2, 0.1, 0))
    warp = edit.exact_warp
    np.testing.assert_allclose(warp.to_canonical(np.array([[0.2, 0.1, 0]])).points, 0.0, atol=1e-7)
    np.testing.assert_allclose(warp.to_deformed(np.zeros((1, 3))).points, [[0.2, 0.1, 0]], atol=1e-7)
    # Along the way of a small drag v = w(|x|) d: displacement by the weight, to first order.
    small = Edit.points([[0, 0, 0]], radius=0.5).translate((1e-5, 0, 0)).exact_warp
    p = np.array([[0.0, 0.25, 0.0], [0.0, 0.0, 0.4], [0.0, 0.6, 0.0]])
    moved = (small.to_deformed(p).points - p)[:, 0] / 1e-5
    np.testing.assert_allclose(moved, [0.5, falloff_weight(np.array(0.4), 0.5, "smooth"), 0.0], atol=1e-4)


def test_all_points_follow_their_own_drags() -> None:
    start = np.array([[0.0, 0, 0], [0.5, 0, 0], [0.2, 0.4, 0.1]])
    edit = Edit.points(start, radius=0.4)
    edit = edit.move_point(0, (0, 0.2, 0)).move_point(1, (0, -0.2, 0.1)).rotate((0, 0.3, 0)).scale(1.2)
    moved = edit.exact_warp.to_deformed(start).points
    np.testing.assert_allclose(moved, edit.deformed.handles, atol=2e-6)  # by the error of the steps


def test_a_turn_about_a_single_point_turns_its_surroundings() -> None:
    edit = Edit.points([[0, 0, 0]], radius=1.0).rotate((0, 0, np.pi / 2))
    assert edit.changes_anything
    mapped = edit.exact_warp.to_deformed(np.array([[1e-4, 0, 0], [0.5, 0, 0], [1.01, 0, 0]]))
    angle = np.arctan2(mapped.points[:, 1], mapped.points[:, 0])
    # The distance from the point, and with it the weight, stays: the angle is the weight's share.
    np.testing.assert_allclose(angle, np.pi / 2 * np.array([1.0, 0.5, 0.0]), atol=1e-4)


def test_a_drag_there_and_back_is_nothing() -> None:
    edit = Edit.points([[0, 0, 0]], radius=0.5).translate((0.2, 0, 0)).translate((-0.2, 0, 0))
    assert not edit.changes_anything


@pytest.mark.parametrize("seed", nightly_except(range(12), *range(4)))
def test_the_slope_of_the_velocity_is_its_derivative(draw: RandomEdit, seed: int) -> None:
    edit = draw(seed)
    velocity, p = velocity_of(edit), points_around(edit, 400, seed)
    h = 1e-6
    for t in (0.0, 0.4, 1.0):
        _, G = velocity.at(p, t)
        for a in range(3):
            e = h * np.eye(3)[a]
            difference = (velocity.at(p + e, t)[0] - velocity.at(p - e, t)[0]) / (2.0 * h)
            error = np.abs(difference - G[:, :, a]).max(axis=1)
            # But for the few points within h of a kink: at the reach's end, or where a root begins.
            assert np.quantile(error, 0.99) < 1e-6 * max(1.0, np.abs(G).max())


@pytest.mark.parametrize("seed", nightly_except(range(25), *range(5)))
def test_no_slope_exceeds_the_bound_that_steps_are_made_for(draw: RandomEdit, seed: int) -> None:
    edit = draw(seed)
    velocity, p = velocity_of(edit), points_around(edit, 600, seed)
    bounds = velocity.slope_bounds()
    for t in np.linspace(0.0, 1.0, 17):
        G = velocity.at(p, float(t))[1]
        steepest = np.linalg.norm(G, ord=2, axis=(1, 2)).max()
        assert steepest <= bounds[min(int(t * len(bounds)), len(bounds) - 1)] * (1.0 + 1e-12)


def test_the_blend_of_close_points_is_no_steeper_than_its_bound() -> None:
    """Where the bound is nearly reached: between two points that go apart."""
    edit = Edit.points([[-0.05, 0, 0], [0.05, 0, 0]], radius=2.0).move_point(0, (0, 1, 0))
    edit = edit.move_point(1, (0, -1, 0))
    velocity = velocity_of(edit)
    x = np.zeros((2001, 3))
    x[:, 0] = np.linspace(-0.06, 0.06, 2001)
    slope = np.linalg.norm(velocity.at(x, 0.0)[1], ord=2, axis=(1, 2)).max()
    assert 0.7 * velocity.slope_bounds()[0] < slope <= velocity.slope_bounds()[0]


@pytest.mark.parametrize("seed", nightly_except(range(8), *range(3)))
def test_the_kernel_marches_as_the_reference(draw: RandomEdit, seed: int) -> None:
    edit = draw(seed)
    velocity, p = velocity_of(edit), points_around(edit, 300, seed)
    knots = np.linspace(0.0, 1.0, 9)
    for way in (knots, knots[::-1]):
        x, J = velocity.march(p, way)
        reference, slope = march(velocity, p, way)
        np.testing.assert_allclose(x, reference, atol=1e-11)
        np.testing.assert_allclose(J, slope, atol=1e-8 * max(1.0, np.abs(slope).max()))
        without, none = velocity.march(p, way, jacobians=False)
        np.testing.assert_allclose(without, reference, atol=1e-11)
        assert none.shape == (0, 3, 3)


def check(edit: Continuous, seed: int, samples: int) -> None:
    """Identity outside, positive determinants, round trip and a Jacobian that is the derivative."""
    edit.check()
    warp, p = edit.exact_warp, points_around(edit, samples, seed)
    mapped = warp.to_canonical(p)
    assert (np.linalg.det(mapped.jacobian) > 0.0).all()
    outside = ~edit.outer.contains(p)
    assert (mapped.points[outside] == p[outside]).all()
    back = warp.to_deformed(mapped.points)
    np.testing.assert_allclose(back.points, p, atol=1e-4)
    assert (np.linalg.det(back.jacobian) > 0.0).all()
    # On the outer cage's faces nothing moves: no seam.
    rng = np.random.default_rng(seed)
    u = rng.random((60, 3))
    u[np.arange(60), rng.integers(0, 3, 60)] = rng.integers(0, 2, 60)
    origin, frame = edit.outer.frame
    face = origin + u @ frame.T
    np.testing.assert_allclose(warp.to_canonical(face).points, face, atol=1e-6)


@pytest.mark.parametrize("seed", nightly_except(range(20), *range(4)))
def test_random_edits_do_not_fold(draw: RandomEdit, seed: int) -> None:
    edit = draw(seed)
    if edit.is_possible:
        check(edit, seed, 300)


def test_most_random_edits_are_possible(draw: RandomEdit) -> None:
    assert np.mean([draw(seed).is_possible for seed in range(30)]) > 0.7


@pytest.mark.parametrize("seed", range(6))
def test_connected_points_go_where_they_are_dragged(seed: int) -> None:
    edit = connected_edit(seed)
    if edit.is_possible:
        there = edit.exact_warp.to_deformed(edit.inner.handles).points
        np.testing.assert_allclose(there, edit.deformed.handles, atol=5e-4)  # by the error of the steps


def test_a_drag_over_many_radii_does_not_fold() -> None:
    edit = Edit.points([[0, 0, 0]], radius=0.3, falloff="sphere").translate((2.0, 0, 0)).rotate((0, 0, 3.0))
    check(edit, 0, 2000)


def test_the_reach_without_an_outer_cage_holds_all_that_moves() -> None:
    edit = Edit.points([[0, 0, 0], [0.3, 0, 0]], radius=0.5).translate((0.5, 0.2, 0)).rotate((0, 0.4, 2.0))
    velocity = velocity_of(edit)
    assert velocity.fade == 0.0
    free = ControlPointVelocity(velocity.inner, velocity.deformed, OUTER)
    low, high = edit.outer.aabb
    p = np.random.default_rng(0).uniform(low - 0.2, high + 0.2, (20_000, 3))
    outside = ~edit.outer.contains(p)
    assert outside.sum() > 1000
    for t in np.linspace(0.0, 1.0, 33):
        assert (free.at(p[outside], float(t))[0] == 0.0).all()
    # And not much more: the box of the balls at both ends lies in it, with little room.
    ends = np.stack([edit.inner.aabb, edit.deformed.aabb])
    assert (low <= ends[:, 0].min(axis=0)).all() and (high >= ends[:, 1].max(axis=0)).all()
    assert ((ends[:, 0].min(axis=0) - low) < 0.25).all()


def test_a_smaller_outer_cage_confines_the_motion_smoothly() -> None:
    outer = Cage.box((0.2, 0, 0), (1.0, 0.8, 0.8))
    edit = Edit.points([[0, 0, 0]], radius=0.5, outer=outer).translate((0.3, 0, 0))
    velocity = velocity_of(edit)
    assert velocity.fade == pytest.approx(0.3)  # the least distance of the point from a face on its way
    np.testing.assert_allclose(edit.exact_warp.to_deformed(np.zeros((1, 3))).points, [[0.3, 0, 0]], atol=1e-6)
    check(edit, 0, 2000)


@pytest.mark.parametrize("name", FALLOFF_CURVES)
def test_a_kink_of_the_falloff_costs_the_integration_little(name: str) -> None:
    """Against steps 16 times shorter. With the steps of smooth curves linear errs by 1e-3 here."""
    edit = Edit.points([(0, 0, 0)], radius=0.5, falloff=name, outer=OUTER).translate((0.7, 0, 0))
    assert isinstance(edit, Continuous)
    flow = edit.exact_warp.shell
    assert isinstance(flow, FreeFormFlow)
    rng = np.random.default_rng(0)
    p = np.concatenate([handle + rng.uniform(-0.7, 0.7, (300, 3)) for handle in edit.deformed.handles])
    fine = flow.with_strain(flow.strain / 16.0)
    for one, other in ((flow.to_canonical, fine.to_canonical), (flow.to_deformed, fine.to_deformed)):
        assert np.abs(one(p)[0] - other(p)[0]).max() < 1e-4


def test_short_steps_at_a_kink_refuse_no_drag_that_long_steps_allow() -> None:
    edit = Edit.points([(0, 0, 0)], radius=0.05, falloff="linear", outer=OUTER).translate((2.5, 0, 0))
    assert isinstance(edit, Continuous)
    flow = edit.exact_warp.shell
    assert isinstance(flow, FreeFormFlow)
    coarse = flow.with_strain(EXACT_STEP_STRAIN)
    assert len(coarse.knots) > 200 and coarse.problem() is None
    assert flow.problem() is None and len(coarse.knots) < len(flow.knots) <= MAX_PROVEN_STEPS + 1


def test_points_that_go_through_each_other_are_refused() -> None:
    edit = Edit.points([[0, 0, 0], [1, 0, 0]], radius=0.5).move_point(0, (2.0, 0, 0))
    assert not edit.is_possible
    with pytest.raises(ValueError, match="0 and 1 go through each other on their way"):
        edit.check()
    assert 0.4 < edit.safe_fraction() <= 0.5
    aside = Edit.points([[0, 0, 0], [1, 0, 0]], radius=0.5).move_point(0, (2.0, 0.2, 0))
    check(aside, 0, 500)


def test_a_point_close_to_the_outer_cage_is_refused() -> None:
    outer = Cage.box((0, 0, 0), 1.0)
    edit = Edit.points([[0, 0, 0]], radius=0.5, outer=outer).translate((0.4999, 0, 0))
    with pytest.raises(ValueError, match=r"a control point comes to within 0\.0001 of the outer cage"):
        edit.check()
    gone = Edit.points([[0, 0, 0]], radius=0.5, outer=outer).translate((0.6, 0, 0))
    message = r"control point 0 at \(0.6, 0, 0\) is 0.1 outside face \+x; 0.82 of this translation"
    with pytest.raises(ValueError, match=message):
        gone.check()


def test_distances_are_measured_before_the_linear_map() -> None:
    start = ControlPoints([[0, 0, 0]], 0.5)
    velocity = ControlPointVelocity(start, start.scale((2.0, 1.0, 1.0)), OUTER)
    at = np.array([[0.9, 0, 0], [0, 0.55, 0]])
    assert (np.linalg.norm(velocity.at(at, 1.0)[0], axis=1) > 0.0).tolist() == [True, False]
