"""Harmonic blends inside of mesh cages: closed forms, finite elements, and libigl where it is installed."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.harmonic_cages import CASES, cage_of, errors, grid, harmonic, on_triangles, tetrahedra

from cagefield.geometry import bspline_lattice
from cagefield.typing import Array
from cagefield.warps.mesh_flow import blend, harmonic_inside

ARM = CASES["arm bent by 40°"]
ROOM = np.array([1.4, 1.1, 1.7])
"""Size of a box around the arm, in which the grid stands."""

CELLS = 24


def on_the_grid(motion: Array, cells: int = CELLS) -> tuple[Array, Array]:
    """(nodes inside [M,3], harmonic blend there [M,3]) of a motion [V,3] of the arm's cage."""
    rest, triangles = cage_of(ARM)
    middle = np.array(ARM.low) + 0.5 * np.array(ARM.size)
    z = 2.0 * bspline_lattice.grid(3 * (cells + 1,)) - 1.0
    places = middle + 0.5 * ROOM * z
    found = blend(places + 1e-9, rest, triangles, motion)
    inside = np.flatnonzero(found[:, 3] <= 0.0)
    blended = np.ascontiguousarray(found[:, :3])
    harmonic_inside(blended, (rest - middle) / (0.5 * ROOM), triangles, motion, ROOM / cells, inside)
    return places[inside], blended[inside]


def test_linear_motions_are_reproduced() -> None:
    rest, _ = cage_of(ARM)
    A, b = np.random.default_rng(0).normal(size=(3, 3)), np.array([0.3, -0.2, 0.1])
    at, got = on_the_grid(rest @ A.T + b)
    assert len(at) > 300
    np.testing.assert_allclose(got, at @ A.T + b, atol=1e-4)


def test_blends_stay_within_the_motion() -> None:
    """Harmonic functions have their extremes on the boundary; mean value coordinates are not bound to."""
    rest, _ = cage_of(ARM)
    motion = np.random.default_rng(1).uniform(0.0, 1.0, rest.shape)
    _, got = on_the_grid(motion)
    assert (got >= motion.min(axis=0) - 1e-3).all() and (got <= motion.max(axis=0) + 1e-3).all()


def test_the_grid_solves_what_finite_elements_solve() -> None:
    rest, triangles = cage_of(ARM)
    motion = ARM.at(rest, 1.0) - rest
    box, shape = grid(ARM, (6, 6, 3))
    u = (box - ARM.low) / np.array(ARM.size)
    edge = np.flatnonzero((np.abs(u - 0.5) > 0.5 - 1e-9).any(axis=1))
    values = on_triangles(box[edge], rest, triangles) @ motion
    elements = harmonic(box, tetrahedra(shape), edge, values)
    at, got = on_the_grid(motion)
    v = (at - ARM.low) / np.array(ARM.size)
    expected, _ = bspline_lattice.evaluate(elements, shape, "linear", v)
    size = np.abs(motion).max()
    error = np.linalg.norm(got - expected, axis=1) / size
    mean_value = np.linalg.norm(blend(at, rest, triangles, motion)[:, :3] - expected, axis=1) / size
    assert np.sqrt((error**2).mean()) < 0.005
    assert np.sqrt((mean_value**2).mean()) > 3.0 * np.sqrt((error**2).mean())  # another function


def test_elements_are_those_of_libigl() -> None:
    igl = pytest.importorskip("igl")
    box, shape = grid(ARM, (3, 3, 2))
    u = (box - ARM.low) / np.array(ARM.size)
    edge = np.flatnonzero((np.abs(u - 0.5) > 0.5 - 1e-9).any(axis=1))
    bent = ARM.at(box, 0.6)
    values = np.sin(3.0 * bent[edge])
    tets = tetrahedra(shape)
    expected = igl.harmonic(bent, tets, edge, values, 1)
    np.testing.assert_allclose(harmonic(bent, tets, edge, values), expected, atol=1e-9)


@pytest.mark.nightly
def test_bent_cages_follow_closed_forms_closer_than_by_mean_values() -> None:
    for name in ("arm bent by 40°", "cable of 180° made straight"):
        found = errors(CASES[name], 4)
        product, mean_value = (float((found[k] ** 2).mean()) for k in ("product", "mean value, velocity"))
        assert product < 0.7 * mean_value
