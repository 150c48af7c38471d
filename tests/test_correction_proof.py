"""The proof of lattice shells' corrections: every bound against dense samples, verdicts of known maps."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.correction_proof import beyond, first_patches, least_det, proof

from cagefield import Edit
from cagefield.geometry import bspline_lattice
from cagefield.warps.lattice_shell import Surroundings
from test_lattice_shell import CUBE, EDITS, ROOM, shell_of

pytestmark = pytest.mark.nightly  # kernels of benchmarks are compiled in every process


def test_range_of_slopes_holds_all_and_is_reached() -> None:
    from benchmarks.correction_bounds import slope_range

    rng = np.random.default_rng(0)
    grid = rng.normal(size=(6, 6, 6, 3)).astype(np.float32)
    for size in (0.02, 0.3, 0.9):
        m, R = rng.uniform(-0.9, 0.9, 3), size * rng.random(3)
        middle, spread = np.empty((3, 3)), np.empty((3, 3))
        slope_range(grid, m, R, middle, spread)
        low, high = (m - R).clip(-1.0, 1.0), (m + R).clip(-1.0, 1.0)
        z = low + (high - low) * rng.random((20_000, 3))
        z[:8000] = np.where(rng.random((8000, 3)) < 0.5, low, high)  # a rectangle's ends
        z = np.concatenate([z, (0.4 * np.round(2.5 * (z + 1.0)) - 1.0 + 1e-12).clip(low, high)])  # nodes
        _, J = bspline_lattice.evaluate(
            grid.reshape(-1, 3).astype(float), (6, 6, 6), "linear", 0.5 * (z + 1.0)
        )
        off = np.abs(0.5 * J - middle)
        assert (off <= spread + 1e-9).all()
        assert (off.max(axis=0) >= 0.8 * spread).all()


@pytest.mark.parametrize("name", ["turned", "linear", "bend 90"])
def test_bounds_hold_the_slopes_of_the_flow(name: str) -> None:
    from benchmarks.correction_bounds import flow_bound

    around = shell_of(EDITS[name]).around
    confines = around.flow.confines
    A, _ = around.inner.affine
    rng, held = np.random.default_rng(1), 0
    for _ in range(20):
        side, b, c = rng.integers(2), *rng.uniform(0.05, 0.95, 2)
        half = 10.0 ** rng.uniform(-3.0, -1.7)
        center = np.array([[side, b, c]])
        u = center + half * rng.uniform(-1.0, 1.0, (300, 3)) * [0.0, 1.0, 1.0]

        def slopes(u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            x, D = around.lattice(u)
            z = (x - confines.center) @ confines.inverse.T
            start = confines.inverse @ D @ A[:, 1:]
            _, J = around.flow.through(z, backwards=True)
            return start, J @ start, z

        start, end, _ = slopes(u)
        start0, _, z0 = slopes(center)
        spread = float(np.linalg.norm(start - start0, axis=(1, 2)).max())
        x, K = z0[0].copy(), np.ascontiguousarray(start0[0])
        grids, steps = around.flow.velocities, around.flow.steps
        bound, found = flow_bound(grids, steps, x, K, 1.01 * spread, half, half, np.empty((30, 3)))
        if found:
            held += 1
            assert np.linalg.norm(end - K, axis=(1, 2)).max() <= bound + 1e-9
    assert held > 3


def test_intervals_hold_the_fade() -> None:
    from benchmarks.correction_patches import fade_range

    around = shell_of(EDITS["turned"]).around
    confines = around.flow.confines
    A, b = around.inner.affine
    rng = np.random.default_rng(2)
    for _ in range(40):
        u = np.array([1.0 + 0.4 * rng.random(), *rng.random(2)])  # beyond +x
        half = 0.05 * rng.random(3)
        v = u + half * rng.uniform(-1.0, 1.0, (500, 3))
        v[:, 0] = np.maximum(v[:, 0], 1.0)
        v[:, 1:] = v[:, 1:].clip(0.0, 1.0)
        X = b + v @ A.T
        z = (X - confines.center) @ confines.inverse.T
        inside = np.abs(z).max(axis=1) < 1.0
        if not inside.any():
            continue
        X, z, v = X[inside], z[inside], v[inside]
        d_i = (v[:, 0] - 1.0) * np.linalg.norm(A[:, 0])
        gradient = np.linalg.norm(A[:, 0]) * (np.linalg.inv(A) @ confines.frame)[0]
        rho, drho = np.empty(2), np.empty((6, 3))
        heights, no = confines.heights, np.zeros(3)
        assert fade_range(z.min(0), z.max(0), heights, d_i.min(), d_i.max(), gradient, no, rho, drho)
        value, slope = around._rho(X, around.material(X))
        assert (np.abs(value - rho[0]) <= rho[1] + 1e-12).all()
        assert (np.abs(slope @ confines.frame - drho[0]) <= drho[1] + 1e-9).all()


def test_points_beyond_patches_are_around_the_cage_and_all_patches_cover_it() -> None:
    around = shell_of(EDITS["turned"]).around
    rows = first_patches(CUBE.shape)
    points = beyond(around, rows, 3, np.random.default_rng(3))
    u = around.material(points)
    assert ROOM.contains(points).all() and ((u < 0.0) | (u > 1.0)).any(axis=1).all()
    out = ((u < 0.0) | (u > 1.0)).sum(axis=1)
    assert (out == 1.0 + rows[:, 2].repeat(3)).all()
    for kind, area in enumerate((6.0, 12.0, 8.0)):
        mine = rows[rows[:, 2] == kind]
        sizes = mine[:, 4::2] - mine[:, 3::2]
        assert np.prod(np.where(sizes > 0.0, sizes, 1.0), axis=1).sum() == pytest.approx(area)


def test_small_edits_are_proven() -> None:
    edits = (
        Edit.continuous(CUBE, ROOM).translate((0.1, 0.05, 0.0)),
        Edit.continuous(CUBE, ROOM).move_point(21, (0.0, 0.02, 0.04)),
        Edit.continuous(CUBE.subdivided((2, 2, 2), "linear"), ROOM).move_point(0, (0.03, 0.0, 0.0)),
    )
    for edit in edits:
        found = proof(shell_of(edit).around, 0.005, 8000)
        assert found.open == 0 and len(found.left) == 0 and found.evaluated > 90


def test_a_correction_is_proven_until_it_folds() -> None:
    """A lattice that its flow does not follow at all: R shifts by rho, which falls by 1.5 per gap of 0.5."""
    still = shell_of(Edit.continuous(CUBE, ROOM).translate((0.0, 0.0, 1e-9))).around
    steep, folded = (
        Surroundings(still.inner, CUBE.translate((by, 0.0, 0.0)), still.flow) for by in (0.3, 0.4)
    )
    rows = first_patches(CUBE.shape)
    assert proof(steep, 0.01, 4000).open == 0 and 0.0 < least_det(steep, rows) < 0.3
    found = proof(folded, 0.05, 2000)
    assert found.open > 0 and least_det(folded, found.left) < 0.0
    assert {tuple(row[:2]) for row in found.left[found.left[:, 2] == 0]} == {(0.0, 1.0)}  # in front of it
