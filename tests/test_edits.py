from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given

from cagefield.edits import (
    Edit,
    EditStack,
    Flow,
    Rotate,
    Scale,
    Shear,
    ShellSettings,
    Translate,
    Trilinear,
    parse_edits,
    shell_kind,
)
from cagefield.errors import EditError
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from random_cages import edits, examples, seeds, unit_vectors

INNER, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)
AXES = np.eye(3)


def points(n: int = 2000, reach: float = 1.2, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-reach, reach, (n, 3))


def continuous() -> Edit:
    return (
        Edit.continuous(INNER, OUTER, shell=Trilinear())
        .rotate((0.2, 0.1, 0.3))
        .move_corner(7, (0.1, 0.1, 0.05))
    )


@examples(15)
@given(edits(), seeds)
def test_regions_of_a_continuous_edit(edit: Edit, seed: int) -> None:
    assert edit.outer is not None
    stack = EditStack([edit])
    rng = np.random.default_rng(seed)
    low, high = edit.outer.aabb
    p = low + rng.uniform(-0.2, 1.2, (400, 3)) * (high - low)
    p = np.concatenate([p, hexahedron.points(edit.deformed.corners, rng.random((100, 3)))])
    c = stack.to_canonical(p)
    outside = ~edit.outer.contains(p)
    assert np.array_equal(c.points[outside], p[outside])  # bit for bit
    assert np.array_equal(c.jacobian[outside], np.broadcast_to(AXES, (outside.sum(), 3, 3)))
    u, inside = edit.deformed.coordinates(p)
    assert inside[-100:].all()
    worst = np.linalg.norm(c.jacobian, axis=(1, 2)).max()
    # Exact inside: phi keeps the trilinear coordinates.
    expected = hexahedron.points(edit.inner.corners, u[inside])
    np.testing.assert_allclose(c.points[inside], expected, atol=1e-12 * worst)
    assert not c.emptied.any()
    assert (np.linalg.det(c.jacobian) > 0.0).all()
    back = stack.to_deformed(c.points)
    np.testing.assert_allclose(back.points, p, atol=1e-11 * worst**2)
    np.testing.assert_allclose(back.jacobian @ c.jacobian, np.tile(AXES, (len(p), 1, 1)), atol=1e-6 * worst)


def test_directions_and_stretch_against_finite_differences() -> None:
    stack = EditStack([continuous(), continuous().replace(inner=INNER.translate((0.1, 0, 0)))])
    rng = np.random.default_rng(1)
    p, d = points(), unit_vectors(rng, 2000)
    h = 1e-6
    c = stack.to_canonical(p, d)
    assert c.viewdirs is not None and c.stretch is not None
    ahead, behind = stack.to_canonical(p + h * d), stack.to_canonical(p - h * d)
    slope = (ahead.points - behind.points) / (2.0 * h)
    error = np.abs(slope - c.stretch[:, None] * c.viewdirs).max(axis=1)
    # Rounding 1e-16 / h and truncation; a few points straddle a face, where the derivative jumps.
    assert np.quantile(error, 0.99) < 1e-8
    np.testing.assert_allclose(np.linalg.norm(c.viewdirs, axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(c.stretch, np.linalg.norm(np.einsum("nij,nj->ni", c.jacobian, d), axis=1))
    doubled = stack.to_canonical(p, 2.0 * d)
    np.testing.assert_allclose(doubled.stretch, c.stretch, rtol=1e-12)  # |J d| is for unit d


def test_move_has_four_regions() -> None:
    edit = Edit.move(INNER).translate((0.3, 0, 0))
    p = points(5000)
    c = EditStack([edit]).to_canonical(p)
    in_v = (np.abs(p - (0.3, 0, 0)) <= 0.3).all(axis=1)
    in_source = (np.abs(p) <= 0.3).all(axis=1)
    np.testing.assert_allclose(c.points[in_v], p[in_v] - (0.3, 0, 0), atol=1e-15)
    assert np.array_equal(c.points[~in_v], p[~in_v])
    assert np.array_equal(c.emptied, in_source & ~in_v)
    forward = EditStack([edit]).to_deformed(p)
    np.testing.assert_allclose(forward.points[in_source], p[in_source] + (0.3, 0, 0), atol=1e-15)
    assert np.array_equal(forward.points[~in_source], p[~in_source])
    assert np.array_equal(forward.hidden, in_v & ~in_source)


def test_copy_keeps_the_source() -> None:
    edit = Edit.copy(INNER).translate((0.9, 0, 0)).scale(0.5)
    p = points(5000)
    c = EditStack([edit]).to_canonical(p)
    in_v = (np.abs(p - (0.9, 0, 0)) <= 0.15).all(axis=1)
    np.testing.assert_allclose(c.points[in_v], 2.0 * (p[in_v] - (0.9, 0, 0)), atol=1e-15)
    assert np.array_equal(c.points[~in_v], p[~in_v]) and not c.emptied.any()
    np.testing.assert_array_equal(edit.boxes, [edit.deformed.aabb])


def test_delete_empties_the_cage() -> None:
    bent = INNER.move_corner(0, (-0.2, -0.2, 0))
    p = points(5000)
    stack = EditStack([Edit.delete(bent, name="gone")])
    c = stack.to_canonical(p)
    assert np.array_equal(c.emptied, bent.contains(p)) and c.emptied.any()
    assert np.array_equal(c.points, p)
    assert np.array_equal(stack.to_deformed(p).hidden, c.emptied)


def test_stacks_compose_last_edit_first() -> None:
    first = continuous()
    second = Edit.move(Cage.box((0.2, 0, 0), 0.4)).rotate((0, 0, 0.5)).translate((0, 0.3, 0))
    p = points(3000)
    d = unit_vectors(np.random.default_rng(2), 3000)
    both = EditStack([first, second]).to_canonical(p, d)
    after = EditStack([second]).to_canonical(p, d)
    before = EditStack([first]).to_canonical(after.points, after.viewdirs)
    kept = ~after.emptied
    assert after.viewdirs is not None and before.stretch is not None and after.stretch is not None
    assert np.array_equal(both.emptied, after.emptied)
    np.testing.assert_allclose(both.points[kept], before.points[kept], atol=1e-15)
    np.testing.assert_allclose(both.viewdirs[kept], before.viewdirs[kept], atol=1e-13)
    np.testing.assert_allclose(both.stretch[kept], (before.stretch * after.stretch)[kept], atol=1e-13)
    np.testing.assert_allclose(both.jacobian[kept], (before.jacobian @ after.jacobian)[kept], atol=1e-13)
    forward = EditStack([first, second]).to_deformed(p)
    step = EditStack([second]).to_deformed(EditStack([first]).to_deformed(p).points)
    np.testing.assert_allclose(forward.points, step.points, atol=1e-15)


def test_round_trip_through_a_chain() -> None:
    chain = EditStack(
        [
            continuous(),
            Edit.continuous(INNER, OUTER, shell=Trilinear()).scale((1.3, 0.8, 1)),
            Edit.continuous(OUTER, OUTER.grown(0.5)).translate((0, 0.2, 0)),
        ]
    )
    p = points(2000, reach=1.5)
    c = chain.to_canonical(p)
    back = chain.to_deformed(c.points)
    np.testing.assert_allclose(back.points, p, atol=1e-12)
    assert not np.array_equal(c.points, p)


def test_hidden_edits_and_edits_that_change_nothing_are_passed_over() -> None:
    p = points(100)
    folded = Edit.continuous(INNER, OUTER, shell=Trilinear()).rotate((0, 0, 2.0))
    nothing = Edit.continuous(INNER, OUTER, shell=Trilinear())
    stack = EditStack([folded.replace(enabled=False), nothing])
    assert stack.active == () and np.array_equal(stack.to_canonical(p).points, p)
    assert np.array_equal(stack.bounds, [[np.inf] * 3, [-np.inf] * 3]) and stack.boxes.shape == (0, 2, 3)
    assert not Edit.move(INNER).changes_anything


def test_boxes_hold_everything_that_changes() -> None:
    move = Edit.move(INNER).translate((2, 0, 0))
    assert np.array_equal(move.boxes, [move.deformed.aabb, INNER.aabb])
    np.testing.assert_allclose(move.bounds, [(-0.3, -0.3, -0.3), (2.3, 0.3, 0.3)])
    stack = EditStack([continuous(), move])
    assert np.array_equal(stack.bounds, [(-0.8, -0.8, -0.8), (2.3, 0.8, 0.8)])
    p = points(4000, reach=2.5)
    c = stack.to_canonical(p)
    changed = (c.points != p).any(axis=1) | c.emptied
    in_boxes = np.zeros(len(p), dtype=bool)
    for low, high in stack.boxes:
        in_boxes |= ((p >= low) & (p <= high)).all(axis=1)
    assert changed.any() and not (changed & ~in_boxes).any()


def test_operations_are_recorded_and_return_new_edits() -> None:
    start = Edit.continuous(INNER, OUTER, shell=Trilinear())
    edit = start.translate((0.1, 0, 0)).rotate((0, 0, np.radians(30.0))).scale(1.2).shear(xy=0.1)
    assert start.operations == ()
    assert edit.operations == (
        Translate((0.1, 0.0, 0.0)),
        Rotate((0.0, 0.0, 30.0)),
        Scale((1.2, 1.2, 1.2)),
        Shear(xy=0.1),
    )
    expected = INNER.translate((0.1, 0, 0)).rotate((0, 0, np.radians(30.0))).scale(1.2).shear(xy=0.1)
    assert edit.deformed == expected
    dragged = start.move_corner(7, (0.1, 0, 0)).move_edge((0, 1), (0, 0.1, 0)).move_face("+z", (0, 0, 0.1))
    by_hand = INNER.move_corner(7, (0.1, 0, 0)).move_edge((0, 1), (0, 0.1, 0)).move_face("+z", (0, 0, 0.1))
    assert dragged.deformed == by_hand


def test_parts_of_operations() -> None:
    half = Rotate((30.0, 40.0, 50.0)).part(0.5)
    twice = half.apply(half.apply(INNER))
    np.testing.assert_allclose(twice.corners, Rotate((30.0, 40.0, 50.0)).apply(INNER).corners, atol=1e-14)
    assert Translate((1, 2, 3)).part(0.5) == Translate((0.5, 1, 1.5))
    np.testing.assert_allclose(Scale((4, 1, 0.25)).part(0.5).by, (2, 1, 0.5))
    assert Shear(xy=0.4).part(0.5) == Shear(xy=0.2)


@pytest.mark.parametrize(
    ("operation", "fraction"),
    [
        (Translate((1.0, 0, 0)), 0.5),  # the gap is .5
        (Scale((4.0, 4.0, 4.0)), np.log(0.8 / 0.3) / np.log(4.0)),
        (Translate((0.4, 0, 0)), 1.0),
    ],
)
def test_safe_fraction_has_a_closed_form_for_boxes(operation: object, fraction: float) -> None:
    # Folding needs the last 1e-3 of the gap (LEAST_RATIO), bisection stops at 1e-3.
    edit = Edit.continuous(INNER, OUTER, shell=Trilinear())
    assert edit.safe_fraction(operation) == pytest.approx(fraction, abs=2.5e-3)  # type: ignore[arg-type]
    assert edit.safe_fraction(operation) <= fraction  # type: ignore[arg-type]
    after = edit.then(operation.part(edit.safe_fraction(operation)))  # type: ignore[arg-type, attr-defined]
    after.check()


def test_safe_fraction_counts_from_where_the_edit_is() -> None:
    edit = Edit.continuous(INNER, OUTER, shell=Trilinear()).translate((0.25, 0, 0))
    assert edit.safe_fraction(Translate((0.5, 0, 0))) == pytest.approx(0.5, abs=2.5e-3)
    assert (
        edit.safe_fraction() == 1.0
        and Edit.continuous(INNER, OUTER, shell=Trilinear()).safe_fraction() == 1.0
    )
    assert edit.translate((0.5, 0, 0)).safe_fraction() == pytest.approx(0.5, abs=2.5e-3)
    assert Edit.continuous(INNER, OUTER, shell=Trilinear()).rotate((0, 0, 2 * np.pi)).safe_fraction() == 1.0


def test_folded_shells_are_errors_that_say_what_is_safe() -> None:
    edit = Edit.continuous(INNER, OUTER, shell=Trilinear(), name="arm").rotate((0, 0, np.radians(60)))
    message = r'edit "arm": the trilinear shell folds at side .*; 0\.49 of this rotation \(operation 1, by'
    for evaluate in (
        edit.check,
        lambda: EditStack([edit]).to_canonical(points(10)),
        lambda: EditStack([edit]).to_deformed(points(10)),
        EditStack([edit]).check,
    ):
        with pytest.raises(EditError, match=message + r".*enlarge the outer cage, or make the edit discrete"):
            evaluate()
    EditStack([edit.replace(allow_folding=True)]).to_canonical(points(200))
    Edit.move(edit.inner, operations=edit.operations).check()


def test_the_message_names_the_operation_that_went_too_far() -> None:
    edit = Edit.continuous(INNER, OUTER, shell=Trilinear()).translate((0.7, 0, 0)).translate((-0.6, 0, 0))
    edit.check()  # only the result counts
    edit = (
        Edit.continuous(INNER, OUTER, shell=Trilinear())
        .rotate((0, 0, 0.1))
        .translate((0.6, 0, 0))
        .rotate((0, 0, 0.1))
    )
    with pytest.raises(
        EditError, match=r"0\.69 of this translation \(operation 2, by \(0.6, 0, 0\)\) is safe"
    ):
        edit.check()


def test_an_inner_cage_that_leaves_the_outer_is_an_error() -> None:
    edit = Edit.continuous(INNER, OUTER, shell=Trilinear(), name="arm").translate((0.6, 0, 0))
    message = (
        r'edit "arm": outer cage must contain the inner cage: inner corner \d at \(0\.9, .*\) is 0\.1 outside'
        r" face \+x; 0\.83 of this translation .* is safe; enlarge the outer cage or make"
        " the edit discrete"
    )
    with pytest.raises(EditError, match=message):
        edit.check()
    with pytest.raises(EditError, match=r"inner corner . at .* is 0.2 outside face -z; enlarge"):
        Edit.continuous(INNER.translate((0, 0, -0.7)), OUTER).check()
    with pytest.raises(EditError, match="is folded before any operation, at side -z: leave a gap"):
        Edit.continuous(INNER.translate((0, 0, -0.5)), OUTER, shell=Trilinear()).translate(
            (0, 0, 0.1)
        ).check()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Edit.continuous(INNER, None), "a continuous edit needs an outer cage.*grown"),
        (
            lambda: Edit.continuous(INNER, OUTER, shell=shell_kind("cubic")),
            'shell must be one of flow, trilinear, got "cubic"',
        ),
        (
            lambda: Edit.continuous(INNER, OUTER, shell=shell_kind("x" * 999)),
            f'shell must be one of [a-z, ]*, got "{"x" * 40}"',
        ),
        (lambda: Edit.continuous(INNER, OUTER, shell="flow"), r"shell must be Flow\(...\) or Trilinear\(\)"),
        (lambda: Edit.delete(INNER).translate((1, 0, 0)), "a delete has no operations"),
        (
            lambda: Edit.continuous(INNER, OUTER, shell=Trilinear(), lattice=1),
            "lattice must be None .* from 2 to 512 .*got 1",
        ),
        (lambda: Edit.continuous(INNER, OUTER, shell=Trilinear(), lattice=64.0), r"got 64\.0"),
        (
            lambda: Edit.continuous(INNER, OUTER, shell=Trilinear(), name="arm").move_corner(7, (-2, -2, -2)),
            'edit "arm": operation 1, corner move of corner 7 .*inside out at corner 7 .*0.09 of it is safe',
        ),
        (lambda: EditStack([INNER]), "item 0 is a Cage"),
        (lambda: EditStack().to_canonical(np.zeros((3, 2))), r"points must have shape \[N,3\], got \[3, 2\]"),
        (
            lambda: EditStack().to_canonical(np.zeros((3, 3)), np.zeros((2, 3))),
            r"viewdirs must have the shape of points, \[3, 3\], got \[2, 3\]",
        ),
    ],
)
def test_impossible_edits(make, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(EditError, match=message):
        make()


def test_stacks_are_edited_by_making_new_ones() -> None:
    a, b, c = (Edit.delete(INNER.translate((x, 0, 0)), name=str(x)) for x in range(3))
    stack = EditStack([a, b])
    assert stack.append(c).edits == (a, b, c) and stack.edits == (a, b)
    assert stack.set(0, c).edits == (c, b) and stack.remove(0).edits == (b,)
    assert stack.append(c).move(2, 0).edits == (c, a, b)
    assert len(stack) == 2 and list(stack) == [a, b] and stack[1] == b


def test_empty_input() -> None:
    c = EditStack([continuous()]).to_canonical(np.zeros((0, 3)), np.zeros((0, 3)))
    assert c.points.shape == (0, 3) and c.jacobian.shape == (0, 3, 3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Edit.continuous(INNER, OUTER, shell=Flow(falloff="steep")),
            'falloff must be one of smooth, linear, got "steep"',
        ),
        (
            lambda: Edit.continuous(INNER, OUTER, shell=Flow(width=0.0)),
            r"width must be above 0 and at most 1 .*got 0\.0",
        ),
        (
            lambda: parse_edits(
                "edits: [{inner: {center: [0, 0, 0], size: 1}, outer: {margin: 1}, shell: trilinear,"
                " width: .5}]"
            ),
            'width is an option of the flow shell, and a trilinear shell has none; set shell="flow"',
        ),
        (
            lambda: Edit.move(INNER, unused_shell=ShellSettings(shell=Flow(falloff="linear"))),
            "falloff is an option of the flow shell, and a discrete edit has none",
        ),
    ],
)
def test_falloff_belongs_to_the_flow_shell(make: Callable[[], Edit], message: str) -> None:
    with pytest.raises(EditError, match=message):
        make()
    assert Edit.continuous(INNER, OUTER).shell == Flow()
    assert (
        Edit.continuous(INNER, OUTER, shell=Flow(falloff="linear", width=0.5)).rotate((0, 0, 0.3)).warp
        is not None
    )
