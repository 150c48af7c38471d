"""Meshes as outer cages: the identity outside of them, one to one inside, vertices where they are dragged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from cagefield.edits import Continuous, Edit, EditStack, dump_edits, load_edits, parse_edits
from cagefield.errors import EditError
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.typing import Array
from cagefield.warps.mesh_flow import distance_inside
from cagefield.warps.mesh_shell import MeshShell

ROOM = Cage.box((0, 0, 0), 2.0)


def ball(radius: float, level: int = 2) -> MeshCage:
    mesh = trimesh.creation.icosphere(level, radius)
    return MeshCage(mesh.vertices, mesh.faces)


def peanut() -> MeshCage:
    """A concave mesh of length 2 along x, narrow in the middle."""
    mesh = trimesh.creation.icosphere(3, 1.0)
    v = np.array(mesh.vertices)
    v[:, 1:] *= (0.3 + 0.6 * v[:, :1] ** 2) / 0.9
    faces = np.array(mesh.faces)
    from cagefield.selection.mesh_decimation import decimate

    return MeshCage(*decimate(v, faces.astype(np.int32), 400))


EDITS: dict[str, Continuous] = {
    "ball in ball": Edit.continuous(ball(0.35, 1), ball(1.0)).translate((0.2, 0.1, 0)),
    "turned box": Edit.continuous(MeshCage.of_box(Cage.box((0, 0, 0), 0.5)), ball(1.0)).rotate((0, 0, 1.2)),
    "vertex": Edit.continuous(ball(0.35, 1), ball(1.0)).move_points([3], (0.1, 0, 0.1), radius=0.4),
    "in a concave mesh": Edit.continuous(MeshCage.of_box(Cage.box((-0.45, 0, 0), 0.25)), peanut()).translate(
        (0.2, 0, 0)
    ),
}


def outer_of(edit: Continuous) -> MeshCage:
    assert isinstance(edit.outer, MeshCage)
    return edit.outer


def points_of(edit: Continuous, n: int = 4000) -> Array:
    """Points of the box around the outer mesh, and a little more."""
    low, high = edit.outer.aabb
    return np.random.default_rng(0).uniform(low - 0.1, high + 0.1, (n, 3))


@pytest.mark.parametrize("name", EDITS)
def test_identity_outside_one_to_one_inside_and_back(name: str) -> None:
    edit = EDITS[name]
    edit.check()
    warp, p = edit.exact_warp, points_of(edit)
    there = warp.to_deformed(p)
    outside = ~edit.outer.contains(p)
    assert outside.sum() > 500 and (there.points[outside] == p[outside]).all()
    assert np.linalg.det(there.jacobian).min() > 0.0
    np.testing.assert_allclose(warp.to_canonical(there.points).points, p, atol=1e-7)
    assert np.abs(there.points - p).max() > 0.05
    # The flow itself, without the region, is the identity at once beyond the surface: no seam.
    shell = warp.shell
    assert isinstance(shell, MeshShell)
    low, high = edit.outer.aabb
    near = p[outside & ((p > low) & (p < high)).all(axis=1)]
    assert len(near) > 200 and (shell.to_deformed(near)[0] == near).all()
    assert (shell.to_canonical(near)[0] == near).all()
    surface, _ = trimesh.sample.sample_surface(
        trimesh.Trimesh(outer_of(edit).vertices, outer_of(edit).triangles), 500
    )
    np.testing.assert_allclose(shell.to_deformed(surface)[0], surface, atol=1e-12)


@pytest.mark.parametrize("name", EDITS)
def test_vertices_go_where_they_are_dragged(name: str) -> None:
    edit = EDITS[name]
    moved = edit.exact_warp.to_deformed(edit.inner.handles).points
    # As in a box as outer cage: a thousandth of it.
    assert np.abs(moved - edit.deformed.handles).max() < 2e-3


def test_distances_inside_are_those_of_the_surface() -> None:
    mesh = peanut()
    p = points_of(EDITS["in a concave mesh"], 400)
    surface, _ = trimesh.sample.sample_surface(
        trimesh.Trimesh(mesh.vertices, mesh.triangles), 300_000, seed=1
    )
    oracle = np.where(mesh.contains(p), cKDTree(surface).query(p)[0], 0.0)
    assert (oracle > 0.0).sum() > 100
    np.testing.assert_allclose(distance_inside(mesh, p), oracle, atol=0.01)  # samples are that far apart


def test_it_gives_way_less_than_in_the_box_around_it() -> None:
    """Beside the narrow middle of the outer mesh nothing moves that a box around it would move."""
    edit = EDITS["in a concave mesh"]
    box = edit.replace(outer=Cage(edit.outer.corners))
    p = points_of(edit)
    beside = p[~edit.outer.contains(p) & box.outer.contains(p)]
    assert np.abs(box.exact_warp.to_deformed(beside).points - beside).max() > 0.01
    assert (edit.exact_warp.to_deformed(beside).points == beside).all()


def test_lattices_of_it_are_off_by_little() -> None:
    edit = EDITS["ball in ball"]
    most, mean = edit.replace(lattice=64).lattice_error()
    assert 0.0 < mean < most < 0.02


@pytest.mark.nightly
def test_what_cannot_be_is_refused() -> None:
    box = Cage.box((0, 0, 0), 0.5)
    with pytest.raises(EditError, match=r"a mesh as outer cage holds a mesh alone; give MeshCage\.of_box"):
        Edit.continuous(box, ball(1.0))
    with pytest.raises(EditError, match=r"vertex \d+ at .* is outside of its mesh; enlarge the outer cage"):
        Edit.continuous(ball(0.5), ball(0.4)).translate((0.1, 0, 0)).check()
    far = Edit.continuous(ball(0.35, 1), ball(1.0)).translate((0.9, 0, 0))
    with pytest.raises(EditError, match="is outside of its mesh"):
        far.check()
    assert 0.2 < far.safe_fraction() < 0.7
    near = far.replace(operations=()).translate((0.6, 0, 0))
    with pytest.raises(EditError, match=r"comes to within .* of the outer cage on its way, and must stay"):
        near.check()
    # Through the notch of a concave outer mesh: the vertices are inside at both ends, not on their way.
    small = Edit.continuous(MeshCage.of_box(Cage.box((-0.65, 0.18, 0), 0.08)), peanut())
    assert small.translate((0.05, 0, 0)).is_possible
    assert not small.translate((1.2, 0, 0)).is_possible


def test_files_hold_it(tmp_path: Path) -> None:
    edit = EDITS["in a concave mesh"].replace(name="waist")
    (again,) = parse_edits(dump_edits(EditStack([edit])))
    assert isinstance(again, Continuous) and again == edit and isinstance(again.outer, MeshCage)
    trimesh.Trimesh(outer_of(edit).vertices, outer_of(edit).triangles).export(tmp_path / "around.obj")
    (tmp_path / "edits.yaml").write_text(
        "version: 1\nedits:\n  - inner: {mesh: {file: in.obj}}\n    outer: {mesh: {file: around.obj}}\n"
    )
    assert isinstance(edit.inner, MeshCage)
    trimesh.Trimesh(edit.inner.vertices, edit.inner.triangles).export(tmp_path / "in.obj")
    (read,) = load_edits(tmp_path / "edits.yaml")
    assert isinstance(read, Continuous) and isinstance(read.outer, MeshCage)
    np.testing.assert_allclose(
        np.ptp(read.outer.handles, axis=0), np.ptp(edit.outer.handles, axis=0), atol=1e-6
    )
