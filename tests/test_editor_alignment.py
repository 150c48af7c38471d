"""The editor's page: up by three points and by the floor, a paste aligned by pairs, a page for download."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack
from cagefield.scene.scene import Scene
from editor_page import EditorPage, asking, editor_page
from editor_server import editor_server
from splat_scenes import splat_scene

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

SHIFT = np.array([0.9, 0.0, 0.3])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A ball of splats and its camera, the ball pasted beside itself by SHIFT."""
    camera = Camera.look_at((0.4, -3.0, 0.0), (0.4, 0, 0), width=480, height=360, fov_x=1.0)
    scene = dataclasses.replace(splat_scene(), cameras={"test": (camera,)}, edits=EditStack())
    scene.save(tmp_path / "ball")
    dataclasses.replace(scene, cameras={}).save(tmp_path / "other")
    paste = Scene.open(tmp_path / "ball").paste("../other", name="other")
    paste = paste.replace(operations=(), fill="none", relight="none").translate(tuple(SHIFT))
    Scene.open(tmp_path / "ball").with_edits(EditStack([paste])).save(tmp_path / "ball", overwrite=True)
    return tmp_path / "ball"


def click(editor: EditorPage, point: np.ndarray) -> None:
    """A click on a world point."""
    at = editor.page.evaluate(f"cagefield.project({point.tolist()})")
    editor.page.mouse.click(at["x"], at["y"])


def test_up_by_points_a_paste_by_pairs_and_a_page(folder: Path, tmp_path: Path) -> None:
    with editor_server(folder) as server, editor_page(asking(server.link, "server"), 1100, 640) as editor:
        page = editor.page
        editor.ready()
        editor.press("Shift+A")
        front = np.array([[0.0, -0.45, 0.2], [0.2, -0.45, -0.1], [-0.2, -0.45, -0.1]])
        for count, point in enumerate(front, start=1):
            click(editor, point + SHIFT)
            editor.until(f"cagefield.now.picked.points.length === {2 * count - 1}")
            click(editor, point)
            editor.until(f"cagefield.now.picked.points.length === {2 * count}")
        editor.changed(lambda: page.click("dialog[open] button.primary"))
        assert page.evaluate("cagefield.now.picked") is None
        corners = np.array(editor.edit["deformed"])
        rest = Scene.open(folder).edits[0].inner.corners
        assert np.abs(corners - rest).max() < 0.05 < np.abs(SHIFT).max()
        assert editor.state["history"][-1] == "Align of other"
        editor.changed(lambda: editor.press("Control+z"))
        np.testing.assert_allclose(np.array(editor.edit["deformed"]), rest + SHIFT, atol=1e-9)
        # Up by three points of the ball: the view turns about the normal of their plane.
        editor.press("Shift+Y")
        for count, point in enumerate(front[:2], start=1):
            click(editor, point)
            editor.until(f"cagefield.now.picked.points.length === {count}")
        assert page.is_hidden(".hint")  # a double click would put a point
        editor.changed(lambda: click(editor, front[2]))
        editor.said("up: normal of the three points, tilted by")
        up = np.array(editor.state["up"])
        assert np.linalg.norm(up) == pytest.approx(1.0)
        assert "Up: (" in page.inner_text(".up-direction")
        right = np.array(page.evaluate("cagefield.camera.c2w")).reshape(4, 4)[:3, 0]
        assert abs(right @ up) < 1e-5
        page.click(".up-floor")
        editor.said("no plane is nearly level")
        # A page of the document as it is, unsaved.
        page.click("button.download")
        page.select_option("dialog[open] select[name=form]", "levels")
        assert page.is_visible("dialog[open] input[name=budget]")
        assert not page.is_visible("dialog[open] input[name=splats]")
        page.click("dialog[open] button.primary")
        editor.said("it needs no levels of detail")
        page.click("button.download")
        page.select_option("dialog[open] select[name=form]", "page")
        with page.expect_download(timeout=240_000) as download:
            page.click("dialog[open] button.primary")
        assert download.value.suggested_filename == "ball.html"
        download.value.save_as(tmp_path / "page.html")
        assert f'"up": [{up[0]}' in (tmp_path / "page.html").read_text()
        editor.changed(lambda: editor.press("Control+s"))
    np.testing.assert_allclose(Scene.open(folder).up, up)
