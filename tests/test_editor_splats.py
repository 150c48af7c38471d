"""The editor in a real browser on a scene of splats: what a user does, seen in pixels and in the state.

A red ball over a gray floor, one server and one page for all tests; each begins without edits.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.edits import load_edits
from cagefield.fields.splat_field import SplatField
from cagefield.scene.scene import Scene
from editor_cone import cone, difference, moved
from editor_jobs import read_video, render
from editor_page import EditorPage, editor_page
from editor_server import EditorServer, editor_server
from splat_scenes import BALL_RADIUS as RADIUS
from splat_scenes import ball_and_floor

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("splats") / "ball"
    camera = Camera.look_at((0.0, -3.0, 0.9), (0, 0, 0), width=320, height=230, fov_x=0.8)
    Scene(ball_and_floor(), cameras={"test": (camera,)}).save(folder)
    return folder


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[EditorServer]:
    with editor_server(scene) as running:
        yield running


@pytest.fixture(scope="module")
def opened(server: EditorServer) -> Iterator[EditorPage]:
    with editor_page(server.link) as page:
        page.ready()
        page.press("n")  # the panel's room for the picture
        page.settle()
        yield page


@pytest.fixture
def editor(opened: EditorPage, scene: Path) -> EditorPage:
    """The page with one continuous edit around the ball, selected, in Edit mode."""
    file = scene.parent / "ball.yaml"
    file.write_text(
        "version: 1\nedits:\n  - name: ball\n    inner: {center: [0, 0, 0], size: [0.6, 0.6, 0.6]}\n"
        "    outer: {margin: 0.35}\n"
    )
    opened.press("Home")
    return opened.loaded(file)


def double_clicked(editor: EditorPage) -> NDArray[np.float64]:
    """Where the ball is, after a double click on it."""
    at = cone(editor.pixels()).at
    editor.page.mouse.dblclick(editor.box["x"] + at[0], editor.box["y"] + at[1])
    return at


def test_double_click_places_cages_around_the_surface(editor: EditorPage) -> None:
    editor.changed(lambda: editor.press("Escape"))
    double_clicked(editor)
    editor.until("cagefield.now.state.edits.length === 2 && cagefield.now.mode === 'set'")
    editor.settle()
    placed = editor.edit
    center = np.mean(placed["inner"], axis=0)
    # The point of the ball that looks at the camera, which is at (0, -3, .9).
    np.testing.assert_allclose(center, [0.0, -RADIUS * 0.958, RADIUS * 0.287], atol=0.04)
    assert np.ptp(placed["outer"], axis=0).min() > np.ptp(placed["inner"], axis=0).max()


def test_the_ball_is_dragged_and_the_floor_stays(editor: EditorPage) -> None:
    before, start = editor.pixels(), editor.edit
    after = editor.drag(editor.grip("X"), (35, 0))
    by = moved(start["deformed"], after["deformed"])
    assert np.allclose(by, [by[0, 0], 0, 0], atol=1e-9) and by[0, 0] > 0.05
    pixels = editor.pixels()
    shift = cone(pixels).at - cone(before).at
    assert shift[0] == pytest.approx(35, abs=6) and abs(shift[1]) < 4
    assert cone(pixels).area == pytest.approx(cone(before).area, rel=0.15)
    rows = slice(int(0.8 * pixels.shape[0]), None)
    assert difference(pixels[rows], before[rows]) < 0.1
    assert editor.edit["lattice_error"] in (None, [0.0, 0.0])


def test_moved_copied_deleted_and_undone(editor: EditorPage) -> None:
    start = cone(editor.pixels())
    editor.changed(lambda: editor.press("d"))
    assert editor.edit["kind"] == "move"
    editor.drag(editor.grip("X"), (110, 0))
    # A discrete edit takes the ball out of the outer cage, whole, and leaves nothing behind.
    far = cone(editor.pixels())
    assert far.at[0] > start.at[0] + 80 and far.area == pytest.approx(start.area, rel=0.2)
    editor.press("n")
    kind = editor.page.locator(".pane select").first
    editor.changed(lambda: kind.select_option("Copy"))
    editor.press("n")
    editor.settle()
    both = cone(editor.pixels())
    assert both.area == pytest.approx(start.area + far.area, rel=0.1)
    assert both.at[0] == pytest.approx(0.5 * (start.at[0] + far.at[0]), abs=6)
    editor.press("n")
    editor.changed(lambda: kind.select_option("Delete"))
    editor.press("n")
    editor.settle()
    assert cone(editor.pixels()).area < 0.02 * start.area
    for _ in range(4):
        editor.changed(lambda: editor.press("Control+z"))
    assert cone(editor.pixels()).at == pytest.approx(start.at, abs=1.0)


def test_the_inner_cage_is_fitted_to_the_ball(editor: EditorPage) -> None:
    editor.changed(lambda: editor.press("i"))
    inner = np.array(editor.edit["inner"])
    # The ball, what its splats are wide and half a probe (of 40 in .6).
    np.testing.assert_allclose(inner.min(axis=0), -RADIUS, atol=0.05)
    np.testing.assert_allclose(inner.max(axis=0), RADIUS, atol=0.05)


def test_another_camera_sees_the_ball_over_the_same_place(editor: EditorPage) -> None:
    before, start = editor.page.evaluate("cagefield.camera.c2w"), cone(editor.pixels())
    with editor.held((60, 400), (60, 0)):
        pass
    editor.settle()
    assert not np.allclose(editor.page.evaluate("cagefield.camera.c2w"), before)
    # It turns around the ball, or around the floor behind it.
    turned = cone(editor.pixels())
    assert turned.area == pytest.approx(start.area, rel=0.25)
    editor.press("Home")
    editor.settle()
    assert cone(editor.pixels()).at == pytest.approx(start.at, abs=1.0)


def test_edits_are_saved_found_again_and_rendered_to_a_video(editor: EditorPage, scene: Path) -> None:
    editor.drag(editor.grip("X"), (35, 0))
    before, edits = editor.pixels(), editor.edits
    editor.changed(lambda: editor.press("Control+s"))
    (stored,) = load_edits(scene / "edits.yaml")
    assert stored.name == "ball" and np.allclose(stored.deformed.corners, edits[0]["deformed"], atol=1e-6)
    assert isinstance(Scene.open(scene).field, SplatField)
    editor.page.reload()
    editor.ready()
    assert editor.edits == edits
    assert np.abs(editor.pixels() - before).max() < 0.15

    editor.press("n")
    editor.changed(lambda: editor.press("k"))
    editor.changed(lambda: editor.page.click(".add-key"))
    video = scene.parent / "path.mp4"
    width, height = (round(editor.box[side] / 4) * 2 for side in ("width", "height"))
    render(editor, video, width, height, 8)
    editor.until("cagefield.now.jobs.some(job => job.state === 'done')")
    frame = read_video(video)[0]
    editor.settle()
    assert 2.0 * cone(frame).at == pytest.approx(cone(editor.pixels()).at, abs=4.0)
    editor.press("n")


def test_the_ball_follows_while_it_is_dragged(editor: EditorPage) -> None:
    start = cone(editor.pixels())
    with editor.held(editor.grip("X"), (35, 0)):
        editor.until(
            "cagefield.picture.drag === cagefield.drag?.id && cagefield.picture.seq === cagefield.drag.seq"
            " && cagefield.picture.final"
        )
        image = Image.open(io.BytesIO(editor.page.screenshot(clip=editor.box)))
        held = cone(np.asarray(image.convert("RGB"), dtype=np.float64) / 255.0)
        assert held.at[0] - start.at[0] == pytest.approx(35, abs=8)
    editor.settle()


def test_a_snapped_drag_moves_by_round_lengths(editor: EditorPage) -> None:
    start = editor.edit
    mouse, keyboard, at = editor.page.mouse, editor.page.keyboard, editor.grip("X")

    def drag() -> None:
        mouse.move(*at)
        mouse.down()
        keyboard.down("Control")
        for step in range(1, 6):
            mouse.move(at[0] + 7 * step, at[1])
        mouse.up()
        keyboard.up("Control")

    editor.changed(drag)
    by = moved(start["deformed"], editor.edit["deformed"])[0, 0]
    digits = f"{by:.9f}".rstrip("0").rstrip(".")
    # A round length has one digit that is 1, 2 or 5, or few of them: no more than two places.
    assert by > 0.05 and len(digits.split(".")[-1]) <= 2, digits


def test_before_and_after_stand_side_by_side(editor: EditorPage) -> None:
    clean = editor.pixels()
    editor.drag(editor.grip("X"), (40, 0))
    after = editor.pixels()
    editor.page.keyboard.down("b")
    editor.until("cagefield.now.before && cagefield.picture.before && cagefield.settled")
    image = Image.open(io.BytesIO(editor.page.screenshot(clip=editor.box)))
    held = cone(np.asarray(image.convert("RGB"), dtype=np.float64) / 255.0)
    editor.page.keyboard.up("b")
    editor.until("!cagefield.now.before && !cagefield.picture.before && cagefield.settled")
    assert held.at == pytest.approx(cone(clean).at, abs=3.0)
    editor.press("p")
    editor.until("cagefield.picture.split !== null && cagefield.settled")
    split = editor.pixels()
    editor.press("p")
    editor.until("cagefield.picture.split === null && cagefield.settled")
    middle = clean.shape[1] // 2
    left, right = slice(0, middle - 30), slice(middle + 30, None)
    # Of each side a few pixels differ: the splitter's labels.
    for side, shown, other in ((left, clean, after), (right, after, clean)):
        assert share_of_other_pixels(split[:, side], shown[:, side]) < 0.01
        assert share_of_other_pixels(split[:, side], other[:, side]) > 0.01


def share_of_other_pixels(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """The share of pixels that differ by more than a tenth."""
    return float((np.abs(a - b).max(axis=-1) > 0.1).mean())
