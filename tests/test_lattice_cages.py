"""Lattice cages: their spline, its inverse, the proof that it does not fold, operations, files."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from cagefield import Cage, Edit, EditStack
from cagefield.edits import Bend, MovePoint, MovePoints, Taper, Twist, dump_edits, parse_edits
from cagefield.errors import CageError, EditError, EditFileError
from cagefield.geometry import bspline_lattice, hexahedron, lattice_determinant
from cagefield.geometry.cage import LatticeCage
from cagefield.typing import Array
from tiers import nightly_except

ARM = Cage.box((0, 0, 0), (0.3, 0.3, 1.0)).subdivided((1, 1, 4))
CUBE = Cage.box((0.1, 0, 0), 0.6, (0.1, 0.2, 0.3)).subdivided((3, 2, 4))


def bent(interpolation: str = "bspline") -> LatticeCage:
    cage = Cage.box((0, 0, 0), (0.4, 0.5, 1.0)).subdivided((2, 3, 4), interpolation)
    moved = (
        cage.bend("z", 1.2, towards="x").twist("z", 0.4).taper("z", 0.7).move_points((5, 6), (0.03, 0.02, 0))
    )
    assert isinstance(moved, LatticeCage)
    return moved


def test_points_are_even_with_x_fastest_and_reach_the_corners() -> None:
    assert ARM.shape == (2, 2, 5) and ARM.points.shape == (20, 3)
    first = [[-0.15, -0.15, -0.5], [0.15, -0.15, -0.5], [-0.15, 0.15, -0.5], [-0.15, -0.15, -0.25]]
    np.testing.assert_allclose(ARM.points[[0, 1, 2, 4]], first)
    box = Cage.box((0, 0, 0), (0.3, 0.3, 1.0))
    np.testing.assert_array_equal(ARM.corners, box.corners)
    u = np.random.default_rng(0).random((200, 3))
    for interpolation in bspline_lattice.INTERPOLATIONS:
        even = CUBE.subdivided((1, 5, 7), interpolation)
        np.testing.assert_allclose(even.evaluate(u)[0], hexahedron.points(CUBE.corners, u), atol=1e-14)
    lattice = bent()
    np.testing.assert_allclose(lattice.evaluate(hexahedron.BITS)[0], lattice.corners, atol=1e-14)


@pytest.mark.parametrize("interpolation", bspline_lattice.INTERPOLATIONS)
def test_spline_is_scipys(interpolation: str) -> None:
    """Along one axis, against SciPy's B-spline with one more control point beyond each end."""
    n, rng = 6, np.random.default_rng(1)
    line = rng.normal(size=n)
    t = rng.uniform(0.0, 1.0, 200)
    points = np.repeat(line[None, None, :, None], 2, axis=0).repeat(2, axis=1).reshape(-1, 1)
    u = np.stack([t, rng.random(200), rng.random(200)], axis=1)
    value, slope = bspline_lattice.evaluate(points, (n, 2, 2), interpolation, u)
    if interpolation == "linear":
        spline = BSpline(np.arange(-1.0, n + 1), line, 1)
    else:
        longer = np.concatenate([[2 * line[0] - line[1]], line, [2 * line[-1] - line[-2]]])
        spline = BSpline(np.arange(-3.0, n + 3), longer, 3)
    np.testing.assert_allclose(value[:, 0], spline(t * (n - 1)), atol=1e-13)
    np.testing.assert_allclose(slope[:, 0, 0], (n - 1) * spline.derivative()(t * (n - 1)), atol=1e-11)
    np.testing.assert_allclose(slope[:, 0, 1:], 0.0, atol=1e-12)


def test_bspline_is_twice_differentiable_and_linear_is_not() -> None:
    step = np.array([1e-6, 0.0, 0.0])
    knot = np.array([[0.5, 0.3, 0.6]])
    jumps = {}
    for interpolation in bspline_lattice.INTERPOLATIONS:
        lattice = bent(interpolation)
        slopes = [lattice.evaluate(knot + n * step)[1] for n in (-2, -1, 1, 2)]
        jumps[interpolation] = np.abs(slopes[2] - slopes[1]).max()
        if interpolation == "bspline":  # second derivatives from both sides, to the third one times 3e-6
            np.testing.assert_allclose(slopes[1] - slopes[0], slopes[3] - slopes[2], atol=1e-9)
    assert jumps["bspline"] < 1e-4 < 1e-3 < jumps["linear"]


@pytest.mark.parametrize("interpolation", bspline_lattice.INTERPOLATIONS)
def test_coordinates_invert_the_spline(interpolation: str) -> None:
    lattice = bent(interpolation)
    u = np.random.default_rng(2).random((2000, 3))
    x, J = lattice.evaluate(u)
    found, inside = lattice.coordinates(x)
    assert inside.all()
    np.testing.assert_allclose(found, u, atol=1e-9)
    for axis, step in enumerate(1e-6 * np.eye(3)):
        slope = (lattice.evaluate(u + step)[0] - lattice.evaluate(u - step)[0]) / 2e-6
        away = np.abs(u * (np.array(lattice.shape) - 1) % 1.0 - 0.5).max(axis=1) < 0.499  # of the kinks
        np.testing.assert_allclose(J[away, :, axis], slope[away], atol=1e-8)
    beyond = lattice.evaluate(np.array([[0.5, 0.5, 1.02], [-0.03, 0.5, 0.5], [0.3, 1.05, 0.2]]))[0]
    assert not lattice.contains(beyond).any() and not lattice.contains(x + 5.0).any()


def test_affine_operations_move_all_points_and_keep_the_lattice_affine() -> None:
    lattice = CUBE.rotate((0.3, 0.2, 0.1)).scale((1.1, 0.8, 1.2)).shear(xy=0.2).translate((0.1, 0.2, 0.3))
    assert isinstance(lattice, LatticeCage) and lattice.is_affine
    box = Cage(CUBE.corners, pivot=CUBE.pivot)
    box = box.rotate((0.3, 0.2, 0.1)).scale((1.1, 0.8, 1.2)).shear(xy=0.2).translate((0.1, 0.2, 0.3))
    np.testing.assert_allclose(lattice.points, box.subdivided((3, 2, 4)).handles, atol=1e-14)
    np.testing.assert_allclose(lattice.pivot, box.pivot)
    # Corners, edges and faces take the points along by trilinear weights, as the box takes its inside.
    moved, expected = (
        CUBE.move_corner(7, (0.1, 0.05, 0.1)),
        Cage(CUBE.corners).move_corner(7, (0.1, 0.05, 0.1)),
    )
    np.testing.assert_allclose(moved.handles, expected.subdivided((3, 2, 4)).handles, atol=1e-14)


def test_bend_is_an_arc_of_the_same_length() -> None:
    angle = np.pi / 2
    cage = Cage.box((0, 0, 0.5), (0.1, 0.1, 1.0)).subdivided((2, 2, 6))
    points = cage.bend("z", angle, towards="x").points.reshape(7, 3, 3, 3)
    middle, radius = points[:, 1, 1], 1.0 / angle
    np.testing.assert_allclose(np.linalg.norm(middle - (radius, 0, 0), axis=1), radius, atol=1e-12)
    np.testing.assert_allclose(middle[-1], (radius, 0, radius), atol=1e-12)
    np.testing.assert_allclose(points[0], cage.points.reshape(7, 3, 3, 3)[0], atol=1e-15)  # its start
    # Planes across the axis stay plane and at a right angle to the arc, with their size.
    np.testing.assert_allclose(np.linalg.norm(points[-1, 1, 2] - points[-1, 1, 0]), 0.1, atol=1e-12)
    np.testing.assert_allclose(points[-1, :, :, 0], radius, atol=1e-12)
    both = cage.bend("z", angle, towards="x", fixed="middle").points.reshape(7, 3, 3, 3)
    np.testing.assert_allclose(both[3], cage.points.reshape(7, 3, 3, 3)[3], atol=1e-12)


def test_twist_turns_and_taper_scales_evenly() -> None:
    cage = Cage.box((0, 0, 0.5), (0.2, 0.2, 1.0)).subdivided((1, 1, 4))
    twisted = cage.twist("z", np.pi / 2).points.reshape(5, 4, 3)
    rest = cage.points.reshape(5, 4, 3)
    for n in range(5):
        c, s = np.cos(n * np.pi / 8), np.sin(n * np.pi / 8)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        np.testing.assert_allclose(twisted[n], rest[n] @ turn.T, atol=1e-12)
    tapered = cage.taper("z", 0.25, fixed="end").points.reshape(5, 4, 3)
    np.testing.assert_allclose(tapered[:, 0, 0] / rest[:, 0, 0], 0.25 ** (np.arange(5) / 4 - 1), rtol=1e-12)
    turned = cage.rotate((0.4, 0.3, 0.2))
    R = turned.heading
    np.testing.assert_allclose(
        turned.twist("z", 1.0).points,
        cage.pivot + (cage.twist("z", 1.0).points - cage.pivot) @ R.T,
        atol=1e-9,
    )


def test_proportional_moves_fade_with_the_distance() -> None:
    cage = Cage.box((0, 0, 0), 1.0).subdivided((4, 4, 4))
    by = np.array([0.1, 0.0, 0.05])
    moved = cage.move_points((62,), by, radius=0.6, falloff="linear").points - cage.points
    distance = np.linalg.norm(cage.points - cage.points[62], axis=1)
    np.testing.assert_allclose(moved, (1.0 - distance / 0.6).clip(0.0)[:, None] * by, atol=1e-14)
    for falloff in ("smooth", "sphere", "root", "sharp"):
        moved = cage.move_points((62,), by, radius=0.6, falloff=falloff).points - cage.points
        np.testing.assert_allclose(moved[62], by)
        assert not moved[distance >= 0.6].any() and moved[distance < 0.5].any(axis=1).all()


def sampled_least(points: Array, shape: tuple[int, int, int], interpolation: str, end: Array) -> float:
    """Least determinant at many places and times, over that of the affine fit of the start."""
    u = np.random.default_rng(3).random((4000, 3))
    size = np.linalg.det(lattice_determinant.fit(points, shape)[0])
    times = np.linspace(0.0, 1.0, 5)
    return (
        min(
            float(
                np.linalg.det(
                    bspline_lattice.evaluate(points + t * (end - points), shape, interpolation, u)[1]
                ).min()
            )
            for t in times
        )
        / size
    )


@pytest.mark.parametrize("interpolation", nightly_except(bspline_lattice.INTERPOLATIONS, "bspline"))
def test_verdict_agrees_with_samples(interpolation: str) -> None:
    rng, answers = np.random.default_rng(4), set()
    for _ in range(12):
        shape = tuple(int(k) for k in rng.integers(2, 6, 3))
        start = Cage.box((0, 0, 0), 1.0).subdivided([k - 1 for k in shape], interpolation).points
        end = start + rng.uniform(0.05, 0.6) / max(shape) * rng.normal(size=start.shape)
        for points, other in ((end, end), (start, end)):
            along = None if other is points else other
            answer, _ = lattice_determinant.verdict(points, shape, interpolation, along)
            least = sampled_least(points, shape, interpolation, other)
            answers.add(answer)
            if answer == "proven":
                assert least > 0.0
            if least < lattice_determinant.LEAST_DETERMINANT:
                assert answer == "folded"
            if answer == "folded":
                assert least < 0.4  # a fold that samples nearly miss is a shallow one
    assert {"proven", "folded"} <= answers


def test_verdict_is_a_proof_where_samples_at_nodes_would_miss_a_fold() -> None:
    """A fold of one cell of eight, small enough to lie between the samples of `least_determinant`."""
    cage = Cage.box((0, 0, 0), 1.0).subdivided((2, 2, 2), "linear")
    points = cage.points.copy()
    points[13] += (0.49, 0.49, 0.49)
    assert lattice_determinant.verdict(points, (3, 3, 3), "linear")[0] == "folded"
    least, _ = lattice_determinant.least_determinant(points, (3, 3, 3), "linear")
    assert least < 1e-1


def test_folded_lattices_are_refused_with_the_place() -> None:
    with pytest.raises(CageError, match=r"inside out in cell \(0, 0, [12]\), near control point 1?[0-9] at"):
        ARM.move_points(range(8, 12), (0, 0, 0.4))
    with pytest.raises(CageError, match="lattice is mirrored"):
        LatticeCage(ARM.points * (-1, 1, 1), ARM.shape)
    with pytest.raises(CageError, match="zero size"):
        LatticeCage(ARM.points * (0, 1, 1), ARM.shape)
    assert isinstance(ARM.move_points(range(8, 12), (0, 0, 0.1)), LatticeCage)


def test_bad_input_says_the_cure() -> None:
    box = Cage.box((0, 0, 0), 1.0)
    with pytest.raises(
        CageError, match=r"2 to 8 control points along each of three axes .* got points \[2, 2, 9\]"
    ):
        box.subdivided((1, 1, 8))
    with pytest.raises(CageError, match='interpolation must be bspline or linear, got "cubic"'):
        box.subdivided((1, 1, 4), "cubic")
    with pytest.raises(CageError, match="point 20 is not a point of this cage: its points are 0 to 19"):
        ARM.move_point(20, (0, 0, 0.1))
    with pytest.raises(CageError, match="each once"):
        ARM.move_points((1, 1), (0, 0, 0.1))
    with pytest.raises(CageError, match="radius must be 0 or a positive distance"):
        ARM.move_points((1,), (0, 0, 0.1), radius=float("nan"))
    with pytest.raises(CageError, match="falloff must be one of smooth"):
        ARM.move_points((1,), (0, 0, 0.1), radius=1.0, falloff="soft")
    with pytest.raises(CageError, match="must be finite"):
        ARM.move_point(3, (0, np.nan, 0))
    with pytest.raises(CageError, match="bend angle must be finite, got nan"):
        ARM.bend("z", np.float64("nan"))
    with pytest.raises(CageError, match="axis must be x, y or z"):
        ARM.bend("w", 1.0)
    with pytest.raises(CageError, match="goes towards another axis than z"):
        ARM.bend("z", 1.0, towards="z")
    with pytest.raises(CageError, match="fixed must be one of start, middle, end"):
        ARM.twist("z", 1.0, fixed="top")
    with pytest.raises(CageError, match="taper factor must be positive"):
        ARM.taper("z", -1.0)
    with pytest.raises(CageError, match="bend angle must be finite"):
        ARM.bend("z", np.inf)
    with pytest.raises(CageError, match="shape"):
        LatticeCage(ARM.points[:5], ARM.shape)
    with pytest.raises(CageError, match=r"a twist needs a lattice .* cage\.subdivided\(\(1, 1, 4\)\)"):
        Twist("z", 30.0).apply(box)
    with pytest.raises(CageError, match="subdivided before its points are moved"):
        ARM.move_point(3, (0, 0, 0.1)).subdivided((2, 2, 2))  # type: ignore[attr-defined]
    with pytest.raises(EditError, match="a delete needs a cage with 8 corners, not lattices"):
        Edit.delete(ARM)


def test_equality_knows_points_interpolation_and_kind() -> None:
    same = Cage.box((0, 0, 0), (0.3, 0.3, 1.0)).subdivided((1, 1, 4))
    assert same == ARM and hash(same) == hash(ARM)
    for other in (
        Cage(ARM.corners),
        ARM.subdivided((1, 1, 3)),
        ARM.subdivided((1, 1, 4), "linear"),
        ARM.move_point(5, (0, 0, 1e-12)),
        LatticeCage(ARM.points, ARM.shape, pivot=(0, 0, 1)),
    ):
        assert other != ARM and not other == ARM  # noqa: SIM201


@pytest.mark.parametrize(
    "operation",
    [
        MovePoint(3, (0.05, 0.02, 0.03)),
        MovePoints((1, 2), (0.1, 0.0, 0.0), 0.5, "root"),
        Bend("z", 40.0, "y", "middle"),
        Twist("x", -30.0),
        Taper("y", 0.5, "end"),
    ],
)
def test_parts_go_from_nothing_to_the_whole(operation: MovePoint | MovePoints | Bend | Twist | Taper) -> None:
    np.testing.assert_allclose(operation.part(0.0).apply(CUBE).handles, CUBE.points, atol=1e-12)
    assert operation.part(1.0).apply(CUBE) == operation.apply(CUBE)
    half = operation.part(0.5).apply(CUBE).handles
    assert 0.0 < np.abs(half - CUBE.points).max() < np.abs(operation.apply(CUBE).handles - CUBE.points).max()


def test_files_give_back_the_stack() -> None:
    outer = Cage.box((0, 0, 0), 2.4)
    edit = Edit.continuous(ARM, outer, name="arm").bend("z", np.radians(60), towards="x", fixed="middle")
    edit = edit.twist("z", 0.3, fixed="end").taper("z", 0.8).move_point(3, (0, 0, 0.1))
    edit = edit.move_points((16, 17), (0, 0.1, 0), radius=0.4, falloff="root").rotate((0, 0, 0.1))
    linear = Edit.continuous(CUBE.subdivided((2, 2, 3), "linear"), outer).translate((0.1, 0, 0))
    turned = Edit.continuous(CUBE.rotate((0.1, 0.2, 0.3)), outer).translate((0.1, 0, 0))
    stack = EditStack([edit, linear, turned])
    for form in ("yaml", "json"):
        assert parse_edits(dump_edits(stack, format=form), format=form, check=False) == stack
    text = dump_edits(EditStack([edit]))
    assert "lattice: {points: [2, 2, 5], interpolation: bspline}" in text and "degrees: 60.0" in text


LATTICE = """
- inner: {center: [0, 0, 0], size: [0.3, 0.3, 1], lattice: %s}
  outer: {margin: 0.5}
  operations: [%s]
"""


def test_file_by_hand() -> None:
    text = LATTICE % (
        "{points: [2, 2, 5]}",
        "{bend: {axis: z, degrees: 30}}, {twist: {axis: z, degrees: 20}}",
    )
    (edit,) = parse_edits(text, check=False)
    assert edit.inner == ARM and edit.operations == (Bend("z", 30.0), Twist("z", 20.0))


@pytest.mark.parametrize(
    ("lattice", "operation", "message"),
    [
        ("{points: [2, 2, 9]}", "", "whole number from 2 to 8"),
        ("{points: [2, 2]}", "", "expected 3 items"),
        ("{points: [2, 2, 5], interpolation: cubic}", "", "must be bspline or linear"),
        ("{interpolation: bspline}", "", '"points" is missing'),
        ("{points: [2, 2, 5], spacing: 3}", "", "unknown key"),
        ("{points: [2, 2, 5]}", "{bend: {axis: w, degrees: 3}}", "must be x or y or z"),
        ("{points: [2, 2, 5]}", "{bend: {axis: z}}", '"degrees" is missing'),
        ("{points: [2, 2, 5]}", "{taper: {axis: z, factor: -1}}", "taper factor must be positive"),
        ("{points: [2, 2, 5]}", "{move_point: {point: 20, by: [0, 0, 0.1]}}", "its points are 0 to 19"),
        (
            "{points: [2, 2, 5]}",
            "{twist: {axis: z, degrees: 20, fixed: top}}",
            "must be start or middle or end",
        ),
    ],
)
def test_file_errors(lattice: str, operation: str, message: str) -> None:
    with pytest.raises(EditFileError, match=message):
        parse_edits(LATTICE % (lattice, operation), check=False)
