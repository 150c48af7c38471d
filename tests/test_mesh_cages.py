"""Mesh cages: validation, mean value coordinates, and the flow that follows the vertices."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from benchmarks.edits.random_edits.meshes import KINDS, random_mesh, random_mesh_edit

from cagefield.edits import Continuous, Edit
from cagefield.errors import CageError, EditError
from cagefield.geometry.cage import Cage
from cagefield.geometry.mean_value import mean_value_coordinates
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.typing import Array
from cagefield.warps import MeshShell
from cagefield.warps.lattice_flow import slope_bound
from cagefield.warps.mesh_flow import MeshPiece, blend
from tiers import nightly_except

BOX = Cage.box((0, 0, 0), 0.8)
CUBE = MeshCage.of_box(BOX)
OUTER = Cage.box((0, 0, 0), 2.4)


def sphere(level: int = 2, radius: float = 0.5) -> MeshCage:
    mesh = trimesh.creation.icosphere(level, radius)
    return MeshCage(mesh.vertices, mesh.faces)


def shell_of(edit: Continuous) -> MeshShell:
    shell = edit.exact_warp.shell
    assert isinstance(shell, MeshShell)
    return shell


def points_in(edit: Continuous, count: int, seed: int = 0) -> Array:
    origin, frame = edit.outer.frame
    return origin + np.random.default_rng(seed).random((count, 3)) @ frame.T


# ---- the mesh ----


def test_meshes_that_are_no_cage_are_refused() -> None:
    v, t = CUBE.vertices, CUBE.triangles
    with pytest.raises(CageError, match=r"open: edge \[\d, \d\] has one triangle \(3 such edges\)"):
        MeshCage(v, t[1:])
    with pytest.raises(CageError, match="inside out"):
        MeshCage(v, t[:, ::-1])
    with pytest.raises(CageError, match="vertex 3 of the mesh must be finite"):
        MeshCage(np.where(np.arange(8)[:, None] == 3, np.nan, v), t)
    with pytest.raises(CageError, match="0 triangles"):
        MeshCage(v, np.zeros((0, 3), dtype=int))
    with pytest.raises(CageError, match="face opposite ways"):
        MeshCage(v, np.concatenate([t[:1, ::-1], t[1:]]))
    with pytest.raises(CageError, match=r"name vertices 0 to 7, got 0 to 9"):
        MeshCage(v, np.where(t == 7, 9, t))
    with pytest.raises(CageError, match="vertex 8 of the mesh belongs to no triangle"):
        MeshCage(np.concatenate([v, [[0, 0, 0]]]), t)
    with pytest.raises(CageError, match=r"triangle \d+ of the mesh, vertices .* is flat|no volume"):
        MeshCage(v * (1, 1, 0), t)
    with pytest.raises(CageError, match="branches"):
        MeshCage(v, np.concatenate([t, t]))
    with pytest.raises(CageError, match="has 2562 vertices, a mesh cage has 4 to 512"):
        sphere(4)
    with pytest.raises(CageError, match=r"crosses itself: edge .* goes through the triangle"):
        sphere(1).move_point(0, -2.3 * sphere(1).vertices[0])


def test_inside_is_that_of_the_surface() -> None:
    p = np.random.default_rng(0).uniform(-0.6, 0.6, (2000, 3))
    assert (CUBE.contains(p) == BOX.contains(p)).all()
    mesh = trimesh.creation.icosphere(2, 0.5)
    assert np.isclose(sphere().contains(p).mean() * 1.2**3, mesh.volume, rtol=0.1)


@pytest.mark.parametrize("kind", KINDS)
def test_coordinates_reproduce_affine_functions(kind: str) -> None:
    cage = random_mesh(np.random.default_rng(3), kind)
    p = np.random.default_rng(0).uniform(-0.8, 0.8, (200, 3))
    L = mean_value_coordinates(cage.vertices, cage.triangles, p)
    np.testing.assert_allclose(L @ cage.vertices, p, atol=1e-8)
    if kind not in ("concave", "decimated"):
        assert L[cage.contains(p)].min() >= -1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_the_kernel_blends_by_mean_value_coordinates_inside(kind: str) -> None:
    rng = np.random.default_rng(5)
    cage = random_mesh(rng, kind)
    p, motion = rng.uniform(-0.8, 0.8, (400, 3)), rng.normal(size=cage.vertices.shape)
    found = blend(p, cage.vertices, cage.triangles, motion, far=1e9)
    inside = cage.contains(p)
    assert ((found[:, 3] == 0.0) == inside).all() and inside.any()
    L = mean_value_coordinates(cage.vertices, cage.triangles, p[inside])
    np.testing.assert_allclose(found[inside, :3], L @ motion, atol=1e-7)
    # Outside a mean: within the extent of the motion.
    rest = found[~inside, :3]
    assert (rest >= motion.min(axis=0) - 1e-9).all() and (rest <= motion.max(axis=0) + 1e-9).all()
    # On the surface it is the motion of the surface, from both sides.
    weights = rng.dirichlet((2, 2, 2), len(cage.triangles))
    at = np.einsum("fk,fki->fi", weights, cage.vertices[cage.triangles])
    normal = np.cross(
        *(cage.vertices[cage.triangles[:, n]] - cage.vertices[cage.triangles[:, 0]] for n in (1, 2))
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    wanted = np.einsum("fk,fki->fi", weights, motion[cage.triangles])
    for side in (-1e-6, 1e-6):
        near = blend(at + side * normal, cage.vertices, cage.triangles, motion)
        np.testing.assert_allclose(near[:, :3], wanted, atol=2e-3)


def test_far_triangles_by_one_value_make_the_same_blend() -> None:
    cage = sphere()
    p, motion = np.random.default_rng(2).uniform(-0.9, 0.9, (1000, 3)), cage.vertices**2
    exact = blend(p, cage.vertices, cage.triangles, motion, far=1e9)
    found = blend(p, cage.vertices, cage.triangles, motion)
    assert ((found[:, 3] == 0.0) == (exact[:, 3] == 0.0)).all()
    assert 0.0 < np.abs(found[:, :3] - exact[:, :3]).max() < 0.02 * np.ptp(motion)
    # Over the inside of a triangle, not over its edges, the distance is exact.
    assert (found[:, 3] >= exact[:, 3] - 1e-12).all() and (found[:, 3] - exact[:, 3]).max() < 0.01


def test_distances_are_those_of_the_surface() -> None:
    p = np.random.default_rng(0).uniform(-1.2, 1.2, (2000, 3))
    found = blend(p, CUBE.vertices, CUBE.triangles, np.zeros((8, 3)))
    np.testing.assert_allclose(found[:, 3], np.linalg.norm((np.abs(p) - 0.4).clip(0.0), axis=1), atol=1e-12)


# ---- the flow ----


def test_a_cube_moves_as_a_box_does() -> None:
    box, mesh = Edit.continuous(BOX, OUTER), Edit.continuous(CUBE, OUTER)
    p = points_in(box, 4000)
    inside = BOX.contains(p)
    for operate in (
        lambda e: e.translate((0.3, -0.2, 0.1)),
        lambda e: e.rotate((0.2, 0.1, 1.0)),
        lambda e: e.rotate((0, 0, 0.7)).scale((1.2, 0.9, 1.0)).translate((0.1, 0, 0)),
    ):
        there, here = operate(box).exact_warp.to_deformed(p), operate(mesh).exact_warp.to_deformed(p)
        np.testing.assert_allclose(here.points[inside], there.points[inside], atol=2e-6)
        np.testing.assert_allclose(here.jacobian[inside], there.jacobian[inside], atol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_an_affine_motion_is_that_map_inside(kind: str) -> None:
    inner = random_mesh(np.random.default_rng(1), kind)
    edit = Edit.continuous(inner, OUTER).rotate((0.3, -0.4, 0.9)).shear(xy=0.2).translate((0.1, 0.1, -0.2))
    A = np.linalg.lstsq(
        np.c_[inner.vertices, np.ones(len(inner.vertices))], edit.deformed.handles, rcond=None
    )[0]
    p = points_in(edit, 3000)
    p = p[inner.contains(p)]
    np.testing.assert_allclose(
        edit.exact_warp.to_deformed(p).points, np.c_[p, np.ones(len(p))] @ A, atol=2e-6
    )


def test_vertices_go_where_they_are_moved() -> None:
    for edit, most in (
        (Edit.continuous(sphere(), OUTER).bend("z", 1.2), 5e-3),
        (Edit.continuous(sphere(), OUTER).twist("z", 2.0), 5e-3),
        (Edit.continuous(CUBE, OUTER).move_point(7, (0.2, 0.1, 0.1)), 5e-3),
    ):
        got = edit.exact_warp.to_deformed(edit.inner.handles).points
        np.testing.assert_allclose(got, edit.deformed.handles, atol=most)


def check(edit: Continuous, seed: int, samples: int) -> None:
    """Identity outside, positive determinants, round trip, and a Jacobian that is the derivative."""
    edit.check()
    shell, warp = shell_of(edit), edit.exact_warp
    p = np.concatenate([points_in(edit, samples, seed), edit.inner.handles])
    mapped = warp.to_deformed(p)
    assert (np.linalg.det(mapped.jacobian) > 0.0).all()
    back = warp.to_canonical(mapped.points)
    np.testing.assert_allclose(back.points, p, atol=1e-7)
    product = back.jacobian @ mapped.jacobian
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=1e-3)
    low, high = edit.outer.aabb
    beyond = np.random.default_rng(seed).uniform(low - 0.5, high + 0.5, (samples, 3))
    beyond = beyond[~edit.outer.contains(beyond)]
    assert (warp.to_canonical(beyond).points == beyond).all()
    origin, frame = edit.outer.frame
    u = np.random.default_rng(seed).random((60, 3))
    u[np.arange(60), np.arange(60) % 3] = np.arange(60) // 3 % 2
    face = origin + u @ frame.T
    np.testing.assert_allclose(warp.to_canonical(face).points, face, atol=1e-6)
    if edit.changes_anything:
        steepest = [h * slope_bound(v) for v, h in zip(shell.flow.velocities, shell.flow.steps, strict=True)]
        assert max(steepest) < 2.0


@pytest.mark.parametrize("seed", nightly_except(range(20), 5, 7))
def test_random_edits_do_not_fold(seed: int) -> None:
    check(random_mesh_edit(seed), seed, 300)


@pytest.mark.nightly
def test_two_hundred_random_edits_do_not_fold() -> None:
    edits = [random_mesh_edit(seed) for seed in range(200)]
    assert np.mean([edit.changes_anything for edit in edits]) > 0.95
    for seed, edit in enumerate(edits):
        check(edit, seed, 300)


def test_jacobians_are_derivatives() -> None:
    edit = Edit.continuous(sphere(1), OUTER).move_point(3, (0.1, 0.2, 0.0)).rotate((0, 0, 0.8))
    p, h = points_in(edit, 300), 1e-6
    J = edit.exact_warp.to_deformed(p).jacobian
    for axis in range(3):
        e = h * np.eye(3)[axis]
        slope = edit.exact_warp.to_deformed(p + e).points - edit.exact_warp.to_deformed(p - e).points
        error = np.abs(slope / (2.0 * h) - J[:, :, axis]).max(axis=1)
        assert np.quantile(error, 0.97) < 1e-5  # but for points at the faces of the grid's cells


def test_a_chord_takes_vertices_and_affine_maps_exactly() -> None:
    cage = sphere(1)
    piece = MeshPiece(cage.vertices, cage.rotate((0.3, 0.2, 2.0)).move_point(2, (0.1, 0, 0)).vertices)
    B, b, middle, residual = piece.chord(0.25, 0.25)
    (before, after), *_ = piece.at(np.array([0.25, 0.5]))
    np.testing.assert_allclose(before + 0.25 * (middle @ B.T + b + residual), after, atol=1e-12)
    still = MeshPiece(cage.vertices, cage.rotate((0.3, 0.2, 2.0)).vertices).chord(0.0, 1 / 6)
    assert not still[3].any()


def test_a_lattice_of_nodes_is_the_map() -> None:
    edit = Edit.continuous(sphere(1), OUTER).rotate((0, 0.3, 1.0)).move_point(0, (0.1, 0.1, 0))
    shell, n = shell_of(edit), 16
    origin, frame = edit.outer.frame
    z, y, x = np.meshgrid(*3 * (np.linspace(0, 1, n),), indexing="ij")
    nodes = origin + np.stack([x, y, z], axis=-1).reshape(-1, 3) @ frame.T
    np.testing.assert_allclose(nodes + shell.sample(n), shell.to_canonical(nodes)[0], atol=1e-4)


@pytest.mark.nightly
def test_edits_without_room_say_so() -> None:
    near = Edit.continuous(CUBE, Cage.box((0, 0, 0), 0.81))
    with pytest.raises(EditError, match=r"no room: the gap between the mesh and the outer cage"):
        near.check()
    gone = Edit.continuous(CUBE, OUTER).translate((1.0, 0, 0))
    with pytest.raises(
        EditError, match=r"vertex \d at .* is 0.2 outside face \+x; 0.7\d of this translation"
    ):
        gone.check()
    bent = Edit.continuous(CUBE, OUTER.move_corner(7, (0.1, 0, 0)))
    with pytest.raises(EditError, match="an outer cage with parallel faces only; give it a box"):
        bent.check()
    with pytest.raises(CageError, match="no corners, edges or faces; use move_point"):
        CUBE.move_corner(0, (0.1, 0, 0))
    with pytest.raises(EditError, match="a move needs a cage with 8 corners, not mesh cages"):
        Edit.move(CUBE)


def test_operations_are_those_of_all_cages() -> None:
    cage = sphere(1)
    moved = cage.rotate((0, 0, np.pi / 2)).translate((1, 0, 0))
    np.testing.assert_allclose(
        moved.vertices, cage.vertices @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + [1, 0, 0], atol=1e-12
    )
    assert moved.contains([[1, 0, 0.2]])[0] and not cage.contains([[1, 0, 0.2]])[0]
    assert cage.mirrored(0, 0.5).mirrored(0, 0.5).has_shape_of(cage) or np.allclose(
        cage.mirrored(0, 0.5).mirrored(0, 0.5).vertices, cage.vertices
    )
    assert cage.corners.shape == (8, 3) and Cage(cage.corners).contains(0.999 * cage.vertices).all()
    assert cage == MeshCage(cage.vertices, cage.triangles) != cage.move_point(0, (0.01, 0, 0))
