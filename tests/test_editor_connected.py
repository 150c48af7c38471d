"""Connected control points in the editor's page: switched by key and panel, undone, saved, in two pages; a
child that follows while its parent is dragged."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.edits import load_edits
from cagefield.geometry.control_points import ControlPoints
from cagefield.scene.scene import Scene
from editor_page import EditorPage, editor_page
from editor_server import EditorServer, editor_server
from slabs import slabs

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

EDITS = """\
version: 1
edits:
  - name: box
    inner: {center: [0.25, 0, -0.2], size: 0.3}
    outer: {margin: 0.1}
    lattice: 16
  - name: tip
    inner: {points: [[-0.25, 0, 0.4]], radius: 0.8}
    lattice: 16
    operations:
      - translate: [0, 0, 0.3]
  - name: nail
    inner: {center: [0.25, 0, 0.3], size: 0.15}
    outer: {margin: 0.05}
    lattice: 16
    parent: tip
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two slabs side by side, and an edit file beside them."""
    folder = tmp_path_factory.mktemp("connected")
    camera = Camera.look_at((0.0, -3.0, 0.5), (0, 0, 0.1), width=320, height=230, fov_x=0.8)
    Scene(slabs(), cameras={"test": (camera,)}).save(folder / "slabs")
    (folder / "edits.yaml").write_text(EDITS)
    return folder / "slabs"


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[EditorServer]:
    with editor_server(scene) as running:
        yield running


@pytest.fixture(scope="module")
def editor(server: EditorServer) -> Iterator[EditorPage]:
    with editor_page(server.link) as page:
        page.ready()
        yield page


def select(editor: EditorPage, name: str) -> int:
    """The number of the edit of a name, selected."""
    number = next(edit["id"] for edit in editor.state["edits"] if edit["name"] == name)
    editor.page.locator(f'.edits .edit[data-edit="{number}"]').click()
    editor.until(f"cagefield.now.state.selected === {number}")
    return int(number)


def corner(editor: EditorPage, edit: int, index: int) -> np.ndarray:
    """Window coordinates of a corner of an edit's cage."""
    at = editor.page.evaluate(f"cagefield.screen({edit}, 'corner', {index})")
    return np.array([at["x"], at["y"]])


def test_connected_only_is_switched_undone_saved_and_shared(
    editor: EditorPage, server: EditorServer, scene: Path
) -> None:
    editor.loaded(scene.parent / "edits.yaml")
    nail = next(edit["id"] for edit in editor.state["edits"] if edit["name"] == "nail")
    at_rest = "cagefield.now.state.edits.find((edit) => edit.name === 'nail').carrier === null"
    select(editor, "tip")
    editor.settle()
    assert not editor.edit["points"]["connected"]
    carried = corner(editor, nail, 7)
    plain = editor.pixels()
    editor.changed(lambda: editor.press("Alt+o"))
    assert editor.edit["points"]["connected"] and "connected only is on" in editor.said("connected only")
    # The slab beside the tip's stays, and the cage on it, once the detours are known.
    editor.until(at_rest)
    assert corner(editor, nail, 7)[1] - carried[1] > 5
    moved = np.abs(editor.pixels() - plain).max(axis=2) > 0.2
    assert moved.sum() > 100
    other = editor.tab(server.link)
    other.ready()
    assert other.edits == editor.edits, "the other page has it too"
    other.page.close()
    editor.changed(lambda: editor.press("Control+s"))
    points = load_edits(scene / "edits.yaml")[1].inner
    assert isinstance(points, ControlPoints) and points.connected
    editor.changed(lambda: editor.press("Control+z"))
    assert not editor.edit["points"]["connected"]
    editor.until(f"!({at_rest})")
    # And by the panel.
    box = editor.page.locator(".pane .tp-lblv", has_text="Connected only").locator("input")
    editor.changed(lambda: box.evaluate("input => input.click()"))
    assert editor.edit["points"]["connected"]
    editor.changed(lambda: editor.press("Control+z"))
    select(editor, "box")
    editor.press("Alt+o")
    editor.said("connected only is for control points")


def test_a_child_follows_while_its_parent_is_dragged(editor: EditorPage, scene: Path) -> None:
    editor.loaded(scene.parent / "edits.yaml")
    nail = next(edit["id"] for edit in editor.state["edits"] if edit["name"] == "nail")
    select(editor, "tip")
    editor.tools(tool="select")
    editor.press("n")  # the panel would be over the tip
    editor.settle()
    before = corner(editor, nail, 7)

    def drag() -> None:
        with editor.held(editor.part("point", 0), (0, -20)):
            editor.until(f"cagefield.screen({nail}, 'corner', 7).y < {before[1] - 2}")
            assert editor.page.evaluate("cagefield.drag !== null")

    editor.changed(drag)
    after = corner(editor, nail, 7)
    assert after[1] < before[1] - 2
    editor.changed(lambda: editor.press("Control+z"))
    np.testing.assert_allclose(corner(editor, nail, 7), before, atol=0.5)
    # A drag that is given up takes the child back.
    with editor.held(editor.part("point", 0), (0, -20)):
        editor.until(f"cagefield.screen({nail}, 'corner', 7).y < {before[1] - 2}")
        editor.press("Escape")
        editor.until(f"Math.abs(cagefield.screen({nail}, 'corner', 7).y - {before[1]}) < 0.5")
