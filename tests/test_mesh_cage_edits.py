"""Edits of mesh cages on their way to pictures: voxels, splats, a selection, the editor's session."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from cagefield.cameras.camera import Camera, turntable
from cagefield.cli import main
from cagefield.edits import Edit, EditStack, MovePoint, Rotate, Twist, load_edits
from cagefield.edits.partial_edit import partial_edit
from cagefield.errors import EditError
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.scene.scene import Scene
from cagefield.server.editor.document import Document
from cagefield.server.editor.session import Session
from cagefield.server.protocol.conversion import edit_state
from scenes import ball_scene
from splat_scenes import BALL_RADIUS, ball_and_floor

ROOM = Cage.box((0, 0, 0), 2.4)


def ball_cage(radius: float, level: int = 1) -> MeshCage:
    mesh = trimesh.creation.icosphere(level, radius)
    return MeshCage(mesh.vertices, mesh.faces)


@pytest.fixture(params=["voxels", "splats"])
def scene(request: pytest.FixtureRequest) -> Scene:
    return ball_scene() if request.param == "voxels" else Scene(ball_and_floor())


def camera() -> Camera:
    return turntable((0, 0, 0), 3.0, 1, elevation=0.6, width=64, height=48, fov_x=0.8)[0]


def test_a_cube_of_triangles_is_shown_as_the_box(scene: Scene) -> None:
    """The oracle: the box's own exact map; the ball, all of it inside, moves alike."""
    # The ball of voxels, of radius .5, ends half a cell further out; that of splats stands on a floor.
    box = Cage.box((0, 0, 0), 1.3 if isinstance(scene.field, VoxelField) else 0.78)

    def picture(inner: Cage) -> np.ndarray:
        edit = Edit.continuous(inner, ROOM, relight="none", fill="none").translate((0.0, 0.3, 0.1))
        return scene.with_edits(EditStack([edit])).render(camera()).rgb

    mesh, plain = picture(MeshCage.of_box(box)), scene.render(camera()).rgb
    difference = np.abs(mesh - picture(box))
    assert np.abs(mesh - plain).mean() > 10.0 * difference.mean()
    assert difference.mean() < 3e-3


def test_a_vertex_pulls_the_field_along(scene: Scene) -> None:
    cage = ball_cage(0.6)
    top = int(np.argmax(cage.vertices[:, 2]))
    edit = Edit.continuous(cage, ROOM).move_points([top], (0, 0, 0.4), radius=0.5)
    before, after = (scene.with_edits(EditStack(e)).render(camera()) for e in ([], [edit]))
    assert np.isfinite(after.rgb).all() and np.abs(after.rgb - before.rgb).mean() > 1e-3
    half = partial_edit(edit, 0.5)
    assert half is not None and half.is_possible


def test_a_selection_becomes_a_mesh_cage(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    Scene(ball_and_floor()).save(tmp_path / "scene")
    cage = str(tmp_path / "cage.yaml")
    arguments = ["select", str(tmp_path / "scene"), "--flood", "0", "0", "0.25", "--to-cage", cage]
    arguments += ["--cage", "mesh", "--margin", "0.05", "--faces", "120"]
    assert main(arguments) == 0, capsys.readouterr().err
    (edit,) = load_edits(cage)
    assert isinstance(edit.inner, MeshCage) and len(edit.inner.triangles) <= 120
    field = ball_and_floor()
    on_ball = np.linalg.norm(field.means, axis=1) < 1.1 * BALL_RADIUS
    assert edit.inner.contains(field.means[on_ball]).all()
    assert edit.translate((0.05, 0, 0)).is_possible
    applied = ["edit", str(tmp_path / "scene"), cage, "-o", str(tmp_path / "edited")]
    assert main(applied) == 0, capsys.readouterr().err
    assert Scene.open(tmp_path / "edited").edits[0] == edit


def test_the_session_drags_vertices_and_undoes() -> None:
    edit = Edit.continuous(ball_cage(0.4), ROOM, name="ball")
    s = Session(Document.from_edits([edit]), np.array([[-1.0] * 3, [1.0] * 3]), 0.01)
    s.apply(1, "field", MovePoint(3, (0.0, 0.1, 0.0)))
    s.apply(1, "field", Rotate((0.0, 0.0, 30.0)))
    s.apply(1, "field", Twist("z", 20.0))
    entry = s.document.entry(1)
    state = edit_state(entry, None, None)
    assert state.cage == "mesh" and state.points is not None and state.points.radius is None
    np.testing.assert_allclose(state.points.deformed, entry.edit.deformed.handles)
    with pytest.raises(EditError, match="a mesh cage has no cells"):
        s.subdivide(1, (2, 2, 2), "bspline")
    for _ in range(3):
        s.undo()
    assert s.document.entry(1).edit == edit
