"""Hotspots in Chromium: placed and changed in the editor, shown by exported pages, hostile texts harmless."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield import Cage, Edit, EditStack, Hotspot, Scene
from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Keyframe, stills
from cagefield.pages.scene_page import ScenePage
from cagefield.scene.alignment import Alignment
from cagefield.scene.hotspot_tour import between, pose_of, tour_keys
from cagefield.scene.hotspots import resolved_view, view_of_camera
from editor_page import editor_page
from editor_server import editor_server
from exported_page import shown, until
from scenes import ball_field

pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")

HOSTILE = (
    "</script><script>window.taken = 1</script><img src=x onerror='window.taken = 2'>"
    "<!--<script>&lt;svg onload=window.taken=3&gt;${window.taken=4}`\u2028"
)
RECORDED_FLIGHT = """
eyes = [];
requestAnimationFrame(function record() {
    if (cagefieldViewer.viewer.flies) eyes.push([...cagefieldViewer.viewer.orbit.eye]);
    requestAnimationFrame(record);
});
"""
"""Script that keeps the eye of each frame of a flight."""

AT_THE_SECOND_STOP = """
(keys => cagefield.now.preview !== null
    && Math.hypot(...[3, 7, 11].map(k => cagefield.camera.c2w[k] - keys[6].c2w[k])) < 0.01
)(cagefield.now.state.keys)
"""
"""Script: whether a tour of hotspots, played as the camera path, is at the second one."""

RADIUS = 0.5
UP = (0.0, 0.0, 1.0)


def camera_at(eye: tuple[float, float, float], width: int = 320, height: int = 230) -> Camera:
    return Camera.look_at(eye, (0, 0, 0), UP, width=width, height=height, fov_x=0.8)


@pytest.mark.nightly
def test_the_editor_places_changes_and_undoes_hotspots(tmp_path: Path) -> None:
    """Two pages see the same list; a mark is hidden behind the ball; texts are text."""
    camera = camera_at((0.0, -3.0, 0.0))
    cameras = {"test": (camera, camera_at((0.0, 3.0, 0.0)))}
    Scene(ball_field(radius=RADIUS), cameras=cameras).save(tmp_path / "ball")
    with editor_server(tmp_path / "ball") as server, editor_page(server.link, 520, 380) as editor:
        page = editor.page
        editor.ready()
        editor.press("Shift+H")
        at = page.evaluate("cagefield.project([0.2, -0.45, 0])")
        page.mouse.click(at["x"], at["y"])
        page.fill("dialog[open] input[name=title]", HOSTILE[:100])
        page.fill("dialog[open] textarea", f"first\n{HOSTILE}")
        editor.changed(lambda: page.click("dialog[open] button.primary"))
        first = editor.state["hotspots"][0]
        # A foggy ball of voxels is seen a little beneath its surface.
        np.testing.assert_allclose(first["position"], (0.2, -0.45, 0.0), atol=0.08)
        np.testing.assert_allclose(np.reshape(first["camera"]["c2w"], (4, 4)), camera.c2w, atol=1e-6)
        assert (first["title"], first["text"]) == (HOSTILE[:100], f"first\n{HOSTILE}")
        assert page.locator(".hotspot-list .name").text_content() == HOSTILE[:100]
        assert page.evaluate("window.taken === undefined && document.images.length === 0")
        middle = (
            "(b => b.x + b.width / 2)(document.querySelector('.hotspots button').getBoundingClientRect())"
        )
        editor.until(f"Math.abs({middle} - {at['x']}) < 1")
        # Another page has it at once, and renames it there.
        other = editor.tab(server.link)
        other.ready()
        assert other.state["hotspots"] == [first]
        other.page.click(".hotspot-list .write")
        other.page.fill("dialog[open] input[name=title]", "Front")
        other.page.fill("dialog[open] textarea", "the side that is seen first")
        other.changed(lambda: other.page.click("dialog[open] button.primary"))
        other.page.close()
        editor.until("cagefield.now.state.hotspots[0].title === 'Front'")
        assert editor.state["hotspots"][0]["camera"] == first["camera"]
        editor.changed(lambda: editor.press("Control+z"))
        assert editor.state["hotspots"] == [first]
        editor.changed(lambda: editor.press("Control+Shift+Z"))
        # Seen from behind, the ball is before it.
        editor.press("]", "]")
        editor.settle()
        editor.until("document.querySelector('.hotspots button').hidden")
        page.click(".hotspot-list .go")
        editor.settle()
        editor.until("!document.querySelector('.hotspots button').hidden")
        # Beside the ball there is nothing to mark.
        box = editor.box
        page.mouse.click(box["x"] + 20, box["y"] + 20)
        editor.said("nothing is there to mark")
        editor.press("Escape")
        assert page.evaluate("cagefield.now.placesHotspot") is False
        editor.changed(lambda: editor.press("Control+s"))
        saved = Scene.open(tmp_path / "ball").hotspots
        assert [(h.title, h.text) for h in saved] == [("Front", "the side that is seen first")]
        editor.changed(lambda: page.click(".hotspot-list .drop"))
        assert editor.state["hotspots"] == [] and page.locator(".hotspots button").count() == 0


@pytest.mark.nightly
def test_the_editor_makes_the_tour_its_camera_path(tmp_path: Path) -> None:
    """One step of the history; played, the view rests at the second hotspot; none without hotspots."""
    scene, hotspots = page_of_ball()
    scene.save(tmp_path / "ball")
    with editor_server(tmp_path / "ball") as server, editor_page(server.link, 520, 380) as editor:
        page = editor.page
        editor.ready()
        page.click("button.tour")
        page.fill("dialog[open] input[name=stop]", "1.5")
        editor.changed(lambda: page.click("dialog[open] .primary"))
        expected = tour_keys(hotspots, scene.first_camera, scene.up, stop_seconds=1.5)
        keys = editor.state["keys"]
        assert [key["seconds"] for key in keys] == [key.seconds for key in expected]
        np.testing.assert_allclose([key["c2w"] for key in keys], [key.c2w for key in expected], atol=1e-6)
        page.click("button.play")
        editor.until(AT_THE_SECOND_STOP)
        page.click("button.play")
        editor.changed(lambda: editor.press("Control+z"))
        assert editor.state["keys"] == []
        for _ in hotspots:
            editor.changed(lambda: page.click(".hotspot-list .drop >> nth=0"))
        assert page.locator("button.tour").is_disabled()


def page_of_ball() -> tuple[Scene, tuple[Hotspot, ...]]:
    """A ball with hotspots in front, behind, and above with a camera of its own; one unit is 2 m."""
    above = view_of_camera(camera_at((0.0, -1.2, 1.6)))
    hotspots = (
        Hotspot("Front", (0.0, -RADIUS, 0.0), f"one\n{HOSTILE}"),
        Hotspot(HOSTILE[:100], (0.0, RADIUS, 0.0)),
        Hotspot("Top", (0.0, -0.7 * RADIUS, 0.714 * RADIUS), "from above", above),
    )
    scene = Scene(
        ball_field(radius=RADIUS),
        cameras={"test": (camera_at((0.0, -3.0, 0.3), 120, 120),)},
        hotspots=hotspots,
        alignment=Alignment(2.0),
    )
    return scene, hotspots


def hidden(page: Any) -> list[bool]:
    return page.evaluate("[...document.querySelectorAll('.hotspots button')].map(mark => mark.hidden)")


def test_an_exported_page_marks_them_and_tours(tmp_path: Path) -> None:
    scene, hotspots = page_of_ball()
    file = tmp_path / "scene.html"
    file.write_text(ScenePage.build(scene, HOSTILE).one_file(), encoding="utf-8")
    with shown(file, size=120) as page:
        assert page.evaluate("window.taken === undefined && document.images.length === 0")
        until(page, "document.querySelectorAll('.hotspots button')[1].hidden")
        assert hidden(page) == [False, True, False]
        # Marks stand where the camera projects their points.
        first = scene.first_camera
        for index in (0, 2):
            box = page.locator(".hotspots button").nth(index).bounding_box()
            ray = first.c2w[:3, :3].T @ (np.array(hotspots[index].position) - first.origin)
            at = 60.0 + first.fx * np.array([ray[0], -ray[1]]) / -ray[2]
            middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
            np.testing.assert_allclose(middle, at, atol=0.6)
        # A click opens the text and flies, on the way that a video goes.
        page.evaluate(RECORDED_FLIGHT)
        page.locator(".hotspots button").nth(2).click()
        assert page.inner_text(".card h2") == "Top" and page.inner_text(".card p") == "from above"
        from_, to = (
            pose_of(view_of_camera(first), (0, 0, 0)),
            pose_of(hotspots[2].view, hotspots[2].position),  # type: ignore[arg-type]
        )
        until(page, "!cagefieldViewer.viewer.flies && cagefieldViewer.viewer.whole")
        eyes = np.array(page.evaluate("eyes"))
        way = np.array([between(from_, to, t, UP).eye for t in np.linspace(0.0, 1.0, 2001)])
        distances = np.linalg.norm(way - eyes[:, None], axis=2).min(axis=1)
        assert distances.max() < 2e-3 and np.ptp(eyes[:, 2]) > 0.1
        np.testing.assert_allclose(page.evaluate("cagefieldViewer.viewer.orbit.eye"), to.eye, atol=1e-9)
        # Keys go on and back; the hostile texts are shown as they are.
        page.emulate_media(reduced_motion="reduce")
        page.press("body", "ArrowRight")
        assert (
            page.inner_text(".card h2") == "Front"
            and page.locator(".card p").text_content() == f"one\n{HOSTILE}"
        )
        until(page, "!cagefieldViewer.viewer.flies && cagefieldViewer.viewer.whole")
        view = np.reshape(resolved_view(hotspots[0], first, UP).c2w, (4, 4))
        np.testing.assert_allclose(page.evaluate("cagefieldViewer.viewer.orbit.eye"), view[:3, 3], atol=1e-9)
        page.press("body", "ArrowRight")
        assert page.locator(".card h2").text_content() == HOSTILE[:100]
        page.press("body", "ArrowLeft")
        assert page.inner_text(".card .count") == "1 / 3"
        # The bar is as long as its label says: 2 m a unit, at the distance of the orbit's center.
        until(page, "!cagefieldViewer.viewer.flies && cagefieldViewer.viewer.whole")
        label, width = page.evaluate(
            "(bar => [bar.textContent, bar.getBoundingClientRect().width])(document.querySelector('.scale'))"
        )
        eye, target = np.array(
            page.evaluate("[cagefieldViewer.viewer.orbit.eye, cagefieldViewer.viewer.orbit.target]")
        )
        value, unit = label.split()
        meters = float(value) * {"m": 1.0, "cm": 0.01}[unit]
        focal = 60.0 / math.tan(0.5 * math.radians(page.evaluate("cagefieldViewer.viewer.fov")))
        assert width == pytest.approx(meters / 2.0 * focal / np.linalg.norm(eye - target), abs=0.6)
        page.press("body", "Escape")
        assert not page.is_visible(".card")
        assert page.evaluate("window.taken === undefined && document.images.length === 0")


def moving_scene() -> tuple[Scene, tuple[Keyframe, ...]]:
    """A ball that an edit moves up, at once and from half of a path on; hotspots on it and beside it."""
    cage = Cage.box((0, 0, 0), 1.2)
    edit = Edit.move(cage).translate((0, 0, 0.4)).replace(fill="none", relight="none")
    camera = camera_at((0.0, -3.0, 0.0), 120, 120)
    on, beside = Hotspot("on", (0.0, -RADIUS, 0.0), follows=True), Hotspot("beside", (0.3, -0.4, 0.0))
    scene = Scene(ball_field(radius=RADIUS), EditStack([edit]), {"test": (camera,)}, hotspots=(on, beside))
    keys = tuple(
        Keyframe(tuple(camera.c2w.ravel().tolist()), 50.0, 1.0, {1: part}) for part in (0.0, 0.0, 1.0)
    )
    return scene, keys


def test_places_along_a_path_are_those_of_the_edits_parts() -> None:
    scene, keys = moving_scene()
    header = ScenePage.build(scene, "ball", keys).header
    on, beside = header["hotspots"]
    assert on["position"] == pytest.approx([0, -RADIUS, 0.4]) and "along" not in beside
    expected = stills(keys, loop=False, fps=12.0, width=9, height=9)
    assert len(on["along"]) == len(expected) == len(header["path"]["stills"])
    for place, still in zip(on["along"], expected, strict=True):
        assert place == pytest.approx([0, -RADIUS, 0.4 * still.parts[1]], abs=1e-9)
    whole = ScenePage.build(scene, "ball", tuple(dataclasses.replace(key, parts={}) for key in keys)).header
    assert all("along" not in entry for entry in whole["hotspots"])


def test_marks_go_with_the_parts_that_a_path_moves(tmp_path: Path) -> None:
    scene, keys = moving_scene()
    file = tmp_path / "scene.html"
    file.write_text(ScenePage.build(scene, "ball", keys).one_file(), encoding="utf-8")
    with shown(file, size=120) as page:
        until(page, "cagefieldViewer.viewer.canPlay")
        for seconds, height in ((0.0, 0.0), (2.0, 0.4)):
            page.evaluate(
                "seconds => cagefieldViewer.viewer.seek(cagefieldViewer.viewer.header.path, seconds)", seconds
            )
            at = 60.0 - 60.0 / math.tan(math.radians(25.0)) * height / (3.0 - RADIUS)
            middle = (
                "(b => b.y + b.height / 2)"
                "(document.querySelector('.hotspots button').getBoundingClientRect())"
            )
            until(page, f"Math.abs({middle} - {at}) < 0.6")
        # The view of the page's start shows the whole edits again.
        page.evaluate("cagefieldViewer.viewer.seek(cagefieldViewer.viewer.header.path, 0)")
        page.press("body", "h")
        assert page.evaluate(
            "cagefieldViewer.viewer.place(cagefieldViewer.viewer.header.hotspots[0])[2]"
        ) == (pytest.approx(0.4))


def test_a_page_without_hotspots_has_no_marks_and_no_scale(tmp_path: Path) -> None:
    scene, _ = page_of_ball()
    plain = dataclasses.replace(scene, hotspots=(), alignment=Alignment())
    header = ScenePage.build(plain, "ball").header
    assert "hotspots" not in header and "meters_per_unit" not in header
