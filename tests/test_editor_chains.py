"""A child carried by its parent in the editor's page: chosen, drawn, dragged, undone, saved, in two pages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.edits import load_edits
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
  - name: arm
    inner: {center: [0, 0, 0], size: [0.8, 0.4, 0.4]}
    outer: {margin: 0.6}
    lattice: 16
    operations:
      - rotate_deg: [0, 90, 0]
  - name: finger
    inner: {center: [0.25, 0, 0], size: 0.2}
    outer: {margin: 0.1}
    lattice: 16
"""
LATTICE = """\
version: 1
edits:
  - name: net
    inner: {center: [0, 0, 0], size: [0.6, 0.6, 0.6], lattice: {points: [2, 2, 3]}}
    outer: {margin: 0.35}
    lattice: 16
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A red ball, and edit files beside it."""
    folder = tmp_path_factory.mktemp("chains")
    camera = Camera.look_at((0.0, -3.0, 0.9), (0, 0, 0), width=320, height=230, fov_x=0.8)
    Scene(ball_field(), cameras={"test": (camera,)}).save(folder / "ball")
    (folder / "chain.yaml").write_text(EDITS)
    (folder / "lattice.yaml").write_text(LATTICE)
    return folder / "ball"


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[EditorServer]:
    with editor_server(scene) as running:
        yield running


@pytest.fixture(scope="module")
def editor(server: EditorServer) -> Iterator[EditorPage]:
    with editor_page(server.link) as page:
        page.ready()
        yield page


def corner(editor: EditorPage, edit: int, index: int) -> NDArray[np.float64]:
    """Window coordinates of a corner of an edit's cage."""
    at = editor.page.evaluate(f"cagefield.screen({edit}, 'corner', {index})")
    return np.array([at["x"], at["y"]])


def test_a_child_is_drawn_and_dragged_where_its_parent_carries_it(
    editor: EditorPage, server: EditorServer, scene: Path
) -> None:
    editor.loaded(scene.parent / "chain.yaml")
    arm, finger = editor.state["edits"]
    at_rest = corner(editor, finger["id"], 7)
    row = editor.page.locator(".pane .tp-lblv", has_text="Parent").locator("select")
    editor.changed(lambda: row.select_option(label="arm"))
    assert editor.edit["parent"] == arm["id"]
    # A quarter turn about y takes x to -z: the corner at (.35, .1, .1) is at (.1, .1, -.35).
    carried = editor.page.evaluate("cagefield.project([0.1, 0.1, -0.35])")
    now = corner(editor, finger["id"], 7)
    np.testing.assert_allclose(now, [carried["x"], carried["y"]], atol=0.5)
    assert np.linalg.norm(now - at_rest) > 20
    other = editor.tab(server.link)
    other.ready()
    assert other.edits == editor.edits, "the other page has the chain"
    other.page.close()
    # A drag to the right, x in the picture, is +z of the finger at rest.
    editor.tools(tool="select")
    editor.drag(tuple(now), (12, 0))
    moved = np.subtract(editor.edit["deformed"], editor.edit["inner"])
    assert moved[7, 2] > 0.01 and abs(moved[7, 0]) < 0.2 * moved[7, 2]
    np.testing.assert_allclose(corner(editor, finger["id"], 7) - now, [12, 0], atol=2)
    editor.changed(lambda: editor.press("Control+s"))
    saved = load_edits(scene / "edits.yaml")
    assert saved[1].parent == "arm" and [edit.name for edit in saved.active] == ["finger", "arm"]
    editor.changed(lambda: editor.press("Control+z"))
    editor.changed(lambda: editor.press("Control+z"))
    assert editor.edit["parent"] is None and editor.edit["carrier"] is None


def test_rows_and_planes_of_a_lattice_are_chosen_by_alt_click(editor: EditorPage, scene: Path) -> None:
    editor.loaded(scene.parent / "lattice.yaml")
    editor.tools(tool="select")
    low, high = (np.array(editor.part("point", k)) for k in (5, 9))

    def click(*keys: str) -> list[int]:
        for key in keys:
            editor.page.keyboard.down(key)
        editor.page.mouse.click(*(0.5 * (low + high)))
        for key in keys:
            editor.page.keyboard.up(key)
        return list(editor.page.evaluate("cagefield.now.corners"))

    assert click("Alt") == [1, 5, 9]
    # The camera looks along y: the plane of the row that faces it holds x and z.
    assert click("Alt", "Control") == [0, 1, 4, 5, 8, 9]
    editor.drag(editor.grip("Z"), (0, -10))
    by = np.subtract(editor.edit["points"]["deformed"], editor.edit["points"]["canonical"])
    assert (by[[0, 1, 4, 5, 8, 9], 2] > 0.01).all() and np.allclose(by[[2, 3, 6, 7, 10, 11]], 0.0)
    editor.press("Escape")
