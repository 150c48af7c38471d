"""Boxes and meshes around selections, against closed forms."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.geometry.triangle_mesh import check_crossings
from cagefield.selection import enclosing_mesh
from cagefield.selection.bounding_cages import lattice_cells, oriented_box
from cagefield.selection.enclosing_mesh import CageMesh, cage_mesh
from cagefield.selection.mesh_decimation import decimate
from cagefield.typing import Array
from tiers import nightly_after_first


def box_points(size: tuple[float, float, float], turn: Rotation, count: int = 3000) -> np.ndarray:
    """Points in a box around (1, 2, 3), its corners among them."""
    chance = np.random.default_rng(1)
    u = chance.uniform(-0.5, 0.5, (count, 3))
    u[:8] = np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5])).reshape(3, -1).T
    return turn.apply(u * size) + np.array([1.0, 2.0, 3.0])


@pytest.mark.parametrize("seed", range(6))
def test_the_box_of_a_turned_box(seed: int) -> None:
    turn = Rotation.random(random_state=seed)
    points = box_points((2.0, 0.7, 0.3), turn)
    cage = oriented_box(points)
    edges = np.sort(np.linalg.norm(cage.affine[0], axis=0))
    # 0.3 degrees of the search and a hundredth of the extents beside the quantiles.
    np.testing.assert_allclose(edges, [0.3, 0.7, 2.0], rtol=0.06)
    assert cage.contains(points).mean() > 0.99
    np.testing.assert_allclose(cage.center, (1, 2, 3), atol=0.03)


def test_an_upright_box_stays_upright() -> None:
    points = box_points((0.5, 0.5, 0.5), Rotation.identity())
    cage = oriented_box(points)
    np.testing.assert_allclose(cage.axes, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(cage.aabb, [points.min(axis=0), points.max(axis=0)], atol=1e-9)


def test_few_outliers_do_not_make_the_box_larger() -> None:
    points = box_points((2.0, 0.7, 0.3), Rotation.from_euler("z", 0.5))
    with_outliers = np.concatenate([points, [[30.0, 0, 0], [0, -40.0, 0], [5, 5, 90.0]]])
    np.testing.assert_allclose(
        np.linalg.norm(oriented_box(with_outliers).affine[0], axis=0),
        np.linalg.norm(oriented_box(points).affine[0], axis=0),
        rtol=0.02,
    )


def test_margins_and_radii() -> None:
    points = box_points((1.0, 1.0, 1.0), Rotation.identity())
    plain, wide = oriented_box(points), oriented_box(points, margin=0.1, radii=np.full(len(points), 0.05))
    np.testing.assert_allclose(wide.aabb, plain.aabb + np.array([[-0.15], [0.15]]), atol=1e-9)


def test_axes_of_the_box_are_those_nearest_to_the_world() -> None:
    points = box_points((2.0, 0.7, 0.3), Rotation.from_euler("z", 80, degrees=True))
    axes = oriented_box(points).axes
    assert np.linalg.det(axes) > 0.99 and (np.diagonal(axes) > 0.9).all()


def test_boxes_of_a_point_and_of_a_plane() -> None:
    point = oriented_box(np.ones((1, 3)), margin=0.2)
    np.testing.assert_allclose(point.aabb, [[0.8] * 3, [1.2] * 3])
    assert isinstance(oriented_box(np.ones((1, 3))), Cage)
    plane = oriented_box(box_points((2.0, 1.0, 0.0), Rotation.from_euler("x", 0.7)))
    assert np.linalg.norm(plane.affine[0], axis=0).min() == pytest.approx(2e-3, rel=0.5)
    with pytest.raises(CagefieldError, match="nothing is selected"):
        oriented_box(np.zeros((0, 3)))
    with pytest.raises(CagefieldError, match="margin"):
        oriented_box(np.ones((1, 3)), margin=-1.0)


def test_lattice_cells_are_nearly_cubes() -> None:
    assert lattice_cells(Cage.box((0, 0, 0), (0.3, 0.3, 1.0))) == (1, 1, 4)
    assert lattice_cells(Cage.box((0, 0, 0), (1.0, 1.0, 1.0)), 3) == (3, 3, 3)
    with pytest.raises(CagefieldError, match="1 to 7 cells"):
        lattice_cells(Cage.box((0, 0, 0), 1.0), 8)


def assert_closed(mesh: CageMesh) -> None:
    """Every edge has two faces that run along it in opposite directions; the volume is positive."""
    directed = Counter(
        (int(a), int(b)) for face in mesh.faces for a, b in zip(face, np.roll(face, -1), strict=True)
    )
    assert set(directed.values()) == {1}
    assert all((b, a) in directed for a, b in directed)
    a, b, c = (mesh.vertices[mesh.faces[:, n]] for n in range(3))
    assert np.einsum("ni,ni->", a, np.cross(b, c)) > 0.0


def winding_numbers(mesh: CageMesh, points: np.ndarray) -> np.ndarray:
    """Winding number of the mesh around each point, by solid angles (van Oosterom and Strackee 1983)."""
    a, b, c = (mesh.vertices[mesh.faces[:, n]][None] - points[:, None] for n in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    above = np.einsum("pfi,pfi->pf", a, np.cross(b, c))
    below = la * lb * lc
    for v, w, length in ((a, b, lc), (b, c, la), (c, a, lb)):
        below = below + (v * w).sum(axis=2) * length
    return np.arctan2(above, below).sum(axis=1) / (2.0 * np.pi)


@pytest.mark.parametrize(("faces", "margin"), nightly_after_first([(500, 0.05), (2000, 0.05), (240, 0.01)]))
def test_the_mesh_is_closed_and_encloses_the_selection(faces: int, margin: float) -> None:
    pytest.importorskip("skimage", reason="scikit-image is not installed")
    chance = np.random.default_rng(0)
    points = chance.normal(size=(1500, 3)) * (0.3, 0.1, 0.1)
    points[:, 2] += 2.0 * points[:, 0] ** 2
    mesh = cage_mesh(points, margin, max_faces=faces)
    assert 0.3 * faces < len(mesh.faces) <= faces and margin <= mesh.margin < margin + 0.15
    assert_closed(mesh)
    np.testing.assert_allclose(winding_numbers(mesh, points), 1.0, atol=1e-6)


def test_a_hollow_selection_has_one_surface() -> None:
    """Splats on a sphere: the inside belongs to the cage, whose Euler characteristic is that of a ball."""
    pytest.importorskip("skimage", reason="scikit-image is not installed")
    chance = np.random.default_rng(0)
    points = chance.normal(size=(3000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    mesh = cage_mesh(points, 0.2)
    assert_closed(mesh)
    assert len(mesh.vertices) - len(mesh.faces) // 2 == 2
    np.testing.assert_allclose(winding_numbers(mesh, np.zeros((1, 3))), 1.0, atol=1e-6)
    radius = np.linalg.norm(mesh.vertices, axis=1)
    # Half of a cell, the diagonal of one, and the corners that decimation cuts.
    assert mesh.margin < 0.3 and abs(radius - 1.0 - mesh.margin).max() < 0.12


def test_a_decimated_mesh_that_crosses_itself_is_made_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its collapses may take one part through another: then the level grows."""
    made: list[float] = []

    def decimated(vertices: Array, faces: NDArray[np.int32], most: int) -> tuple[Array, NDArray[np.int32]]:
        v, f = decimate(vertices, faces, most)
        made.append(float(np.ptp(v, axis=0).max()))
        if len(made) == 1:  # the highest vertex goes down through the bottom
            v[np.argmax(v[:, 2])] = v.mean(axis=0) - (0.0, 0.0, 3.0 * made[0])
        return v, f

    monkeypatch.setattr(enclosing_mesh, "decimate", decimated)
    monkeypatch.setattr(enclosing_mesh, "encloses", lambda v, f, p: np.ones(len(p), bool))
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (400, 3))
    mesh = cage_mesh(points, 0.1, max_faces=120)
    assert len(made) == 2 and made[1] > made[0]
    check_crossings(mesh.vertices, mesh.faces)


def test_meshes_that_cannot_be() -> None:
    pytest.importorskip("skimage", reason="scikit-image is not installed")
    with pytest.raises(CagefieldError, match="nothing is selected"):
        cage_mesh(np.zeros((0, 3)), 0.1)
    with pytest.raises(CagefieldError, match="margin"):
        cage_mesh(np.zeros((1, 3)), 0.0)
    with pytest.raises(CagefieldError, match=r"3 faces are too few.*allow 4 or more"):
        cage_mesh(np.zeros((1, 3)), 1.0, max_faces=3)
