from __future__ import annotations

import numpy as np

from cagefield.edits import Edit, EditStack, Trilinear
from cagefield.geometry.cage import Cage
from cagefield.warps.lattice import Lattice

INNER, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0.1, 0, 0), 1.8, (0.2, 0.1, 0.1))


def edit() -> Edit:
    return (
        Edit.continuous(INNER, OUTER, shell=Trilinear())
        .rotate((0.1, 0.2, 0.2))
        .move_corner(7, (0.1, 0.05, 0.05))
    )


def test_an_affine_map_is_reproduced_exactly() -> None:
    A, b = np.array([[1.1, 0.2, 0.0], [0.0, 0.9, 0.1], [0.1, 0.0, 1.2]]), np.array((0.1, 0.2, 0.3))
    bent = OUTER.move_corner(3, (0.2, 0.1, -0.1))  # the frame is wider than the cage
    lattice = Lattice.sample(lambda p: p @ A.T + b, bent, 5)
    p = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 3))
    q, J = lattice.to_canonical(p)
    np.testing.assert_allclose(q, p @ A.T + b, atol=1e-14)
    np.testing.assert_allclose(J, np.broadcast_to(A, J.shape), atol=1e-13)


def test_nodes_are_exact_and_jacobians_are_those_of_the_interpolation() -> None:
    warp = edit().exact_warp
    lattice = Lattice.sample(lambda p: warp.to_canonical(p).points, OUTER, 9)
    index = np.random.default_rng(0).integers(0, 9, (100, 3))
    nodes = lattice.origin + (index / 8.0) @ lattice.frame.T
    np.testing.assert_allclose(lattice.to_canonical(nodes)[0], warp.to_canonical(nodes).points, atol=1e-13)
    p = lattice.origin + np.random.default_rng(1).uniform(0.1, 0.9, (500, 3)) @ lattice.frame.T
    _, J = lattice.to_canonical(p)
    h = 1e-7
    for a in range(3):
        e = h * np.eye(3)[a]
        slope = (lattice.to_canonical(p + e)[0] - lattice.to_canonical(p - e)[0]) / (2.0 * h)
        # Piecewise trilinear: rounding 1e-16 / h is all, but for points within h of a cell's face.
        assert np.quantile(np.abs(slope - J[:, :, a]).max(axis=1), 0.99) < 1e-8


def test_inner_region_and_outside_stay_exact() -> None:
    exact, coarse = edit(), edit().replace(lattice=4)
    p = np.random.default_rng(0).uniform(-1.3, 1.3, (5000, 3))
    a, b = EditStack([exact]).to_canonical(p), EditStack([coarse]).to_canonical(p)
    inside, outside = exact.deformed.contains(p), ~OUTER.contains(p)
    assert np.array_equal(a.points[inside], b.points[inside])
    assert np.array_equal(a.jacobian[inside], b.jacobian[inside])
    assert np.array_equal(b.points[outside], p[outside])
    shell = ~inside & ~outside
    assert np.abs(a.points - b.points)[shell].max() > 1e-3


def test_error_falls_with_the_resolution() -> None:
    resolutions = np.array([9, 17, 33])
    errors = np.array([edit().lattice_error(int(R), samples=4000) for R in resolutions])
    assert (np.diff(errors, axis=0) < 0.0).all()
    order = -np.polyfit(np.log(resolutions - 1), np.log(errors), 1)[0]
    # The displacement has kinks on the cages' faces, where the interpolation is of first order, and is smooth
    # elsewhere, where it is of second; the mean is over both.
    assert order[0] > 0.7 and order[1] > 1.4
    assert edit().lattice_error() == (0.0, 0.0)
    # A lattice of 33 nodes over 1.8: the worst error is a fraction of a cell, the mean a hundredth of one.
    assert errors[2, 0] < 0.25 * 1.8 / 32 and errors[2, 1] < 0.01 * 1.8 / 32


def test_to_deformed_stays_exact() -> None:
    p = np.random.default_rng(0).uniform(-0.9, 0.9, (500, 3))
    exact, coarse = EditStack([edit()]), EditStack([edit().replace(lattice=16)])
    assert np.array_equal(exact.to_deformed(p).points, coarse.to_deformed(p).points)
    back = coarse.to_deformed(coarse.to_canonical(p).points).points
    largest = edit().lattice_error(16)[0]
    # The round trip closes to the lattice's error, amplified by the forward map (here at most 5).
    assert np.abs(back - p).max() < 5.0 * largest
