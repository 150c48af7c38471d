"""Scenes as one HTML file: what is in it, and what Chromium shows of it without server or network."""

from __future__ import annotations

import dataclasses
import io
import itertools
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from cagefield.cages import Cage
from cagefield.cameras import Camera, turntable
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError
from cagefield.exporting.page import INDEX, NAMES, SCRIPT, ScenePage, write_folder
from cagefield.keyframe_files import dump_path
from cagefield.keyframes import Keyframe
from cagefield.rendering.metrics import psnr
from cagefield.scene import Scene
from commands import printed, refused
from editor_page import CHROMIUM, FLAGS
from page_fields import lumps
from splat_scenes import splat_scene

SIZE = 120
MOVE = Edit(Cage.box((0.6, 0.5, 0.3), (1.0, 0.9, 0.9)), adjustment="discrete").translate((0.0, -0.5, 0.8))


def lumps_scene() -> Scene:
    """Lumps with one moved, grey behind them."""
    cameras = turntable((0, 0, 0), 3.2, 3, elevation=0.4, width=SIZE, height=SIZE, fov_x=0.8)
    return Scene(
        lumps(1, False),
        EditStack([MOVE]),
        {"train": cameras[1:], "test": cameras[1:2]},
        background=(0.5, 0.5, 0.5),
    )


@contextmanager
def shown(file: Path) -> Iterator[Any]:
    """The page of a file, its first whole picture drawn; it asks nobody for anything."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("no chromium on this machine")
    complaints: list[str] = []
    asked: list[str] = []
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": SIZE, "height": SIZE})
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(file.as_uri())
        page.add_style_tag(content=".bar, .message { visibility: hidden; }")
        settle(page)
        yield page
        browser.close()
    assert complaints == []
    assert [url for url in asked if not url.startswith("file:")] == []


def until(page: Any, condition: str, seconds: float = 120.0) -> None:
    """Waits until an expression is true; the page's policy forbids waiting inside it."""
    end = time.monotonic() + seconds
    while not page.evaluate(condition):
        assert time.monotonic() < end, f"never came true: {condition}"
        time.sleep(0.02)


def settle(page: Any) -> None:
    """Waits for the whole picture of the full level."""
    until(
        page, "Boolean(window.cagefieldViewer?.viewer?.renderer.level?.last && cagefieldViewer.viewer.whole)"
    )
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def pixels(page: Any) -> NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))


def rendered(scene: Scene, camera: Camera, edits: bool = True) -> NDArray[np.uint8]:
    if not edits:
        scene = dataclasses.replace(scene, edits=EditStack([]))
    frame = scene.render(camera, background=scene.background)
    assert frame is not None
    return frame.rgb8()


def test_the_page_shows_the_edited_scene_and_the_one_before(tmp_path: Path) -> None:
    scene = lumps_scene()
    camera = scene.cameras["test"][0]
    after, before = rendered(scene, camera), rendered(scene, camera, edits=False)
    assert psnr(after, before) < 30.0
    file = tmp_path / "scene.html"
    file.write_text(ScenePage.of(scene, "lumps <&> @FIELD@").one_file(), encoding="utf-8")
    with shown(file) as page:
        assert page.title() == "lumps <&> @FIELD@"
        assert psnr(pixels(page), after) >= 40.0
        page.press("body", "b")
        settle(page)
        assert psnr(pixels(page), before) >= 40.0
        page.press("body", "b")
        settle(page)
        assert psnr(pixels(page), after) >= 40.0


def test_mouse_wheel_and_two_fingers_move_the_camera(tmp_path: Path) -> None:
    scene = lumps_scene()
    file = tmp_path / "scene.html"
    file.write_text(ScenePage.of(scene, "lumps").one_file(), encoding="utf-8")
    with shown(file) as page:
        seen = [pixels(page)]

        def eye() -> NDArray[np.float64]:
            return np.array(page.evaluate("cagefieldViewer.viewer.orbit.eye"))

        first = eye()
        page.mouse.move(60, 60)
        page.mouse.down()
        page.mouse.move(90, 60, steps=3)
        page.mouse.up()
        settle(page)
        turned = eye()
        # A quarter of the height is an eighth of a full turn, about the orbit's centre, at the same height.
        target = np.array(page.evaluate("cagefieldViewer.viewer.orbit.target"))
        a, b = (v[:2] / np.linalg.norm(v[:2]) for v in (first - target, turned - target))
        assert np.dot(a, b) == pytest.approx(np.cos(np.pi / 4), abs=1e-6)
        assert turned[2] == pytest.approx(first[2])
        seen.append(pixels(page))
        page.mouse.wheel(0, 300)
        settle(page)
        assert np.linalg.norm(eye() - target) > 1.2 * np.linalg.norm(turned - target)
        seen.append(pixels(page))
        page.evaluate(_PINCH)
        settle(page)
        near = np.linalg.norm(eye() - np.array(page.evaluate("cagefieldViewer.viewer.orbit.target")))
        assert near == pytest.approx(np.linalg.norm(first - target) * np.exp(0.36) / 2.0, rel=1e-3)
        seen.append(pixels(page))
        page.press("body", "h")
        settle(page)
        assert psnr(pixels(page), seen[0]) > 50.0
    for one, other in itertools.pairwise(seen):
        assert psnr(one, other) < 30.0


_PINCH = """() => {
    const canvas = document.querySelector("canvas");
    canvas.setPointerCapture = () => undefined;
    const send = (type, pointerId, clientX) => canvas.dispatchEvent(
        new PointerEvent(type, { pointerId, clientX, clientY: 60, pointerType: "touch", bubbles: true }));
    send("pointerdown", 11, 50);
    send("pointerdown", 12, 70);
    send("pointermove", 11, 40);
    send("pointermove", 12, 80);
    send("pointerup", 11, 40);
    send("pointerup", 12, 80);
}"""


def test_the_camera_path_is_played(tmp_path: Path) -> None:
    scene = lumps_scene()
    ring = turntable((0, 0, 0), 3.2, 6, elevation=0.4, width=SIZE, height=SIZE, fov_x=0.8)
    keys = tuple(Keyframe(tuple(camera.c2w.ravel()), 45.0, 1.0) for camera in ring[2:4])
    file = tmp_path / "scene.html"
    file.write_text(ScenePage.of(scene, "lumps", keys).one_file(), encoding="utf-8")
    with shown(file) as page:
        page.press("body", " ")
        until(page, "!cagefieldViewer.viewer.plays")
        settle(page)
        end = np.array(page.evaluate("cagefieldViewer.viewer.orbit.eye"))
        np.testing.assert_allclose(end, ring[3].origin, atol=1e-6)


def test_the_command_writes_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = lumps_scene()
    folder = tmp_path / "lumps"
    scene.save(folder)
    keys = [Keyframe(tuple(camera.c2w.ravel()), 45.0) for camera in scene.cameras["train"]]
    (folder / "camera_path.json").write_text(dump_path(keys, loop=True))
    out = tmp_path / "lumps.html"
    assert "1 edit, a camera path of 2 keys" in printed(capsys, "export", folder, "-o", out)
    text = out.read_text(encoding="utf-8")
    assert text.startswith("<!doctype html>") and '"loop": true' in text
    assert "src=" not in text.split("<script>")[0] and "href=\"data:,\"" in text.split("<script>")[0]
    for words, said in (
        (("-o", out), "exists already"),
        (("-o", tmp_path / "x.html", "--as", "mesh"), "are not written as a page"),
        (("-o", tmp_path / "x.ply", "--as", "page"), "a page is written as .html"),
        (("-o", tmp_path / "x.html", "--selection", "x"), "leave out --selection"),
        (("-o", tmp_path / "x.html", "--embed"), "--embed writes a folder"),
        (("-o", folder, "--embed", "--overwrite"), "holds no viewer.js and is left as it is"),
    ):
        assert said in refused(capsys, "export", folder, *words)


def test_splats_are_refused() -> None:
    with pytest.raises(CagefieldError, match="the scene holds splats; a page shows voxels"):
        ScenePage.of(splat_scene(), "splats")
