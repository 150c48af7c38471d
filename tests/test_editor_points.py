"""Lattices and control points in the editor's page: dragged, undone, saved, and in the help."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.edits import MovePoint, MovePoints, load_edits
from cagefield.geometry.cage import Cage, LatticeCage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.scene.scene import Scene
from editor_page import EditorPage, editor_page
from editor_server import EditorServer, editor_server
from scenes import ball_field

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

EDITS = """\
version: 1
edits:
  - name: middle
    inner: {center: [0, 0, 0], size: [0.6, 0.6, 0.6], lattice: {points: [2, 2, 3]}}
    outer: {margin: 0.35}
    lattice: 16
"""
POINTS = """\
version: 1
edits:
  - name: face
    inner: {points: [[0, 0, -0.3], [0, 0, -0.05], [0, 0, 0.4]], radius: 0.3}
    lattice: 16
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A red ball, and edit files beside it."""
    folder = tmp_path_factory.mktemp("points")
    camera = Camera.look_at((0.0, -3.0, 0.9), (0, 0, 0), width=320, height=230, fov_x=0.8)
    Scene(ball_field(), cameras={"test": (camera,)}).save(folder / "ball")
    (folder / "lattice.yaml").write_text(EDITS)
    (folder / "points.yaml").write_text(POINTS)
    return folder / "ball"


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[EditorServer]:
    with editor_server(scene) as running:
        yield running


@pytest.fixture(scope="module")
def editor(server: EditorServer) -> Iterator[EditorPage]:
    with editor_page(server.link) as page:
        page.ready()
        page.press("n")
        page.settle()
        yield page


def moves(page: EditorPage) -> NDArray[np.float64]:
    """By how much each control point [n,3] of the selected edit has moved."""
    points = page.edit["points"]
    return np.subtract(points["deformed"], points["canonical"], dtype=np.float64)


def test_a_lattice_point_is_dragged_undone_and_saved(editor: EditorPage, scene: Path) -> None:
    editor.loaded(scene.parent / "lattice.yaml")
    assert editor.edit["cage"] == "lattice" and editor.edit["points"]["shape"] == [2, 2, 3]
    editor.tools(tool="select")
    editor.drag(editor.part("point", 9), (10, -8))
    by = moves(editor)
    assert np.linalg.norm(by[9]) > 0.02 and np.allclose(np.delete(by, 9, axis=0), 0.0)
    assert editor.edit["operations"][0].startswith("point move of point 9 by")
    editor.changed(lambda: editor.press("Control+z"))
    assert np.allclose(moves(editor), 0.0)
    editor.changed(lambda: editor.press("Control+Shift+z"))
    assert np.allclose(moves(editor), by)
    editor.changed(lambda: editor.press("Control+s"))
    edit = load_edits(scene / "edits.yaml")[0]
    assert isinstance(edit.inner, LatticeCage) and isinstance(edit.operations[0], MovePoint)
    assert np.allclose(edit.operations[0].by, by[9])


def test_points_chosen_together_follow_the_gizmo(editor: EditorPage, scene: Path) -> None:
    editor.loaded(scene.parent / "lattice.yaml")
    editor.tools(tool="select")
    for point in (8, 9):
        at = editor.part("point", point)
        editor.page.keyboard.down("Shift")
        editor.page.mouse.click(*at)
        editor.page.keyboard.up("Shift")
    editor.until("cagefield.now.corners.length === 2")
    editor.drag(editor.grip("Z"), (0, -10))
    by = moves(editor)
    assert by[8, 2] > 0.01 and np.allclose(by[8], by[9])
    assert np.allclose(np.delete(by, (8, 9), axis=0), 0.0)
    editor.press("Escape")


def test_a_control_point_is_dragged_with_a_radius(editor: EditorPage, scene: Path) -> None:
    editor.loaded(scene.parent / "points.yaml")
    editor.tools(tool="select")
    assert editor.edit["cage"] == "points"
    editor.press("o")
    editor.until("cagefield.now.proportional")
    assert "Shift+O" in editor.said("O is proportional editing")

    def drag() -> None:
        with editor.held(editor.part("point", 1), (12, 0)):
            before = editor.page.evaluate("cagefield.drag.followed.radius")
            editor.page.mouse.wheel(0, -100)
            editor.until(f"cagefield.drag.followed.radius > {before}")

    editor.changed(drag)
    by = moves(editor)
    share = np.linalg.norm(by, axis=1) / np.linalg.norm(by[1])
    assert 0.05 < share[0] < 1.0 and share[2] < share[0]
    text = editor.edit["operations"][0]
    assert text.startswith("move of points 1 by")
    editor.changed(lambda: editor.press("Control+s"))
    move = load_edits(scene / "edits.yaml")[0].operations[0]
    assert isinstance(move, MovePoints) and move.radius > 0.0 and move.points == (1,)
    editor.changed(lambda: editor.press("Control+z"))
    assert np.allclose(moves(editor), 0.0)
    editor.press("o")
    editor.until("!cagefield.now.proportional")


def test_a_mesh_file_becomes_a_cage_whose_edges_are_dragged(editor: EditorPage, scene: Path) -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    mesh = MeshCage.of_box(Cage.box((0, 0, 0), 0.7))
    obj = "".join(f"v {x} {y} {z}\n" for x, y, z in mesh.vertices)
    obj += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in mesh.triangles)
    file = scene.parent / "cube.obj"
    file.write_text(obj)
    editor.changed(lambda: editor.page.set_input_files("input.mesh-file", file))
    editor.tools(mode="edit", tool="select", axes="world")
    assert editor.edit["cage"] == "mesh" and editor.edit["name"] == "cube"
    edges = editor.edit["points"]["edges"]
    assert len(edges) == 18
    empty = editor.pixels()
    drawn = np.abs(editor.pixels(cages=True) - empty).max(axis=2) > 0.1
    # A line of the net, away from vertices, is drawn: the middle of the diagonal of a face to the camera.
    points = np.array(editor.edit["points"]["deformed"])
    pairs = [(i, j) for i, j in edges if np.allclose(points[[i, j], 1], -0.35)]
    i, j = next(pair for pair in pairs if np.linalg.norm(np.subtract(*points[list(pair)])) > 0.9)
    middle = editor.page.evaluate(f"cagefield.project({(0.6 * points[i] + 0.4 * points[j]).tolist()})")
    x, y = round(middle["x"] - editor.box["x"]), round(middle["y"] - editor.box["y"])
    assert drawn[y - 3 : y + 4, x - 3 : x + 4].any()
    editor.drag((middle["x"], middle["y"]), (8, 6))
    by = moves(editor)
    assert np.linalg.norm(by[i]) > 0.01 and np.allclose(by[i], by[j])
    assert np.allclose(np.delete(by, (i, j), axis=0), 0.0)
    bad = scene.parent / "open.obj"
    bad.write_text("".join(line for line in obj.splitlines(True)[:-1]))
    editor.page.set_input_files("input.mesh-file", bad)
    assert "open.obj: mesh is open" in editor.said("mesh is open")


def test_keys_do_nothing_else_during_a_drag(editor: EditorPage, scene: Path) -> None:
    editor.loaded(scene.parent / "lattice.yaml")
    editor.tools(tool="select")
    editor.drag(editor.part("point", 8), (-8, -6))
    before, edits = editor.state["entry"], editor.edits
    editor.page.evaluate(
        "window.unheld = []; addEventListener('keydown', e => e.defaultPrevented || unheld.push(e.key))"
    )
    with editor.held(editor.part("point", 9), (10, -8)):
        editor.until("cagefield.drag !== null && cagefield.drag.seq > 0")
        editor.press("Control+z", "Control+Shift+z", "Delete", "Alt+o", "Control+d", "Control+s", "Tab")
        assert editor.page.evaluate("unheld.filter(key => !['Control', 'Shift', 'Alt'].includes(key))") == []
        assert editor.page.evaluate("cagefield.drag !== null && cagefield.now.mode === 'edit'")
        editor.press("Escape")
        editor.until("cagefield.drag === null")
    editor.settle()
    assert editor.state["entry"] == before and editor.edits == edits


def test_a_drag_is_given_up_where_another_page_undoes(editor: EditorPage, server: EditorServer) -> None:
    editor.tools(tool="select")
    other = editor.tab(server.link)
    other.ready()
    editor.page.bring_to_front()
    start, entry = editor.part("point", 9), editor.state["entry"]
    with editor.held(start, (16, -10)):
        editor.until("cagefield.drag !== null && cagefield.drag.seq > 0")
        other.press("Control+z")
        editor.until(f"cagefield.drag === null && cagefield.now.state.entry === {entry - 1}")
        editor.said("this drag is over")
        np.testing.assert_allclose(editor.part("point", 9), start, atol=0.1)
        editor.page.mouse.move(start[0] + 30, start[1])
        np.testing.assert_allclose(editor.part("point", 9), start, atol=0.1)
    editor.settle()
    assert editor.state["entry"] == entry - 1 and np.allclose(moves(editor), 0.0)
    assert other.edits == editor.edits
    other.page.close()
    editor.page.bring_to_front()
    editor.drag(editor.part("point", 9), (10, -8))
    assert np.linalg.norm(moves(editor)[9]) > 0.02


def test_the_help_lists_the_keys(editor: EditorPage) -> None:
    editor.press("?")
    editor.until("!document.querySelector('.help').hidden")
    words = editor.page.inner_text(".help")
    for line in ("Proportional editing", "radius of proportional editing", "Ctrl+double-click", "Shift+O"):
        assert line in words
    editor.press("Escape")


def test_the_cages_are_hidden_by_the_new_key(editor: EditorPage) -> None:
    editor.press("Shift+O")
    editor.until("!cagefield.now.cages")
    editor.press("Shift+O")
    editor.until("cagefield.now.cages")
