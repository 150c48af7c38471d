"""The map of an edit with a lattice: exact inside, one to one around it, the identity outside."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.edits.random_edits.lattices import random_lattice_edit

from cagefield import Cage, Edit, EditStack
from cagefield.edits import Continuous, MovePoints
from cagefield.errors import EditError
from cagefield.geometry import bspline_lattice, hexahedron
from cagefield.typing import Array
from cagefield.warps import LatticeShell
from cagefield.warps.lattice_flow import sampled, slope_bound
from cagefield.warps.lattice_motion import MOST_TURN, Piece
from tiers import nightly_except

ARM = Cage.box((0, 0, 0), (0.3, 0.3, 1.0)).subdivided((1, 1, 4))
AROUND = Cage.box((0, 0, 0), 2.4)
CUBE = Cage.box((0, 0, 0), 0.6).subdivided((3, 3, 3))
ROOM = Cage.box((0, 0, 0), 1.6)

EDITS: dict[str, Continuous] = {
    "middle row": Edit.continuous(ARM, Cage.box((0, 0, 0), (1.2, 1.2, 1.6))).move_points(
        range(8, 12), (0.25, 0, 0)
    ),
    "bend 90": Edit.continuous(ARM, AROUND).bend("z", np.pi / 2, towards="x"),
    "bend 180": Edit.continuous(ARM, AROUND).bend("z", np.pi, towards="x", fixed="middle"),
    "twist 180": Edit.continuous(ARM, AROUND).twist("z", np.pi),
    "linear": Edit.continuous(CUBE.subdivided((2, 3, 2), "linear"), ROOM)
    .bend("y", 0.8)
    .translate((0.1, 0, 0)),
    "turned": Edit.continuous(CUBE, ROOM).rotate((0.3, 0.2, 1.4)).move_point(5, (0, 0, -0.1)),
    "bent outer cage": Edit.continuous(CUBE, ROOM.move_corner(3, (0.3, 0.2, -0.1)))
    .bend("z", 0.7)
    .scale((1.1, 0.9, 1.0)),
}


def shell_of(edit: Continuous) -> LatticeShell:
    shell = edit.exact_warp.shell
    assert isinstance(shell, LatticeShell)
    return shell


def canonical_points(edit: Continuous, n: int, seed: int = 0) -> Array:
    """Points in the outer cage, half of them in the lattice and near it."""
    rng = np.random.default_rng(seed)
    origin, frame = edit.outer.frame
    A, b = edit.inner.affine
    points = np.concatenate([origin + rng.random((n, 3)) @ frame.T, b + rng.uniform(-0.1, 1.1, (n, 3)) @ A.T])
    return points[edit.outer.contains(points)]


def check_map(edit: Continuous, n: int = 150) -> None:
    """One to one, with its inverse, Jacobians of both directions that belong together."""
    points = canonical_points(edit, n)
    there = edit.exact_warp.to_deformed(points)
    det = np.linalg.det(there.jacobian)
    assert det.min() > 0.0 and np.isfinite(det).all()
    back = edit.exact_warp.to_canonical(there.points)
    scene = np.ptp(edit.outer.corners, axis=0).max()
    assert np.abs(back.points - points).max() < 1e-7 * scene  # rounding, times the stretch on the way
    product = back.jacobian @ there.jacobian
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=1e-4)


@pytest.mark.parametrize("name", EDITS)
def test_maps_of_named_edits(name: str) -> None:
    edit = EDITS[name]
    edit.check()
    check_map(edit)


def test_acceptance_of_the_issue() -> None:
    """An arm of four cells whose middle row moves by (.25, 0, 0), in an outer box."""
    edit = EDITS["middle row"]
    stack = EditStack([edit])
    stack.check()
    p = np.random.default_rng(0).uniform(-1.5, 1.5, (4000, 3))
    outside = ~edit.outer.contains(p)
    mapped = stack.to_canonical(p)
    assert np.abs(mapped.points[outside] - p[outside]).max() < 1e-6
    back = edit.exact_warp.to_deformed(mapped.points).points
    assert np.abs(back - p).max() < 1e-4
    assert np.linalg.det(edit.exact_warp.to_canonical(p).jacobian).min() > 0.0


@pytest.mark.parametrize("name", ["bend 90", "linear", "bent outer cage"])
def test_inside_it_is_the_spline_and_on_the_outer_cage_the_identity(name: str) -> None:
    edit = EDITS[name]
    rng = np.random.default_rng(1)
    u = rng.random((300, 3))
    canonical, deformed = edit.inner.evaluate(u)[0], edit.deformed.evaluate(u)[0]
    warp = edit.exact_warp
    np.testing.assert_allclose(warp.to_deformed(canonical).points, deformed, atol=1e-12)
    np.testing.assert_allclose(warp.to_canonical(deformed).points, canonical, atol=1e-9)
    u[np.arange(300), rng.integers(3, size=300)] = rng.integers(2, size=300)
    on_outer = hexahedron.points(edit.outer.corners, u)
    assert np.abs(shell_of(edit).to_canonical(on_outer)[0] - on_outer).max() < 1e-12


@pytest.mark.parametrize("name", ["bend 90", "linear", "turned"])
def test_map_is_continuous_at_the_faces_of_the_lattice(name: str) -> None:
    edit = EDITS[name]
    rng = np.random.default_rng(2)
    u, rows, axis = rng.random((200, 3)), np.arange(200), rng.integers(3, size=200)
    side = rng.integers(2, size=200)
    step = 1e-9
    u[rows, axis] = side - step * (2 * side - 1)
    inside = edit.exact_warp.to_deformed(edit.inner.evaluate(u)[0]).points
    u[rows, axis] = side + step * (2 * side - 1)
    A, b = edit.inner.affine
    outside = edit.exact_warp.to_deformed(b + u @ A.T).points
    assert np.abs(inside - outside).max() < 1e-7  # two steps, times the stretch


def test_jacobians_are_slopes() -> None:
    edit = EDITS["bend 90"]
    p, h = canonical_points(edit, 100, seed=3), 1e-6
    for to in (edit.exact_warp.to_deformed, edit.exact_warp.to_canonical):
        J = to(p).jacobian
        for axis, step in enumerate(h * np.eye(3)):
            slope = (to(p + step).points - to(p - step).points) / (2.0 * h)
            error = np.abs(J[:, :, axis] - slope).max(axis=1)
            # A few of the differences reach over a kink of the velocity's grid, or the lattice's face.
            assert np.quantile(error, 0.97) < 1e-6


def test_velocity_of_the_kernel_is_the_lattices() -> None:
    """In the lattice and a cell around it the nodes have the velocity of the spline's motion."""
    edit = EDITS["turned"]
    shell = shell_of(edit)
    (piece,), flow = shell.pieces, shell.around.flow  # type: ignore[misc]
    s, h = 0.4, 1e-6
    rng = np.random.default_rng(4)
    u = rng.random((400, 3))

    def place(t: float) -> Array:
        c, F, _, _ = piece.frame(t)
        return np.asarray(c + piece.samples(t, u)[0] @ F.T)

    velocity = (place(s + h) - place(s - h)) / (2.0 * h) @ flow.confines.inverse.T
    z = (place(s) - flow.confines.center) @ flow.confines.inverse.T
    grid = flow._slice(piece, s)
    at = (0.5 * (z + 1.0) * flow.cells).round().astype(int)
    node = 2.0 * at / flow.cells - 1.0
    got = grid[at[:, 2], at[:, 1], at[:, 0]]
    slope = slope_bound(grid)
    assert (np.linalg.norm(got - velocity, axis=1) <= slope * np.linalg.norm(node - z, axis=1) + 1e-4).all()
    assert not grid[0].any() and not grid[:, -1].any() and not grid[:, :, 0].any()
    frame, samples, blur = sampled(piece, s)
    assert samples.shape[0] == 30 and blur > 0.0 and np.isfinite(frame).all()


def test_slope_bound_holds_in_every_cell() -> None:
    rng = np.random.default_rng(5)
    grid = rng.normal(size=(5, 5, 5, 3)).astype(np.float32)
    bound = slope_bound(grid)
    u = rng.random((3000, 3))
    _, J = bspline_lattice.evaluate(grid.reshape(-1, 3).astype(float), (5, 5, 5), "linear", u)
    assert 0.7 * bound < np.linalg.norm(0.5 * J, axis=(1, 2)).max() <= bound


def test_flow_backwards_undoes_it() -> None:
    flow = shell_of(EDITS["bend 180"]).around.flow
    assert flow.is_one_to_one
    z = np.random.default_rng(6).uniform(-1.0, 1.0, (300, 3))
    there, J = flow.through(z)
    back, K = flow.through(there, backwards=True)
    np.testing.assert_allclose(back, z, atol=1e-11)
    np.testing.assert_allclose(K @ J, np.broadcast_to(np.eye(3), J.shape), atol=1e-8)


@pytest.mark.nightly
def test_nodes_are_the_exact_map_to_less_than_their_interpolation() -> None:
    edit = EDITS["bend 90"].replace(lattice=48)
    nodes, exact = edit.lattice_nodes, edit.exact_warp
    assert nodes.shape == (48**3, 3)
    rng = np.random.default_rng(7)
    at = rng.integers(48, size=(500, 3))
    origin, frame = edit.outer.frame
    x = origin + (at / 47.0) @ frame.T
    moved = nodes[at[:, 0] + 48 * (at[:, 1] + 48 * at[:, 2])]
    error = np.linalg.norm(exact.to_canonical(x).points - x - moved, axis=1)
    worst, mean = edit.lattice_error(48, samples=500)
    assert error.mean() < 0.3 * mean and error.max() < 0.3 * worst
    bent = EDITS["bent outer cage"].replace(lattice=16)
    x = bent.outer.frame[0] + bspline_lattice.grid((16, 16, 16)) @ bent.outer.frame[1].T
    np.testing.assert_allclose(bent.lattice_nodes, bent.exact_warp.to_canonical(x).points - x, atol=1e-6)


def test_a_full_turn_follows_the_operations() -> None:
    edit = Edit.continuous(ARM, AROUND).twist("z", 2.0 * np.pi)
    shell = shell_of(edit)
    assert shell.pieces is not None and len(shell.pieces) > 1
    assert all(piece.turn <= MOST_TURN for piece in shell.pieces)
    check_map(edit, 80)
    straight = Piece(edit.inner.points, edit.deformed.handles, (2, 2, 5), "bspline")
    assert not straight.is_one_to_one or straight.turn > MOST_TURN


def test_edits_that_cannot_be_followed_are_refused_with_the_safe_share() -> None:
    edit = Edit.continuous(ARM, Cage.box((0, 0, 0), (1.2, 1.2, 1.6)))
    with pytest.raises(
        EditError, match=r"control point 9 at .* outside face \+x; 0\.7\d of this move of points"
    ):
        edit.move_points(range(8, 12), (0.6, 0, 0)).check()
    share = edit.safe_fraction(MovePoints(tuple(range(8, 12)), (0.6, 0.0, 0.0)))
    assert 0.7 < share < 0.76
    edit.move_points(range(8, 12), (0.6 * share, 0, 0)).check()
    with pytest.raises(EditError, match="before any operation its control points must lie evenly"):
        Edit.continuous(ARM.move_point(3, (0, 0, 0.1)), AROUND).translate((0.1, 0, 0)).check()
    with pytest.raises(EditError, match="has no room before any operation"):
        Edit.continuous(ARM, Cage.box((0, 0, 0), (0.3001, 1.2, 1.6))).translate((0, 0.1, 0)).check()


def test_density_follows_an_edit() -> None:
    """The field of a bent arm is the arm's field at the points that the spline gives back."""
    edit = EDITS["bend 90"]
    u = np.random.default_rng(8).random((100, 3))
    where = EditStack([edit]).to_canonical(edit.deformed.evaluate(u)[0])
    np.testing.assert_allclose(where.points, edit.inner.evaluate(u)[0], atol=1e-9)


@pytest.mark.parametrize("seed", nightly_except(range(6), 1, 3, 4))
def test_random_edits(seed: int) -> None:
    check_map(random_lattice_edit(seed), 100)


def test_correction_does_not_fold_beside_a_corner_between_samples() -> None:
    """An edit whose correction, on the coarsest grid, folds within a twentieth of an edge from its corner."""
    edit = random_lattice_edit(1323)
    A, b = edit.inner.affine
    u = np.random.default_rng(0).uniform([0.98, 0.0, 1.0], [1.02, 0.06, 1.01], (500, 3))
    points = b + u @ A.T
    there = edit.exact_warp.to_deformed(points)
    assert np.linalg.det(there.jacobian).min() > 0.0
    np.testing.assert_allclose(edit.exact_warp.to_canonical(there.points).points, points, atol=1e-7)


@pytest.mark.nightly
@pytest.mark.parametrize("block", range(100))
def test_ten_thousand_random_edits(block: int) -> None:
    for seed in range(100 * block, 100 * (block + 1)):
        check_map(random_lattice_edit(1000 + seed), 60)
