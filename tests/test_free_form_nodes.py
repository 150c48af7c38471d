"""Node lattices of lattice and mesh cages: vector kernels against numpy, lines, cages that are turned."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit

from cagefield import Cage, Edit
from cagefield.edits import Continuous
from cagefield.geometry import bspline_lattice
from cagefield.typing import Array
from cagefield.warps import LatticeShell, MeshShell
from cagefield.warps.free_form_nodes import NO_VELOCITY, flow_arguments
from cagefield.warps.kernels.interpolated_rows import blend_pairs, blend_spline
from cagefield.warps.kernels.lattice_flow import spline_weights

U = np.uintp


@njit
def _pairs(rows: Any, starts: Any, weights: Any, share: Any) -> Any:
    return blend_pairs(rows, starts, weights, share)


@njit
def _spline(points: Any, shape: Any, linear: bool, u: Any) -> Any:
    weights = np.empty((3, 9), np.float32)
    spline_weights(shape, linear, u, weights)
    line = U(4 * shape[2])
    plane = line * U(shape[1])
    start = U(4) * U(weights[0, 8]) + line * U(weights[1, 8]) + plane * U(weights[2, 8])
    return blend_spline(points, start, line, plane, weights)


def test_blended_pairs_of_rows_are_their_weighted_sum() -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=60).astype(np.float32)
    for count in (2, 4):
        starts, w = rng.choice(13, count, replace=False) * 4, rng.normal(size=count).astype(np.float32)
        found = _pairs(rows, tuple(U(n) for n in starts), tuple(w), np.float32(0.3))
        low, high = (sum(a * rows[n + m : n + m + 3] for a, n in zip(w, starts, strict=True)) for m in (0, 4))
        np.testing.assert_allclose(found, 0.7 * low + 0.3 * high, atol=3e-6)  # float32, sums of up to 4


@pytest.mark.parametrize("interpolation", bspline_lattice.INTERPOLATIONS)
def test_blended_spline_is_the_lattices(interpolation: str) -> None:
    rng = np.random.default_rng(1)
    shape, points, u = (4, 2, 3), rng.normal(size=(24, 3)), rng.random((50, 3))
    padded = bspline_lattice.padded(points, shape)
    rows = np.zeros((*padded.shape[:-1], 4), np.float32)
    rows[..., :3] = padded
    value, slope = bspline_lattice.evaluate(points, shape, interpolation, u)
    for n, at in enumerate(u):
        found = np.array(_spline(rows.reshape(-1), padded.shape, interpolation == "linear", at))
        np.testing.assert_allclose(found[:3], value[n], atol=3e-6)
        np.testing.assert_allclose(found[3:].reshape(3, 3).T, slope[n], atol=2e-5)  # slopes of up to 10


def nodes_of(edit: Continuous, resolution: int, count: int) -> tuple[Array, Array]:
    """(canonical places [N,3] by the node lattice, by the exact map [N,3]) of random nodes, corners first."""
    shell, (origin, frame) = edit.shell.build(edit.inner, edit.deformed, edit.outer), edit.outer.frame
    assert isinstance(shell, LatticeShell | MeshShell) and shell.problem() is None
    at = np.random.default_rng(2).integers(0, resolution, (count, 3))
    at[:8] = (resolution - 1) * np.stack(np.unravel_index(np.arange(8), (2, 2, 2)), axis=1)
    x = origin + at @ frame.T / (resolution - 1)
    moved = shell.sample(resolution).reshape(*3 * (resolution,), 3)[at[:, 2], at[:, 1], at[:, 0]]
    return x + moved, shell.to_canonical(x)[0]


@pytest.mark.parametrize("resolution", [7, 67])
def test_lines_shorter_and_longer_than_the_kernels_are_the_map(resolution: int) -> None:
    inner = Cage.box((0, 0, 0), 0.5).subdivided((2, 2, 2))
    edit = Edit.continuous(inner, Cage.box((0, 0, 0), 1.2)).move_points((12, 13, 14), (0.02, 0.0, 0.08))
    found, exact = nodes_of(edit, resolution, 400)
    # Of this lattice, strained by h |dv/dz| of up to 0.9, two iterations of a step leave 3e-4 at most.
    assert np.linalg.norm(found - exact, axis=1).max() < 1e-3
    assert np.linalg.norm(found - exact, axis=1).mean() < 3e-5


@pytest.mark.parametrize("turn", [0.5 * np.pi, 0.7])
def test_nodes_of_cages_that_are_turned(turn: float) -> None:
    """A quarter turn leaves no edge along the axis of its number."""
    inner = Cage.box((0.1, 0, 0), (0.4, 0.5, 0.6), (0, 0, turn)).subdivided((2, 2, 2))
    outer = Cage.box((0.1, 0, 0), (1.1, 1.2, 1.3), (0, 0, turn))
    edit = Edit.continuous(inner, outer).move_points((12, 13, 14), (0.02, 0.03, 0.08))
    found, exact = nodes_of(edit, 24, 400)
    assert np.linalg.norm(found - exact, axis=1).max() < 1e-3
    assert np.linalg.norm(found - exact, axis=1).mean() < 3e-5


def test_rounding_of_a_velocity_is_no_velocity() -> None:
    """Sums in float64 leave 1e-17 along axes without motion: subnormal numbers when they are squared."""
    velocities = np.full((1, 2, 2, 2, 3), (1e-17, -0.2, 2e-9), np.float32)
    frame = np.concatenate([np.zeros((1, 3)), np.eye(3), np.eye(3)])
    grid = flow_arguments(velocities, np.ones(1), Cage.box((0, 0, 0), 2.0), frame, 2, 5)[0]
    np.testing.assert_array_equal(np.asarray(grid).reshape(-1, 4)[0], np.float32([0.0, -0.2, 2e-9, 0.0]))
    assert np.finfo(np.float32).eps / 100 > NO_VELOCITY
