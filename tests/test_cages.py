from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from cagefield.errors import CageError
from cagefield.geometry import hexahedron, hexahedron_determinant
from cagefield.geometry.cage import Cage
from cagefield.geometry.face_distance import outside_by
from random_cages import cages, examples, seeds


def skewed() -> Cage:
    return Cage.box((1, 2, 3), (1, 2, 3), (0.1, 0.2, 0.3)).move_corner(7, (0.4, -0.3, 0.2))


def test_corner_order_is_that_of_vtk_voxels() -> None:
    cage = Cage.box((1, 2, 3), (2, 4, 6))
    expected = [(2 * x, 4 * y, 6 * z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    assert np.array_equal(cage.corners, expected)
    assert cage.faces["+x"] == (1, 3, 5, 7) and cage.faces["-z"] == (0, 1, 2, 3)
    assert len(cage.edges) == 12
    assert all(i < j and (i ^ j) in (1, 2, 4) for i, j in cage.edges)


def test_rotation_is_intrinsic_xyz_and_right_handed() -> None:
    theta = (0.3, -0.7, 1.1)
    turned = Cage.box((1, 2, 3), (1, 2, 3), theta)
    offsets = (hexahedron.BITS - 0.5) * (1, 2, 3)
    expected = np.array((1, 2, 3)) + Rotation.from_euler("XYZ", theta).apply(offsets)
    np.testing.assert_allclose(turned.corners, expected, atol=1e-14)
    np.testing.assert_allclose(Cage.box((1, 2, 3), (1, 2, 3)).rotate(theta).corners, expected, atol=1e-14)
    # x turns towards y about +z: a left-handed R_z, as printed in the paper, would turn it towards -y.
    assert Cage.box((0, 0, 0), 1).rotate((0, 0, 0.1)).corners[1][1] > -0.5


def test_center_is_the_mean_of_the_corners_and_the_pivot_survives_a_drag() -> None:
    box = Cage.box((1, 2, 3), 2)
    dragged = box.move_corner(0, (-0.8, 0, 0))
    np.testing.assert_allclose(dragged.center, (0.9, 2, 3))
    assert np.array_equal(dragged.pivot, (1, 2, 3))
    turned = dragged.rotate((0, 0, np.pi / 2))
    np.testing.assert_allclose(turned.corners[7], (0, 3, 4), atol=1e-12)  # (2, 3, 4) a quarter about (1, 2)
    assert np.array_equal(dragged.translate((1, 0, 0)).pivot, (2, 2, 3))
    assert np.array_equal(dragged.move_face("+z", (0, 0, 1)).move_edge((0, 1), (0, 0, -1)).pivot, (1, 2, 3))


def test_transformations_act_about_the_pivot_as_written_in_the_design() -> None:
    v, theta, s = np.array((0.5, -1, 2)), (0.2, 0.4, -0.3), np.array((1.5, 0.5, 2.0))
    cage = skewed()
    R = Rotation.from_euler("XYZ", theta).as_matrix()
    expected = cage.pivot + v + (cage.corners - cage.pivot) * s @ R.T
    np.testing.assert_allclose(cage.scale(s).rotate(theta).translate(v).corners, expected, atol=1e-13)


def test_shear_and_scale_along_the_cage() -> None:
    box = Cage.box((0, 0, 1), 2)
    np.testing.assert_allclose(box.shear(xy=0.5).corners[:, 0], box.corners[:, 0] + 0.5 * box.corners[:, 1])
    theta = (0.3, 0.4, 0.5)
    longer = Cage.box((1, 1, 1), (1, 2, 3), theta).scale((2, 1, 1), axes="cage")
    np.testing.assert_allclose(longer.corners, Cage.box((1, 1, 1), (2, 2, 3), theta).corners, atol=1e-13)
    turned = Cage.box((1, 1, 1), (1, 2, 3), (0, 0, 0.5)).rotate((0.7, 0, 0), axes="cage")
    R = Rotation.from_euler("z", 0.5) * Rotation.from_euler("x", 0.7)
    expected = R.apply((hexahedron.BITS - 0.5) * (1, 2, 3)) + 1.0
    np.testing.assert_allclose(turned.corners, expected, atol=1e-13)


def test_drags_move_only_their_corners() -> None:
    box = Cage.box((0, 0, 0), 2)
    for moved, ids in (
        (box.move_corner(3, (0.1, 0.2, 0.3)), [3]),
        (box.move_edge((5, 1), (0.1, 0.2, 0.3)), [1, 5]),
        (box.move_face("-y", (0.1, 0.2, 0.3)), [0, 1, 4, 5]),
        (box.move_corners((6, 0, 3), (0.1, 0.2, 0.3)), [0, 3, 6]),
    ):
        expected = box.corners.copy()
        expected[ids] += (0.1, 0.2, 0.3)
        assert np.array_equal(moved.corners, expected)


def test_affine_is_exact_for_parallelepipeds_only() -> None:
    sheared = Cage.box((1, 2, 3), (1, 2, 3), (0.1, 0.2, 0.3)).shear(xy=0.5)
    A, b = sheared.affine
    assert sheared.is_affine and not skewed().is_affine
    np.testing.assert_allclose(b + hexahedron.BITS @ A.T, sheared.corners, atol=1e-14)
    assert Cage.box((0, 0, 0), 1).move_face("+x", (0.3, 0.1, 0)).is_affine


def test_grown_moves_every_face_by_the_margin() -> None:
    np.testing.assert_allclose(
        Cage.box((1, 1, 1), 2).grown((0.5, 1, 1.5)).corners, Cage.box((1, 1, 1), (3, 4, 5)).corners
    )
    assert skewed().grown(1e-6).contains(skewed().corners).all()


def test_contains_agrees_with_half_spaces_where_faces_are_planar() -> None:
    frustum = Cage.box((0, 0, 0), 2).corners.copy()
    frustum[4:, :2] *= 0.3
    cage = Cage(frustum)
    p = np.random.default_rng(0).uniform(-1.2, 1.2, (20_000, 3))
    # |x|, |y| <= 1 at z = -1 falling linearly to 0.3 at z = 1.
    half = 1.0 - 0.35 * (p[:, 2] + 1.0)
    expected = (np.abs(p[:, :2]) <= half[:, None]).all(axis=1) & (np.abs(p[:, 2]) <= 1.0)
    assert np.array_equal(cage.contains(p), expected)


@examples(25)
@given(cages(), seeds)
def test_contains_the_points_of_bilinear_hexahedra_and_no_others(cage: Cage, seed: int) -> None:
    rng = np.random.default_rng(seed)
    u = rng.random((200, 3))
    assert cage.contains(hexahedron.points(cage.corners, u)).all()
    face = rng.integers(0, 3, 200)
    u[np.arange(200), face] = rng.integers(0, 2, 200)
    assert cage.contains(hexahedron.points(cage.corners, u)).all()
    beyond = u.copy()
    beyond[np.arange(200), face] += 1e-6 * (2 * u[np.arange(200), face] - 1)
    # One millionth outside a face is outside, unless the hexahedron folds back over itself beyond it.
    regular = np.linalg.det(hexahedron.jacobian(cage.corners, beyond)) > 0.0
    assert not cage.contains(hexahedron.points(cage.corners, beyond[regular])).any()
    assert not cage.contains(cage.center + 100.0 * rng.normal(size=(50, 3))).any()


@examples(25)
@given(cages(), seeds)
def test_determinant_polynomial(cage: Cage, seed: int) -> None:
    bernstein = hexahedron_determinant.determinant_coefficients(cage.corners)
    u = np.random.default_rng(seed).random((50, 3))
    basis = np.stack([(1 - u) ** 2, 2 * u * (1 - u), u**2])
    value = np.einsum("ijk,in,jn,kn->n", bernstein, basis[:, :, 0], basis[:, :, 1], basis[:, :, 2])
    det = np.linalg.det(hexahedron.jacobian(cage.corners, u))
    # 64 triple products of edges: rounding relative to the largest of them.
    np.testing.assert_allclose(value, det, atol=1e-13 * np.abs(bernstein).max())
    assert (det > 0.0).all()


def test_is_positive_decides_by_splitting() -> None:
    # (x - 1/3)^2 + c: positive at the corners, its least Bernstein coefficient is negative.
    square = np.array([1 / 9, 1 / 9 - 1 / 3, 4 / 9])
    block = np.broadcast_to(square[:, None, None], (1, 3, 3, 3))
    assert not hexahedron_determinant.is_positive(block - 1e-3)
    assert hexahedron_determinant.is_positive(block + 1e-3)


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        (np.zeros((7, 3)), r"cage corners must have shape \[8, 3\], got \[7, 3\]"),
        (np.full((8, 3), np.nan), r"corner 0 must be finite, got \(nan"),
        ("cage", "cage corners must be numbers"),
        (np.zeros((8, 3)), "zero size"),
        (Cage.box((0, 0, 0), 1).corners * (1, 1, 0), "zero size"),
        (Cage.box((0, 0, 0), 1).corners[::-1], "mirrored.*k = x \\+ 2y \\+ 4z"),
    ],
)
def test_impossible_cages(corners: object, message: str) -> None:
    with pytest.raises(CageError, match=message):
        Cage(corners)  # type: ignore[arg-type]


def test_inside_out_cages_name_the_corner() -> None:
    with pytest.raises(CageError, match=r"inside out at corner 7 .*move corner 7 back"):
        Cage.box((0, 0, 0), 1).move_corner(7, (-2, -2, -2))
    # Positive determinants at all eight corners (at least 0.39) do not make a cage valid.
    tangled = [
        [-2.8, -2.8, -2.8],
        [1.0, -1.6, 0.2],
        [-2.8, -0.2, -0.4],
        [-0.8, 1.0, 0.2],
        [-1.6, -1.0, -0.2],
        [-0.2, -2.8, 1.6],
        [0.2, 1.0, 1.6],
        [1.0, 0.4, 1.6],
    ]
    with pytest.raises(CageError, match="inside out between its corners, nearest to corner 6"):
        Cage(np.array(tangled))
    # A twist alone never folds: the middle shrinks to (1 + cos) / 2, which is 0 at 180 degrees only.
    top = Rotation.from_euler("z", 2.8).apply(hexahedron.BITS[4:] - 0.5)
    Cage(np.concatenate([hexahedron.BITS[:4] - 0.5, top]))


@pytest.mark.parametrize(
    ("operation", "message"),
    [
        (lambda c: c.scale((1, -2, 1)), "scale must be positive along every axis, got -2 along y"),
        (lambda c: c.scale(0), "scale must be positive"),
        (lambda c: c.translate((1, 2)), r"translate must have shape \[3\]"),
        (lambda c: c.rotate((0, np.inf, 0)), "rotate must be finite"),
        (lambda c: c.move_corner(8, (0, 0, 1)), "corner 8 is not a corner.*0 to 7"),
        (lambda c: c.move_edge((0, 3), (0, 0, 1)), r"edge \(0, 3\) is not an edge"),
        (lambda c: c.move_face("x", (0, 0, 1)), 'face "x" is not a face.*\\+x'),
        (lambda c: c.shear(xy=2, yx=2), "inside out: xy=2, yx=2 has determinant -3"),
        (lambda c: c.shear(xy=np.nan), "shear factors must be finite"),
        (lambda c: c.rotate((0, 0, 1), axes="local"), 'axes must be "world" or "cage", got "local"'),
        (lambda c: c.grown(0), "margin must be positive"),
        (
            lambda _: Cage.box((0, 0, 0), (1, 0, 1)),
            "cage size must be positive along every axis, got 0 along y",
        ),
    ],
)
def test_impossible_operations(operation, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(CageError, match=message):
        operation(Cage.box((0, 0, 0), 1))


def test_cages_are_values() -> None:
    a, b = skewed(), skewed()
    assert a == b and hash(a) == hash(b) and a != a.translate((1, 0, 0))
    with pytest.raises(ValueError, match="read-only"):
        a.corners[0, 0] = 1.0


def test_distance_outside_a_face() -> None:
    box = Cage.box((0, 0, 0), 1, (0.3, 0.2, 0.1))
    A = box.affine[0]
    for n, face in enumerate(("+x", "+y", "+z")):
        assert outside_by(box, 0.6 * A[:, n]) == (face, pytest.approx(0.1, abs=1e-9))
        assert outside_by(box, -0.7 * A[:, n]) == (face.replace("+", "-"), pytest.approx(0.2, abs=1e-9))
    # The face z = 1 + xy of a hexahedron with one raised corner, approached along its normal at (.5, .5).
    raised = Cage.box((0.5, 0.5, 0.5), 1).move_corner(7, (0, 0, 1))
    normal = np.array((-0.5, -0.5, 1.0)) / np.sqrt(1.5)
    face, distance = outside_by(raised, np.array((0.5, 0.5, 1.25)) + 0.05 * normal)
    assert (face, distance) == ("+z", pytest.approx(0.05, abs=1e-6))
