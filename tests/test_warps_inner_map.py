from __future__ import annotations

import numpy as np
from hypothesis import given
from scipy.optimize import root

from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.warps.hexahedron_map import HexahedronMap
from random_cages import cages, examples, seeds, trilinear


@examples(30)
@given(cages(), seeds)
def test_inverse_is_that_of_an_independent_map(cage: Cage, seed: int) -> None:
    truth = np.random.default_rng(seed).random((20, 3))
    p = np.stack([trilinear(cage.corners, u) for u in truth])
    u, found = hexahedron.inverse(cage.corners, p)
    assert found.all()
    scale = np.linalg.inv(cage.affine[0])
    for k in range(len(p)):
        solved = root(lambda v, k=k: scale @ (trilinear(cage.corners, v) - p[k]), truth[k], tol=1e-14).x
        # Rounding of x, 1e-15 of the cage's distance from the origin, amplified by the inverse Jacobian.
        J = hexahedron.jacobian(cage.corners, truth[k : k + 1])[0]
        tolerance = 4e-15 * (1.0 + np.abs(cage.corners).max()) * np.linalg.norm(np.linalg.inv(J)) + 1e-13
        assert np.abs(u[k] - solved).max() < tolerance
        assert np.abs(u[k] - truth[k]).max() < tolerance


@examples(25)
@given(cages(), seeds)
def test_inverse_finds_every_point_of_the_cage(cage: Cage, seed: int) -> None:
    u = np.random.default_rng(seed).random((2000, 3))
    u[:500] = np.round(u[:500])  # corners
    u[500:1000, 0] = np.round(u[500:1000, 0])  # faces
    p = hexahedron.points(cage.corners, u)
    again, found = hexahedron.inverse(cage.corners, p)
    assert hexahedron.inside(again, found).all()
    size = np.abs(cage.corners).max()
    np.testing.assert_allclose(hexahedron.points(cage.corners, again), p, atol=1e-13 * (1.0 + size))


def test_points_and_jacobian() -> None:
    cage = Cage.box((1, 2, 3), (1, 2, 3), (0.1, 0.2, 0.3)).move_corner(7, (0.4, -0.3, 0.2))
    u = np.random.default_rng(0).random((50, 3))
    expected = np.stack([trilinear(cage.corners, v) for v in u])
    np.testing.assert_allclose(hexahedron.points(cage.corners, u), expected, atol=1e-14)
    h = 1e-6
    for a in range(3):
        e = h * np.eye(3)[a]
        slope = hexahedron.points(cage.corners, u + e) - hexahedron.points(cage.corners, u - e)
        # The map is linear along each axis, so only rounding, 1e-16 * 4 / h, is left.
        np.testing.assert_allclose(hexahedron.jacobian(cage.corners, u)[:, :, a], slope / (2 * h), atol=4e-9)


def test_no_root_is_invented_outside() -> None:
    cage = Cage.box((0, 0, 0), 1).move_corner(7, (-0.3, -0.3, -0.3))
    p = np.array([[5.0, 5.0, 5.0], [0.49, 0.49, 0.49], [np.nan, 0.0, 0.0]])
    assert not cage.contains(p).any()


def test_invert_matches_lapack() -> None:
    M = np.random.default_rng(0).normal(size=(100, 3, 3)) * np.logspace(-8, 8, 100)[:, None, None]
    expected = np.linalg.inv(M)
    scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
    # Cofactors lose the condition number's digits, as does LAPACK; these matrices have at most 1e3.
    np.testing.assert_allclose(hexahedron.invert(M) / scale, expected / scale, atol=1e-12)


@examples(30)
@given(cages(), cages(), seeds)
def test_map_between_cages(canonical: Cage, deformed: Cage, seed: int) -> None:
    u = np.random.default_rng(seed).random((100, 3))
    phi = HexahedronMap(canonical, deformed)
    p = hexahedron.points(deformed.corners, u)
    inside, q, J = phi(p)
    assert inside.all()
    J_d, J_c = (hexahedron.jacobian(c.corners, u) for c in (deformed, canonical))
    # Error of u through the canonical map: see the test of the inverse.
    error = 1e-13 * (1.0 + np.linalg.norm(np.linalg.inv(J_d), axis=(1, 2)) * np.linalg.norm(J_c, axis=(1, 2)))
    assert (np.abs(q - hexahedron.points(canonical.corners, u)).max(axis=1) < 10.0 * error).all()
    np.testing.assert_allclose(J @ J_d, J_c, atol=1e-6 * np.abs(J_c).max())


def test_transformed_cages_have_a_closed_form() -> None:
    bent = Cage.box((1, 2, 3), (1, 2, 3)).move_corner(7, (0.4, -0.3, 0.2))
    moved = bent.rotate((0.1, 0.2, 0.3)).scale((1, 2, 0.5)).shear(xz=0.2).translate((1, 0, 0))
    phi = HexahedronMap(bent, moved)
    assert phi.affine is not None
    A, b = phi.affine
    np.testing.assert_allclose(moved.corners @ A.T + b, bent.corners, atol=1e-13)
    u = np.random.default_rng(0).random((100, 3))
    _, q, _ = phi(hexahedron.points(moved.corners, u))
    np.testing.assert_allclose(q, hexahedron.points(bent.corners, u), atol=1e-13)
    assert HexahedronMap(bent, moved.move_corner(0, (0, 0, -0.1))).affine is None
