"""The measuring tool of the editor's page: two clicks, a distance, and the scene's scale in meters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.scene.scene import Scene
from editor_page import editor_page
from editor_server import editor_server
from scenes import ball_field

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

RADIUS = 0.5


def test_a_measured_distance_sets_the_scale(tmp_path: Path) -> None:
    """Between two points of a ball's surface; the length is that of the points that the clicks hit."""
    camera = Camera.look_at((0.0, -3.0, 0.0), (0, 0, 0), width=320, height=230, fov_x=0.8)
    Scene(ball_field(radius=RADIUS), cameras={"test": (camera,)}).save(tmp_path / "ball")
    with editor_server(tmp_path / "ball") as server, editor_page(server.link) as editor:
        page = editor.page
        editor.ready()
        editor.press("n")
        editor.settle()
        editor.press("Shift+M")
        assert page.evaluate("cagefield.now.measured.length") == 0
        editor.press("Shift+M")
        assert page.evaluate("cagefield.now.measured") is None
        page.click(".tools .measure")
        assert page.evaluate("cagefield.now.measured.length") == 0
        points = [(0.3, -0.4, 0.0), (-0.3, -0.4, 0.0)]
        for n, point in enumerate(points, start=1):
            at = page.evaluate(f"cagefield.project({list(point)})")
            page.mouse.click(at["x"], at["y"])
            editor.until(f"cagefield.now.measured.length === {n}")
        measured = np.array(page.evaluate("cagefield.now.measured"))
        # A foggy ball of voxels is seen a little beneath its surface.
        np.testing.assert_allclose(measured, points, atol=0.08)
        distance = float(np.linalg.norm(measured[0] - measured[1]))
        assert f"{distance:.4g} units" in page.inner_text("dialog[open] h2")
        page.fill("dialog[open] input[name=meters]", "1.5")
        editor.changed(lambda: page.click("dialog[open] button.primary"))
        assert editor.state["meters_per_unit"] == pytest.approx(1.5 / distance)
        label = page.evaluate("document.querySelector('.measurement text').textContent")
        assert label == "1.5 m"
        assert editor.state["edits"] == [] and editor.state["saved"] is False
        editor.changed(lambda: editor.press("Control+z"))
        assert editor.state["meters_per_unit"] is None
        editor.changed(lambda: editor.press("Control+Shift+Z"))
        editor.changed(lambda: editor.press("Control+s"))
        editor.press("Escape")
        assert page.evaluate("cagefield.now.measured") is None
        # Beside the ball there is nothing to measure from.
        editor.press("Shift+M")
        box = editor.box
        page.mouse.click(box["x"] + 20, box["y"] + 20)
        editor.said("nothing is there to measure from")
    scene = Scene.open(tmp_path / "ball")
    assert scene.alignment.meters_per_unit == pytest.approx(1.5 / distance)
