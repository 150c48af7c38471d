"""Mean value and harmonic stand-ins for the peers' deformations, and the measures of distortion."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np
import pytest
from benchmarks.edits.baselines import PEERS, HarmonicShell
from benchmarks.edits.baselines.harmonic import conjugate_gradients
from benchmarks.edits.baselines.mean_value import ClosedMesh, cube_surface
from benchmarks.edits.distortion import distortion, shell_points
from benchmarks.edits.methods import MAPS, METHODS, Peer, check_known, exact_map
from scipy import sparse

from cagefield.edits import Edit, EditStack, Flow
from cagefield.edits.device_stack import DeviceStack
from cagefield.errors import CagefieldError, EditError
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.hexahedron_map import HexahedronMap

INNER, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)
EDIT = Edit.continuous(INNER, OUTER)
MOVED = EDIT.translate((0.1, 0.05, -0.05))
TURNED = EDIT.rotate((0.1, 0.2, 0.5)).scale((1.2, 0.9, 1.1))
BENT = EDIT.move_corner(7, (0.2, 0.1, 0.15)).move_edge((0, 1), (0.0, -0.1, 0.05))
NODES = 33
"""Nodes of the harmonic map's grid along each axis: half of the usual ones, 0.05 apart."""


@cache
def shell(name: str, edit: Edit) -> Callable[[Array], tuple[Array, Array]]:
    assert edit.outer is not None
    if name == "harmonic":
        return HarmonicShell(HexahedronMap(edit.inner, edit.deformed), edit.outer, NODES).to_canonical
    return PEERS[name](edit.inner, edit.deformed, edit.outer).to_canonical


def differences(f: Callable[[Array], Array], p: Array, step: float) -> Array:
    """Central differences [N,C,3]."""
    columns = [(f(p + step * e) - f(p - step * e)) / (2 * step) for e in np.eye(3)]
    return np.stack(columns, axis=-1)


# -- mean value coordinates of a mesh ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def hollow() -> ClosedMesh:
    """A cube [0,1]^3 with a turned, smaller cube as a hole."""
    u, triangles = cube_surface(2)
    hole = Cage.box((0.5, 0.55, 0.45), 0.3, (0.3, 0.2, 0.1)).affine
    inner = hole[1] + u @ hole[0].T
    return ClosedMesh(np.concatenate([u, inner]), np.concatenate([triangles, triangles[:, ::-1] + len(u)]))


def test_cube_surface_is_closed_and_faces_outwards() -> None:
    for splits in (1, 3):
        u, triangles = cube_surface(splits)
        assert len(u) == (splits + 1) ** 3 - (splits - 1) ** 3 and len(triangles) == 12 * splits**2
        a, b, c = (u[triangles[:, i]] - 0.5 for i in range(3))
        volumes = np.linalg.det(np.stack([a, b, c], axis=1)) / 6
        assert volumes.sum() == pytest.approx(1.0) and (volumes > 0).all()
        assert np.bincount(ClosedMesh(u, triangles).edges[1].ravel()).tolist() == [2] * (18 * splits**2)


def test_linear_functions_are_reproduced(hollow: ClosedMesh) -> None:
    rng = np.random.default_rng(0)
    A, b = rng.normal(size=(2, 3)), rng.normal(size=2)
    p = rng.uniform(0, 1, (400, 3))
    value, slope = hollow.interpolate(hollow.vertices @ A.T + b, p)
    # exact up to rounding, which the nearness of the triangles' planes (1e-5 or so) makes larger
    np.testing.assert_allclose(value, p @ A.T + b, atol=1e-9)
    np.testing.assert_allclose(slope, np.broadcast_to(A, slope.shape), atol=1e-8)


def test_coordinates_are_a_partition_of_unity_that_interpolates(hollow: ClosedMesh) -> None:
    """The values of the coordinate functions: the interpolants of the unit vectors."""
    unit = np.eye(len(hollow.vertices))
    p = np.random.default_rng(1).uniform(0, 1, (50, 3))
    weights, slope = hollow.interpolate(unit, p)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(slope.sum(axis=1), 0.0, atol=1e-9)
    np.testing.assert_allclose(weights @ hollow.vertices, p, atol=1e-12)
    # At a point of a triangle: its barycentric coordinates, as near as the 3e-7 that it is moved off it.
    share = np.array([0.5, 0.3, 0.2])
    for triangle in hollow.triangles[::7]:
        (weights,), _ = hollow.interpolate(unit, (share @ hollow.vertices[triangle])[None])
        expected = np.zeros(len(unit))
        expected[triangle] = share
        np.testing.assert_allclose(weights, expected, atol=1e-4)


def test_centre_of_a_regular_mesh_gives_all_vertices_their_due() -> None:
    """By symmetry the octahedron's center is the mean of its vertices, the cube's mean of corners."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    triangles = []
    for x, y, z in product((0, 1), (2, 3), (4, 5)):
        face = [x, y, z]
        triangles.append(face if np.linalg.det(vertices[face]) > 0 else face[::-1])
    values = np.random.default_rng(2).normal(size=(6, 1))
    value, _ = ClosedMesh(vertices, np.array(triangles)).interpolate(values, np.array([[0.0, 0.0, 0.0]]))
    assert value[0, 0] == pytest.approx(values.mean(), abs=1e-6)  # the center lies in no face's plane


def test_against_the_integral_over_the_sphere(hollow: ClosedMesh) -> None:
    """Ju et al., equation 3: f averaged over the unit sphere around p with weight 1/distance, signed."""
    values = np.sin(3 * hollow.vertices[:, :1]) + hollow.vertices[:, 1:2] ** 2
    p = np.array([[0.2, 0.3, 0.8], [0.85, 0.12, 0.4]])
    got, _ = hollow.interpolate(values, p)
    n = 60
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    keep = (i + j < n).ravel()
    first = np.stack([i.ravel() + 1 / 3, j.ravel() + 1 / 3], axis=1)[keep]
    second = np.stack([i.ravel() + 2 / 3, j.ravel() + 2 / 3], axis=1)[(i + j < n - 1).ravel()]
    st = np.concatenate([first, second]) / n  # centroids of n^2 equal triangles
    corners = hollow.vertices[hollow.triangles]
    for point, value in zip(p, got[:, 0], strict=True):
        above = below = 0.0
        for (a, b, c), triangle in zip(corners, hollow.triangles, strict=True):
            x = a + st[:, :1] * (b - a) + st[:, 1:] * (c - a) - point
            f = values[triangle, 0] @ np.stack([1 - st.sum(axis=1), st[:, 0], st[:, 1]])
            r = np.linalg.norm(x, axis=1)
            solid = x @ np.cross(b - a, c - a) / 2 / len(st) / r**3
            above, below = above + (f * solid / r).sum(), below + (solid / r).sum()
        assert value == pytest.approx(above / below, abs=2e-4)  # midpoint rule, 3600 points a triangle


# -- the shell maps ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PEERS)
@pytest.mark.parametrize("edit", [TURNED, BENT], ids=["turned", "bent"])
def test_jacobians_by_finite_differences(name: str, edit: Edit) -> None:
    to_canonical = shell(name, edit)
    p = shell_points(edit, 300)
    step = 1e-6
    if name == "harmonic":  # linear along each axis within a cell of the grid: away from its faces, exact
        nodes = (p + 0.8) / 1.6 * (NODES - 1)
        p = p[(np.abs(nodes - np.round(nodes)) > 1e-3).all(axis=1)]
    J = to_canonical(p)[1]
    # second order in the step, rounding 1e-16 / 1e-6 of values whose third derivative is up to 1e3 near edges
    np.testing.assert_allclose(J, differences(lambda q: to_canonical(q)[0], p, step), atol=2e-6)


@pytest.mark.parametrize("name", PEERS)
@pytest.mark.parametrize("edit", [TURNED, BENT], ids=["turned", "bent"])
def test_shells_are_the_identity_outside_and_phi_inside(name: str, edit: Edit) -> None:
    rng = np.random.default_rng(3)
    u = rng.random((400, 3))
    u[np.arange(400), rng.integers(0, 3, 400)] = rng.integers(0, 2, 400)
    to_canonical = shell(name, edit)
    outside = OUTER.affine[1] + u @ OUTER.affine[0].T
    # mean value: read 3e-7 of the mesh beside the face; harmonic: the box's faces are rows of nodes
    off = 5e-6 if name == "mean value" else 1e-12
    np.testing.assert_allclose(to_canonical(outside)[0], outside, atol=off)
    canonical = hexahedron.points(edit.inner.corners, u)
    inside = hexahedron.points(edit.deformed.corners, u)
    error = np.linalg.norm(to_canonical(inside)[0] - canonical, axis=1)
    on_edge = (np.abs(u - 0.5) > 0.4).sum(axis=1) > 1
    if name == "harmonic":  # an eighth of the spacing of 0.05; more at edges, where slopes are not bounded
        assert error.mean() < 0.00625 and error[~on_edge].max() < 0.01
    elif edit is TURNED:
        assert error.max() < 5e-6
    else:  # bilinear faces as 9 pairs of triangles: a bend of 0.3 / 4 / 9
        assert error.mean() < 0.002 and error.max() < 0.009


@pytest.mark.parametrize("name", PEERS)
def test_no_motion_is_the_identity(name: str) -> None:
    p = shell_points(EDIT, 200)
    points, J = shell(name, EDIT)(p)
    np.testing.assert_array_equal(points, p)
    np.testing.assert_array_equal(J, np.broadcast_to(np.eye(3), J.shape))


def test_harmonic_layers_in_closed_form() -> None:
    """Between two plates the harmonic displacement is linear; far from the ends a slab is such a pair."""
    outer = Cage.box((0, 0, 0), (4.0, 4.0, 0.8))
    inner = Cage.box((0, 0, 0), (3.9, 3.9, 0.2))
    edit = Edit.continuous(inner, outer).translate((0, 0, 0.1))
    # 33 nodes, 0.025 apart: the plates at -0.4, 0.0, 0.2 and 0.4 are rows of them
    harmonic = HarmonicShell(HexahedronMap(inner, edit.deformed), outer, 33)
    z = np.linspace(-0.4, 0.4, 41)
    p = np.stack([0 * z, 0 * z, z], axis=1)
    expected = -0.1 * np.interp(z, [-0.4, 0.0, 0.2, 0.4], [0, 1, 1, 0])
    # what comes in from the slab's ends falls as exp(-pi * 1.9 / 0.4): 3e-7
    np.testing.assert_allclose(harmonic.to_canonical(p)[0] - p, np.outer(expected, [0, 0, 1]), atol=2e-6)


def test_harmonic_displacement_around_a_ball() -> None:
    """A moved ball in a ball would displace by (1/r - 1/R) / (1/a - 1/R); boxes agree with that from afar.

    Checked as harmonic functions are: the mean over a sphere in the shell is the value at its middle.
    """
    to_canonical = shell("harmonic", MOVED)
    rng = np.random.default_rng(4)
    ball = rng.normal(size=(4000, 3))
    ball = np.concatenate([ball, -ball])
    ball *= 0.12 / np.linalg.norm(ball, axis=1, keepdims=True)
    for middle in ([0.6, 0.1, 0.0], [-0.3, 0.6, 0.1], [-0.55, -0.5, 0.5]):
        p = np.array(middle) + ball
        at = to_canonical(np.array([middle]))[0] - middle
        # the seven-point scheme and the trilinear interpolation are of second order: (1/20)^2 of 0.1 or so
        np.testing.assert_allclose((to_canonical(p)[0] - p).mean(axis=0), at[0], atol=1e-3)
        # the maximum principle, with respect to the cages' displacements
        moved = to_canonical(p)[0] - p
        low, high = np.array([[-0.1, -0.05, 0.0], [0.0, 0.0, 0.05]])
        assert (moved >= low - 1e-9).all() and (moved <= high + 1e-9).all()


def test_harmonic_converges_with_its_grid() -> None:
    p = shell_points(TURNED, 2000)
    phi = HexahedronMap(TURNED.inner, TURNED.deformed)
    maps = [HarmonicShell(phi, OUTER, n).to_canonical(p)[0] for n in (9, 17, 33)]
    coarse, fine = (np.linalg.norm(maps[i] - maps[i + 1], axis=1).mean() for i in range(2))
    assert coarse / fine > 1.6  # second order would be 4; slopes are not bounded at the inner cage's edges


def test_harmonic_grid_lies_along_a_turned_outer_cage() -> None:
    """The edit turned as a whole gives the map turned as a whole."""
    whole = Cage.box((0.1, 0.2, 0.3), 1.0, (0.4, -0.3, 0.7))
    A, b = whole.affine
    cages = [Cage(b + cage.corners @ A.T) for cage in (INNER, MOVED.deformed, OUTER)]
    p = shell_points(MOVED, 300)
    # The same grid, turned: equal but for its solver's tolerance.
    inner, deformed, outer = cages
    turned = HarmonicShell(HexahedronMap(inner, deformed), outer, NODES).to_canonical(b + p @ A.T)[0]
    np.testing.assert_allclose(turned, b + shell("harmonic", MOVED)(p)[0] @ A.T, atol=1e-5)


def test_conjugate_gradients_solve() -> None:
    rng = np.random.default_rng(5)
    B = rng.normal(size=(30, 30))
    A = B @ B.T + 5 * np.eye(30)
    right = np.stack([rng.normal(size=30), np.zeros(30)], axis=1)
    x = conjugate_gradients(sparse.csr_array(A), right, np.zeros((30, 2)))
    np.testing.assert_allclose(A @ x, right, atol=1e-5)


@pytest.mark.nightly
@pytest.mark.parametrize("name", PEERS)
def test_an_edit_takes_a_peer_by_name(name: str) -> None:
    """phi inside, the identity outside; and the kernel reads the same from a lattice of the peer's map."""
    p = np.random.default_rng(6).uniform(-1.2, 1.2, (3000, 3))
    exact = TURNED.exact_warp.to_canonical(p)
    edit = TURNED.replace(shell=Peer(name))
    mapped = edit.exact_warp.to_canonical(p)
    in_shell = OUTER.contains(p) & ~TURNED.deformed.contains(p)
    np.testing.assert_array_equal(mapped.points[~in_shell], exact.points[~in_shell])
    np.testing.assert_array_equal(mapped.jacobian[~in_shell], exact.jacobian[~in_shell])
    expected = PEERS[name](TURNED.inner, TURNED.deformed, OUTER).to_canonical(p[in_shell])
    np.testing.assert_array_equal(mapped.points[in_shell], expected[0])
    np.testing.assert_array_equal(mapped.jacobian[in_shell], expected[1])

    coarse = EditStack([edit.replace(lattice=24)])
    d = np.broadcast_to(np.float32([0.6, 0.0, 0.8]), p.shape)
    got = DeviceStack.from_stack(coarse).to_canonical(p.astype(np.float32), d)
    reference = coarse.to_canonical(p.astype(np.float32), d)
    near = np.abs(got[0] - reference.points).max(axis=1) < 1e-5  # float32
    assert near.mean() > 0.999  # all but points within float32's rounding of a cage's face
    with pytest.raises(EditError, match="Shell has no kernel; set a lattice"):
        DeviceStack.from_stack(EditStack([edit]))
    with pytest.raises(EditError, match="has no map to deformed space; use shell"):
        edit.exact_warp.to_deformed(p)


def test_methods_change_shells_alone() -> None:
    stack = EditStack([Edit.delete(INNER), TURNED.replace(shell=Flow(width=0.5))])
    for name, method in METHODS.items():
        first, second = method.of_all(stack)
        assert first == stack[0]
        assert (second.shell.name, second.lattice) == (method.shell, method.lattice), name
        assert second.operations == TURNED.operations
        assert method.shell != "flow" or second.shell == Flow(width=0.5)


# -- folding and distortion --------------------------------------------------------------------------------


@pytest.mark.nightly
def test_peers_fold_under_large_turns_and_not_under_small_ones() -> None:
    for name in PEERS:
        small, large = (EDIT.rotate((0, 0, np.radians(deg))) for deg in (15, 90))
        assert not distortion(exact_map(name, small), small, samples=4000).folds
        folding = exact_map(name, large)
        assert folding.shell.least_ratio() < 0.0  # type: ignore[attr-defined]
        measured = distortion(folding, large, samples=4000)
        assert measured.folds and measured.folded > 0.005


def test_a_folded_trilinear_shell_is_seen_to_fold() -> None:
    edit = EDIT.rotate((0, 0, np.radians(60)))
    measured = distortion(exact_map("trilinear", edit), edit, samples=4000)
    assert measured.folds and measured.folded > 0.01
    small = EDIT.rotate((0, 0, np.radians(15)))
    measured = distortion(exact_map("trilinear", small), small, samples=4000)
    assert not measured.folds and measured.folded == 0.0


def test_a_flow_does_not_fold() -> None:
    edit = EDIT.rotate((0, 0, np.radians(120)))
    measured = distortion(exact_map("flow", edit), edit, samples=2000)
    assert 0.1 < measured.least_det < 1.0 and measured.folded == 0.0


def test_distortion_in_closed_form() -> None:
    """A map that scales the shell by (2, 1, 1/4) and turns it: J - R is diag(1, 0, -3/4), turned."""

    class Linear:
        def to_canonical(self, points: Array) -> object:
            R = Cage.box((0, 0, 0), 1.0, (0.3, 0.5, 0.7)).axes
            J = np.broadcast_to(R @ np.diag([2.0, 1.0, 0.25]), (len(points), 3, 3))
            return type("Mapped", (), {"points": points, "jacobian": J})

    measured = distortion(Linear(), EDIT, samples=100)  # type: ignore[arg-type]
    assert measured.least_det == pytest.approx(0.5)
    assert measured.stretch == pytest.approx(4.0)
    assert measured.rigidity == pytest.approx(1.25)
    assert measured.folded == 0.0


def test_points_of_the_shell() -> None:
    p = shell_points(TURNED, 500)
    assert len(p) == 500 and OUTER.contains(p).all() and not TURNED.deformed.contains(p).any()
    with pytest.raises(CagefieldError, match='edit "" has no outer cage'):
        shell_points(Edit.delete(INNER), 5)
    with pytest.raises(CagefieldError, match="fills its outer cage; leave a gap"):
        shell_points(Edit.continuous(INNER, INNER), 5)


def test_methods_that_cannot_be() -> None:
    assert set(MAPS) == {"flow", "trilinear", "mean value", "harmonic"}
    with pytest.raises(CagefieldError, match="there is no method 'trilinear 7'; choose from flow, "):
        check_known(("flow", "trilinear 7"))
    with pytest.raises(CagefieldError, match="there is no method 'green'; choose from"):
        exact_map("green", EDIT)
    with pytest.raises(CagefieldError, match='edit "x" is discrete and has no shell'):
        exact_map("harmonic", Edit.delete(INNER, name="x"))
    with pytest.raises(EditError, match="outer cage must contain the inner cage"):
        exact_map("mean value", EDIT.translate((0.9, 0, 0)))
