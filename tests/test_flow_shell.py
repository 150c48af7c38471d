"""The flow shell's float64 reference: exact at both cages, one to one between them, for all cages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from cagefield.edits import Edit, EditStack, Flow
from cagefield.edits.operations import Operation, Rotate, Scale, Shear, Translate
from cagefield.edits.safe_fraction import along, flow_reach, largest_safe
from cagefield.errors import CageError, EditError
from cagefield.geometry.cage import Axes, Cage
from cagefield.typing import Array
from cagefield.warps import Falloff
from cagefield.warps.cage_motion import TIMES
from cagefield.warps.extended_coordinates import Extended, straightened_slope
from cagefield.warps.trilinear_bend import bends_one_to_one, forms, stay_one_to_one
from flow_edits import EDITS, INNER, OUTER, flow_edits, shell_of, shell_points
from random_cages import examples, random_operation, seeds
from tiers import nightly_except

TWISTED = Cage(
    np.array(
        [
            [0.09, -0.79, -0.48],
            [0.01, -0.68, 0.12],
            [-0.58, 0.04, -0.71],
            [0.58, 0.14, -0.67],
            [-0.54, -0.04, 0.23],
            [0.1, -0.3, 0.23],
            [-0.72, -0.15, -0.14],
            [0.32, 0.78, 0.02],
        ]
    )
)


def face_points(cage: Cage, n: int, seed: int = 0) -> tuple[Array, Array]:
    """(points on the cage's faces, their xi)."""
    rng = np.random.default_rng(seed)
    xi = rng.uniform(-1.0, 1.0, (n, 3))
    xi[np.arange(n), rng.integers(3, size=n)] = rng.choice([-1.0, 1.0], n)
    return Extended.from_cage(cage).points(xi), xi


def check_map(edit: Edit, n: int = 80, tolerance: float = 2e-5) -> None:
    """Every promise of the shell, at random points; the tolerance is for the inner cage's faces."""
    shell = shell_of(edit)
    scene = np.ptp(shell.outer.corners, axis=0).max()
    p = shell_points(shell, n)
    q, J = shell.to_canonical(p)
    det = np.linalg.det(J)
    assert det.min() > 0.0 and np.isfinite(det).all()
    # The round trip closes to rounding, times the stretch on the way (up to some thousands in a small gap).
    back, inverse = shell.to_deformed(q)
    assert np.abs(back - p).max() < 1e-7 * scene
    np.testing.assert_allclose(inverse @ J, np.broadcast_to(np.eye(3), J.shape), atol=1e-5)
    # On the inner cage's faces it is phi, up to the integration's error: the aim is 1e-4 of the scene.
    on_inner, xi = face_points(shell.deformed, 60)
    expected = Extended.from_cage(shell.inner).points(xi)
    assert np.abs(shell.to_canonical(on_inner)[0] - expected).max() < tolerance * scene
    # On the outer cage's it is the identity, up to the rounding of where the face is.
    on_outer, _ = face_points(shell.outer, 60)
    assert np.abs(shell.to_canonical(on_outer)[0] - on_outer).max() < 1e-12 * scene
    # It maps the shell into the shell.
    assert shell.outer.grown(1e-9 * scene).contains(q).all()
    assert not Cage(shell.inner.center + 0.999 * (shell.inner.corners - shell.inner.center)).contains(q).any()


@pytest.mark.parametrize(
    "name", nightly_except(EDITS, "bent cages", "corner after rotation", "bent far", "turn in a slot")
)
def test_map_of_named_edits(name: str) -> None:
    EDITS[name].check()
    # The linear profile has a kink on the faces, which costs two orders. A corner dragged deep into its cage
    # is squeezed, which the steps are not made for.
    check_map(EDITS[name], tolerance={"linear, half": 2e-4, "bent far": 5e-5}.get(name, 2e-5))


@examples(6)
@given(flow_edits())
def test_map_of_random_edits(edit: Edit) -> None:
    check_map(edit, 20)


@pytest.mark.parametrize("name", ["turn of 90", "bent cages", "linear, half"])
def test_jacobian_is_that_of_the_scheme(name: str) -> None:
    shell = shell_of(EDITS[name])
    p = shell_points(shell, 60)
    h = 1e-6
    slopes = [
        (shell.to_canonical(p + h * e)[0] - shell.to_canonical(p - h * e)[0]) / (2 * h) for e in np.eye(3)
    ]
    J = shell.to_canonical(p)[1]
    error = np.abs(np.stack(slopes, axis=2) - J).max(axis=(1, 2))
    # Central differences are good to h^2; the few points whose way runs along a kink see h times its jump.
    assert np.quantile(error, 0.95) < 1e-7 and error.max() < 1e-3


def test_map_against_another_integrator() -> None:
    # The velocity written out for a turn by 1 about z, and scipy's eighth-order method.
    a, half, big = 1.0, 0.3, 0.8

    def velocity(t: float, x: Array) -> Array:
        c, s = np.cos(a * t), np.sin(a * t)
        y = np.array([c * x[0] + s * x[1], c * x[1] - s * x[0], x[2]])
        d_i = np.linalg.norm(np.maximum(np.abs(y) - half, 0.0), 4)
        d_o = 1.0 / np.linalg.norm(2.0 * big / (big**2 - x * x), 4)
        r = d_o / (d_i + d_o)
        w = end * r + (1 - end * 17 / 18) * r * r * (3 - 2 * r) - end / 18 * max(2 * r - 1, 0) ** 9
        return a * w * np.array([-x[1], x[0], 0.0])

    # The corners of the turned square come nearer to the faces.
    gap, before = big - half * (np.cos(a) + np.sin(a)), big - half
    end = 0.95 - 0.45 * (gap / before) ** (1 / 0.8)

    shell = shell_of(Edit.continuous(INNER, OUTER).rotate((0, 0, a)), strain=0.01)
    p = shell_points(shell, 12)
    q, _ = shell.to_canonical(p)
    for x, expected in zip(p, q, strict=True):
        found = solve_ivp(velocity, (1.0, 0.0), x, method="DOP853", rtol=1e-10, atol=1e-12, max_step=0.01)
        np.testing.assert_allclose(found.y[:, -1], expected, atol=1e-7)


def test_order_of_convergence() -> None:
    # A translation along the diagonal: no point's way crosses a kink of the distances more than once.
    edit = Edit.continuous(INNER, OUTER).translate((0.3, 0.25, 0.2)).scale(1.2)
    p = shell_points(shell_of(edit), 400)
    maps = [shell_of(edit, strain=s).to_canonical(p)[0] for s in (0.4, 0.2, 0.1, 0.0125)]
    errors = [np.median(np.linalg.norm(m - maps[-1], axis=1)) for m in maps[:-1]]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # The number of steps is a whole one, so halving the strain is not quite halving the steps.
    assert (orders > 3.4).all() and (orders < 4.8).all()


@pytest.mark.parametrize("name", ["turn of 90", "bent cages"])
def test_continuous_across_both_cages(name: str) -> None:
    edit = EDITS[name]
    shell = shell_of(edit)
    warp = edit.warp
    for cage, tolerance in ((shell.deformed, 1e-5), (shell.outer, 1e-6)):
        _, xi = face_points(cage, 200)
        place = Extended.from_cage(cage)
        inside, outside = place.points(xi * (1 - 1e-7)), place.points(xi * (1 + 1e-7))
        jump = np.abs(warp.to_canonical(inside).points - warp.to_canonical(outside).points)
        # 1e-7 of a distance times the stretch, and at the inner cage the integration's error.
        assert jump.max() < tolerance
    outside = 2.0 * shell_points(shell, 300)
    outside = outside[~shell.outer.contains(outside)]
    assert np.array_equal(warp.to_canonical(outside).points, outside)


@pytest.mark.parametrize("edit", [EDITS["turn in a slot"], EDITS["bent cages"], EDITS["turn of 180"]])
def test_cage_stays_inside_the_outer_cage_all_the_way(edit: Edit) -> None:
    motion = shell_of(edit).motion
    times = np.linspace(0.0, 1.0, 301)
    c, F, *_ = motion.frames(times)
    _, xi = face_points(edit.deformed, 40)
    for n, t in enumerate(times):
        assert motion.outer.contains(Extended(c[n], F[n], motion.bend(t)).points(xi)).all()
    first, last = Extended(c[0], F[0], motion.bend(0)), Extended(c[-1], F[-1], motion.bend(1))
    np.testing.assert_allclose(first.points(xi), Extended.from_cage(edit.inner).points(xi), atol=1e-12)
    np.testing.assert_allclose(last.points(xi), Extended.from_cage(edit.deformed).points(xi), atol=1e-12)


def test_a_rod_in_a_slot_turns_by_shrinking_just_enough() -> None:
    motion = shell_of(EDITS["turn in a slot"]).motion
    assert motion.shrink > 0.3
    assert motion.gap(TIMES, 0.0).min() < 0.0 < motion.gap(TIMES, motion.shrink).min()
    assert shell_of(EDITS["turn of 180"]).motion.shrink == 0.0


def test_rates_are_the_derivatives_of_the_motion() -> None:
    for edit in (EDITS["turn in a slot"], EDITS["bent cages"], EDITS["corner after rotation"]):
        motion = shell_of(edit).motion
        t, h = np.array([0.2, 0.7]), 1e-6
        before, after, here = motion.frames(t - h), motion.frames(t + h), motion.frames(t)
        np.testing.assert_allclose((after[0] - before[0]) / (2 * h), here[2], atol=1e-8)
        np.testing.assert_allclose((after[1] - before[1]) / (2 * h), here[3], atol=1e-7)
        z, dz = motion.surface
        later, earlier = (motion.faces(TIMES + by, motion.shrink, enough=1e-14) for by in (h, -h))
        np.testing.assert_allclose((later - earlier) / (2 * h), dz, atol=1e-6)
        np.testing.assert_allclose(0.5 * (later + earlier), z, atol=1e-6)


def test_translation_and_scale_keep_less_than_a_folding_share() -> None:
    # Figures of benchmarks/flow_profiles.py: a change of the weight that squeezes more shows here.
    for name, least in (("turn of 90", 0.27), ("turn of 180", 0.12), ("scale 2.4", 0.08), ("shear", 0.4)):
        assert shell_of(EDITS[name]).least_ratio() > least


def test_weights_fade_from_one_to_nothing() -> None:
    g = np.linspace(0.0, 1.0, 201)[1:]
    q = 1.0 / g - 1.0
    h = 1e-6
    for profile in ("smooth", "linear"):
        for change in (0.0, 0.7, 5.0):
            falloff = Falloff(profile)
            ab = falloff.coefficients(change)
            w, slope = falloff.weight(q, ab)
            assert w[-1] == pytest.approx(1.0, abs=1e-15) and (np.diff(w) > 0.0).all()
            # Central differences, of a slope that jumps at the inner cage where the profile is linear.
            below, above = (falloff.weight(q[:-1] + s * h * q[:-1], ab)[0] for s in (-1.0, 1.0))
            np.testing.assert_allclose((above - below) / (2 * h * q[:-1]), slope[:-1], rtol=1e-6, atol=1e-8)
            assert falloff.weight(np.array([1e9]), ab)[0] == pytest.approx(1e-9 * ab[0], rel=1e-6)
            assert slope[-1] == pytest.approx(0.0 if profile == "smooth" else -1.0, abs=1e-12)


def test_the_more_a_gap_changes_the_nearer_to_linear_is_the_weight() -> None:
    turn = EDITS["turn of 180"]
    assert shell_of(turn).coefficients[0] == pytest.approx(0.5, abs=1e-12)
    assert shell_of(turn.replace(shell=Flow("linear"))).coefficients == (1.0, 0.0)
    # A tenth of the gap is left: 0.95 - 0.45 e^(-log 10 / 0.8).
    push = shell_of(EDITS["translation by 90% of the gap"])
    assert push.coefficients[0] == pytest.approx(0.95 - 0.45 * 10.0 ** (-1.0 / 0.8), rel=1e-9)
    # In the middle of the face ahead, the shell is squeezed evenly by 10 at best; by g^2 (3 - 2 g), 27 times.
    z = np.linspace(0.751, 0.799, 40)
    J = push.to_canonical(np.stack([z, 0.0 * z, 0.0 * z], axis=1))[1]
    assert 9.0 < J[:, 0, 0].max() < 13.5


def test_width_one_moves_all_of_the_shell_and_less_moves_less() -> None:
    p = shell_points(shell_of(EDITS["turn of 90"]), 600)
    moved = []
    for width in (1.0, 0.5, 0.1):
        edit = Edit.continuous(INNER, OUTER, shell=Flow(width=width)).rotate((0, 0, 0.3))
        q = shell_of(edit).to_canonical(p)[0]
        moved.append((np.abs(q - p).max(axis=1) > 0.0).mean())
    assert moved[0] == 1.0 > moved[1] > 2.0 * moved[2] > 0.0


def test_turns_beyond_180_degrees_are_their_shorter_turn() -> None:
    p = shell_points(shell_of(EDITS["turn of 90"]), 50)
    long = shell_of(Edit.continuous(INNER, OUTER).rotate((0, 0, 1.6 * np.pi))).to_canonical(p)[0]
    short = shell_of(Edit.continuous(INNER, OUTER).rotate((0, 0, -0.4 * np.pi))).to_canonical(p)[0]
    np.testing.assert_allclose(long, short, atol=1e-9)


def test_stacks_go_both_ways() -> None:
    small = Edit.continuous(
        Cage.box((0.5, 0.5, 0.5), 0.2), Cage.box((0.5, 0.5, 0.5), 0.7)
    )  # in the other's outer cage
    across = Edit.continuous(Cage.box((0.9, 0, 0), 0.5), Cage.box((0.9, 0, 0), 1.2))  # overlaps it
    turned = EDITS["turn of 90"]
    chain = [turned, small.rotate((0, 2, 0)), across.translate((0.2, 0.1, 0))]
    chain += [EDITS["corner after rotation"].scale(0.9), small.translate((0, 0.1, -0.1)), EDITS["shear"]]
    chain += [turned.scale(1.2), across.rotate((1, 0, 0)), small.scale(1.5), EDITS["bent cages"]]
    stack = EditStack(chain)
    p = np.random.default_rng(0).uniform(-1.2, 1.6, (60, 3))
    there = stack.to_canonical(p)
    back = stack.to_deformed(there.points)
    # Steps of ten maps, each stretching by up to ten: rounding and the kept 1e-13 of each, multiplied.
    assert np.abs(back.points - p).max() < 1e-6
    np.testing.assert_allclose(back.jacobian @ there.jacobian, np.tile(np.eye(3), (60, 1, 1)), atol=1e-3)
    assert np.linalg.det(there.jacobian).min() > 0.0


PROBLEMS = [
    (
        Edit.continuous(INNER, INNER.grown(1e-4)),
        "the flow shell has no room before any operation: the gap .* half-width",
    ),
    (
        Edit.continuous(INNER, OUTER).translate((0.4999, 0, 0)),
        r"the flow shell has no room: .* at least 0\.002 on every side; 0\.99 of this translation",
    ),
    (
        Edit.continuous(INNER, OUTER).translate((0.6, 0, 0)),
        "outer cage must contain the inner cage: inner corner 1",
    ),
    (
        # The outer cage's top is a saddle; the turned cage's corners lie on its level lines, not its edges.
        Edit.continuous(
            Cage.box((0, 0, 0), 0.6, (0, 0, np.pi / 4)),
            OUTER.move_corner(5, (0, 0, -0.6)).move_corner(6, (0, 0, -0.6)),
        ).translate((0, 0, 0.19)),
        "the flow shell is left by the inner cage: it bulges through the outer cage between its corners",
    ),
    (
        # One cage with a corner at its opposite edge becomes another.
        Edit.continuous(INNER.move_corner(2, (-0.05, -0.59, 0.02)), OUTER.grown(1.0))
        .move_corner(2, (0.05, 0.59, -0.02))
        .move_corner(0, (0.29, 0.58, -0.53)),
        "the flow shell cannot follow the inner cage: it is bent too far",
    ),
    (
        Edit.continuous(TWISTED, OUTER.grown(1.0)),
        "the flow shell cannot surround the inner cage: it is bent too far before any operation",
    ),
]


@pytest.mark.parametrize(("edit", "message"), PROBLEMS)
def test_problems_are_named(edit: Edit, message: str) -> None:
    with pytest.raises(EditError, match=message):
        edit.check()


def test_bends_that_are_one_to_one_have_a_positive_determinant_everywhere() -> None:
    rng = np.random.default_rng(0)
    K = rng.uniform(-1.0, 1.0, (60, 4, 3)) * rng.uniform(0.1, 0.9, (60, 1, 1))
    g = np.linspace(-1.3, 1.3, 27)  # -1 and 1 among them, where the least values are, beyond the faces
    xi = np.stack(np.meshgrid(g, g, g), axis=-1).reshape(-1, 3)
    xi = np.concatenate([xi, xi * (1.0 - 1e-9)])
    least = np.array([np.linalg.det(straightened_slope(k, xi)).min() for k in forms(K)])
    found = bends_one_to_one(K)
    assert 10 < found.sum() < 50
    assert (least[found] > 0.0).all()
    # A grid misses the least value inside the cage by a little.
    assert (least[~found] < 0.02).all()


def test_bends_that_stay_one_to_one() -> None:
    rng = np.random.default_rng(1)
    K = rng.uniform(-0.5, 0.5, (80, 4, 3)) * rng.uniform(0.1, 1.0, (80, 1, 1))
    expected = [all(bends_one_to_one((t * k)[None])[0] for t in (0.25, 0.5, 0.75, 1.0)) for k in K]
    assert np.array_equal(stay_one_to_one(np.zeros((4, 3)), K), expected)
    assert 10 < np.sum(expected) < 70


def bisected(edit: Edit, operation: Operation) -> float:
    """The safe fraction by nothing but `check`."""

    def safe(t: float) -> bool:
        try:
            edit.then(operation.part(t)).check()
        except (CageError, EditError):
            return False
        return True

    return largest_safe(safe)


@examples(12)
@given(flow_edits(), st.integers(0, 6), seeds)
def test_safe_fraction_is_that_of_the_checks(edit: Edit, kind: int, seed: int) -> None:
    operation = random_operation(np.random.default_rng(seed), kind, 1.5)
    found, expected = edit.safe_fraction(operation), bisected(edit, operation)
    # Both stop within 1e-3 of the limit; an operation that is unsafe for less than a sixteenth of its way may
    # be cut off there by the one that looks closer.
    assert found <= expected + 1e-3
    if abs(found - expected) > 1e-3:
        edit.then(operation.part(found)).check()
        with pytest.raises(EditError):
            edit.then(operation.part(found + 1e-3)).check()


def test_safe_fraction_where_an_edge_reaches_the_outer_cage_first() -> None:
    # The middle of the outer cage's top sags to z = 0.5 between two raised corners.
    sagging = OUTER.move_corner(5, (0, 0, -0.6)).move_corner(6, (0, 0, -0.6))
    edit = Edit.continuous(Cage.box((0, 0, 0), 0.6, (0, 0, np.pi / 4)), sagging)
    operation = Translate((0, 0, 0.5))
    found = edit.safe_fraction(operation)
    assert found == pytest.approx(bisected(edit, operation), abs=1e-3)
    corners_alone = flow_reach(operation, edit.deformed, (edit.inner, sagging), fine=False)
    assert corners_alone > found + 0.01


@pytest.mark.parametrize("kind", range(7))
@pytest.mark.parametrize("axes", ["world", "cage"])
def test_corners_along_an_operation_are_those_of_its_parts(kind: int, axes: Axes) -> None:
    cage = Cage.box((0.1, 0.2, 0), (0.5, 0.6, 0.7), (0.3, 0.2, 0.1)).move_corner(3, (0.05, 0.02, -0.04))
    operation = random_operation(np.random.default_rng(kind), kind, 0.2)
    if isinstance(operation, (Rotate, Scale, Shear)):
        operation = replace(operation, axes=axes)
    t = np.array([0.0, 0.3, 1.0])
    expected = [operation.part(share).apply(cage).corners for share in t.tolist()]
    np.testing.assert_allclose(along(operation, cage, t), expected, atol=1e-12)


def test_safe_fraction_ends_at_the_outer_cage() -> None:
    edit = Edit.continuous(INNER, OUTER).translate((1.0, 0, 0))
    # The gap of 0.5 less the 0.002 * 0.8 that must stay.
    assert edit.safe_fraction() == pytest.approx(0.5 - 0.002 * 0.8, abs=1.1e-3)
    assert Edit.continuous(INNER, OUTER).rotate((0, 0, np.pi)).safe_fraction() == 1.0
