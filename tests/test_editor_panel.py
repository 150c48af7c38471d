"""The editor's lists, numbers, views, texts and files in a real browser, against the real server.

Where the traffic cone is, how large and how it leans is read off the pixels.
"""

from __future__ import annotations

import io
import json
import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from cagefield.edits import load_edits, parse_edits
from editor_cone import EDITS, cone, difference, enlarged, moved
from editor_jobs import read_video, render
from editor_page import PATIENCE, EditorPage, asking, editor_page
from editor_server import EditorServer, editor_server

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

MOVED_AND_DELETED = (
    EDITS.replace("outer: {margin: 0.35}\n    lattice: 32", "adjustment: discrete")
    + """\
    operations:
      - translate: [0, 0, 0.4]
  - name: gone
    delete: true
    inner: {center: [0.65, 0.5, -0.215], size: [0.36, 0.34, 0.35]}
"""
)
"""The second edit empties the place that the cone has left; done first, it empties the cone."""


@pytest.fixture(scope="module")
def folder(trained_digger: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the scene, digger, and an edit file, cone.yaml."""
    folder = tmp_path_factory.mktemp("editor")
    shutil.copytree(trained_digger, folder / "digger")
    (folder / "cone.yaml").write_text(EDITS)
    return folder


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[EditorServer]:
    with editor_server(folder / "digger") as running:
        yield running


@pytest.fixture(scope="module")
def opened(server: EditorServer) -> Iterator[EditorPage]:
    with editor_page(server.link, 960, 480) as page:
        page.ready()
        yield page


@pytest.fixture
def editor(opened: EditorPage, folder: Path) -> EditorPage:
    """The page with one edit around the cone, selected, in Edit mode."""
    return opened.loaded(folder / "cone.yaml")


def test_views_show_depth_opacity_and_normals(editor: EditorPage) -> None:
    color = editor.pixels()
    column, row = np.round(cone(color).at).astype(int)
    pictures = {}
    for view in ("depth", "opacity", "normals"):
        editor.page.click(f'.top [data-view="{view}"]')
        editor.settle()
        assert editor.page.evaluate("cagefield.picture.view") == view
        pictures[view] = editor.pixels()

    depth = pictures["depth"]
    assert np.ptp(depth, axis=2).max() < 0.02 and depth[4, 4].max() < 0.02
    # Near is bright: the brightness falls from 1 to .15 over the distances at which the field's box can be.
    hello = editor.page.evaluate("cagefield.now.hello")
    low, high = np.array(hello["bounds"])
    radius = 0.5 * np.linalg.norm(high - low)
    eye = np.array(editor.page.evaluate("cagefield.camera.c2w")).reshape(4, 4)[:3, 3]
    near = np.linalg.norm(eye - 0.5 * (low + high)) - radius
    box = editor.box
    found = editor.page.evaluate(f"cagefield.depth({box['x'] + column}, {box['y'] + row})")
    assert depth[row, column, 0] == pytest.approx(1.0 - 0.85 * (found - near) / (2.0 * radius), abs=0.05)

    opacity = pictures["opacity"]
    assert opacity[row, column].min() > 0.9 and opacity[4, 4].max() < 0.02

    full = opacity[..., 0] > 0.995
    normals = 2.0 * pictures["normals"][full] - 1.0
    assert full.sum() > 5000
    assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).mean() < 0.1  # JPEG's, at the edges between voxels
    # Surfaces that are seen face the eye; the largest one, the ground, faces up.
    back = np.array(editor.page.evaluate("cagefield.camera.c2w")).reshape(4, 4)[:3, 2]
    assert (normals @ back > 0).mean() > 0.9 and normals[:, 2].mean() > 0.2

    editor.press("v")  # the last view's next is the first again
    editor.settle()
    assert difference(editor.pixels(), color) < 0.1


def test_what_a_delete_uncovers_is_filled_unless_it_is_switched_off(
    opened: EditorPage, server: EditorServer, folder: Path
) -> None:
    """The cone's foot, which the cage leaves, is gone with it; the switch and its key show it again."""
    (folder / "gone.yaml").write_text(
        "- {name: gone, delete: true, inner: {center: [0.65, 0.5, -0.2], size: [0.36, 0.34, 0.36]}}"
    )
    tab = opened.tab(asking(server.link, "server"))
    try:
        tab.ready()
        tab.loaded(folder / "gone.yaml")
        column, row = np.round(tab.part("face", 5)).astype(int) - [round(tab.box["x"]), round(tab.box["y"])]

        def redness() -> float:
            """How much more red than green the ground is where the cone stood."""
            red, green, _ = tab.pixels()[row - 4 : row + 5, column - 4 : column + 5].mean(axis=(0, 1))
            return float(red - green)

        fill, shadows = (
            tab.page.locator(".pane .tp-lblv", has_text=label)
            for label in ("Fill what is uncovered", "Shadows go along")
        )
        assert "goes on where it was" in fill.get_attribute("title")
        assert redness() < 0.1
        filled = tab.pixels()
        tab.changed(fill.locator(".tp-ckbv_w").click)
        assert tab.edit["fill"] == "none" and redness() > 0.25
        tab.changed(lambda: tab.press("Shift+U"))
        assert tab.edit["relight"] == "none" and redness() > 0.25
        tab.changed(lambda: shadows.locator("select").select_option(label="Cast shadows too"))
        assert tab.edit["relight"] == "shadow" and redness() > 0.25
        tab.changed(lambda: tab.press("Control+z"))
        # A copy uncovers nothing, and a continuous edit has neither.
        kind = tab.page.locator(".pane .tp-lblv", has_text="Delete").locator("select")
        for label, shown in (("Copy", (False, True)), ("Continuous", (False, True))):
            tab.changed(lambda label=label: kind.select_option(label=label))
            assert (fill.is_visible(), shadows.is_visible()) == shown
            tab.changed(lambda: tab.press("Control+z"))
        tab.changed(lambda: tab.press("Shift+U"))
        tab.changed(lambda: tab.press("u"))
        assert not fill.locator("input").is_disabled() and fill.locator("input").is_checked()
        assert difference(tab.pixels(), filled) < 0.1
    finally:
        tab.page.close()


def test_the_split_shows_before_on_its_left_and_after_on_its_right(editor: EditorPage) -> None:
    start = cone(editor.pixels()).at
    editor.drag(editor.grip("Z"), (0, -30))
    edited = cone(editor.pixels()).at
    assert edited[1] < start[1] - 20
    editor.press("p")
    editor.settle()
    # Half of the width: the cone is to the right of it.
    assert cone(editor.pixels()).at == pytest.approx(edited, abs=1.0)
    width = editor.box["width"]
    grip = editor.page.locator(".splitter .grip").bounding_box()
    at = (grip["x"] + grip["width"] / 2, grip["y"] + 8)
    assert at[0] == pytest.approx(editor.box["x"] + width / 2, abs=1.0)
    with editor.held(at, (editor.box["x"] + 0.8 * width - at[0], 0)):
        pass
    editor.settle()
    assert editor.page.evaluate("cagefield.picture.split") == pytest.approx(0.8, abs=0.01)
    assert cone(editor.pixels()).at == pytest.approx(start, abs=1.0)
    editor.press("p")
    editor.settle()
    assert cone(editor.pixels()).at == pytest.approx(edited, abs=1.0)


def test_edits_are_hidden_locked_renamed_and_duplicated(editor: EditorPage) -> None:
    start = cone(editor.pixels()).at
    page, first = editor.page, editor.edit["id"]
    editor.drag(editor.grip("Z"), (0, -30))
    edited = cone(editor.pixels()).at

    editor.changed(lambda: editor.press("h"))
    assert not editor.edit["enabled"] and cone(editor.pixels()).at == pytest.approx(start, abs=1.0)
    editor.changed(lambda: page.click(f'.edit[data-edit="{first}"] .eye'))
    assert editor.edit["enabled"] and cone(editor.pixels()).at == pytest.approx(edited, abs=1.0)

    grip = editor.grip("Z")
    editor.changed(lambda: page.click(f'.edit[data-edit="{first}"] .lock'))
    before = editor.edits
    with editor.held(grip, (0, 20)):  # turns the view: there is no gizmo any more
        assert page.evaluate("cagefield.drag") is None
    editor.press("Delete")
    assert "is locked" in editor.said("locked") and editor.edits == before and before[0]["locked"]
    editor.press("Home")
    editor.changed(lambda: page.click(f'.edit[data-edit="{first}"] .lock'))

    label = page.locator(f'.edit[data-edit="{first}"] .name').bounding_box()
    page.mouse.move(label["x"] + 9, label["y"] + 9)
    page.mouse.down(click_count=1)
    page.mouse.up(click_count=1)
    page.mouse.down(click_count=2)
    time.sleep(1.0)  # the state that the first click asks for comes before the second is over
    page.mouse.up(click_count=2)
    page.keyboard.type("traffic cone")
    editor.changed(lambda: editor.press("Enter"))
    assert editor.edit["name"] == "traffic cone" and page.inner_text(".edit .name") == "traffic cone"

    editor.changed(lambda: editor.press("Control+d"))
    one, two = editor.edits
    assert two["name"] == "traffic cone 2" and editor.edit["id"] == two["id"] != one["id"]
    assert two["deformed"] == one["deformed"] and two["color"] != one["color"]
    # What the copy moves has been moved already: what was below the cone comes up in its place.
    assert difference(editor.pixels(), editor.pixels(cages=True)) > 0.3
    assert len(page.query_selector_all(".edit")) == 2
    editor.changed(lambda: editor.press("Delete"))
    assert len(editor.edits) == 1 and cone(editor.pixels()).at == pytest.approx(edited, abs=1.0)


def test_the_order_of_edits_and_the_history_list(editor: EditorPage, folder: Path) -> None:
    plain = cone(editor.pixels())
    file = folder / "two.yaml"
    file.write_text(MOVED_AND_DELETED)
    editor.load(file)
    up = cone(editor.pixels())
    assert up.at[1] < plain.at[1] - 20 and up.area > 0.6 * plain.area
    assert editor.edit["name"] == "gone"
    loaded = editor.state["entry"]
    editor.changed(lambda: editor.page.click(".bar .up"))
    assert [edit["name"] for edit in editor.edits] == ["gone", "cone"]
    assert cone(editor.pixels()).area < 0.2 * plain.area
    assert editor.page.inner_text(".entry.now").startswith("Reorder")
    editor.changed(lambda: editor.page.click(f'.entry[data-entry="{loaded}"]'))
    assert [edit["name"] for edit in editor.edits] == ["cone", "gone"]
    assert cone(editor.pixels()).at == pytest.approx(up.at, abs=1.0)


def test_a_mirrored_copy(editor: EditorPage) -> None:
    editor.fill("Position", -0.115, "z")
    plain, (one,) = editor.pixels(cages=True), editor.edits
    editor.changed(lambda: editor.page.click(".mirror button:has-text('x')"))
    _, two = editor.edits
    low, high = editor.page.evaluate("cagefield.now.hello.bounds")
    flipped = np.array(one["deformed"])[[1, 0, 3, 2, 5, 4, 7, 6]]
    flipped[:, 0] = low[0] + high[0] - flipped[:, 0]
    assert np.allclose(two["deformed"], flipped, atol=1e-9) and editor.edit["id"] == two["id"]
    assert two["operations"] == one["operations"] and two["color"] != one["color"]
    # Its cage is drawn where it is, in its color.
    x, y = (round(c - editor.box[axis]) for c, axis in zip(editor.part("corner", 5), "xy", strict=True))
    color = np.array([int(two["color"][n : n + 2], 16) for n in (1, 3, 5)]) / 255.0
    around = editor.pixels(cages=True)[y - 6 : y + 7, x - 6 : x + 7]
    assert np.abs(around - color).max(axis=2).min() < 0.12
    assert np.abs(plain[y - 6 : y + 7, x - 6 : x + 7] - color).max(axis=2).min() > 0.12


def test_an_edits_numbers_are_copied_and_pasted_as_text(editor: EditorPage) -> None:
    start = cone(editor.pixels()).at
    editor.press("Control+c")
    editor.said("is copied as text")
    text = editor.page.evaluate("navigator.clipboard.readText()")
    (edit,) = parse_edits(text)
    assert edit.name == "cone" and np.allclose(edit.inner.corners, editor.edit["inner"])
    text = text.replace("name: cone", "name: pasted") + "\n  operations: [{translate: [0, 0, 0.15]}]\n"
    editor.page.evaluate("text => navigator.clipboard.writeText(text)", text)
    editor.changed(lambda: editor.press("Control+v"))
    assert [edit["name"] for edit in editor.edits] == ["cone", "pasted"]
    assert np.allclose(moved(editor.edit["inner"], editor.edit["deformed"]), [0, 0, 0.15])
    assert cone(editor.pixels()).at[1] < start[1] - 10

    entry, edits = editor.state["entry"], editor.edits
    for text, words in (
        ("edits: [", "the text, line 1: not valid YAML"),
        (EDITS.replace("0.65, 0.5", ".nan, 0.5"), "numbers must be finite, got nan"),
    ):
        editor.page.evaluate("text => navigator.clipboard.writeText(text)", text)
        editor.press("Control+v")
        assert "\n" not in editor.said(words)
    assert editor.state["entry"] == entry and editor.edits == edits


def test_files_that_are_no_edit_files_are_told_in_a_line(editor: EditorPage, folder: Path) -> None:
    edits = editor.edits
    for name, content, words in (
        ("nan.yaml", EDITS.replace("size: [0.34", "size: [.nan"), "numbers must be finite, got nan"),
        ("picture.yaml", "\x00\x01\x02", "not valid YAML"),
        ("other.json", '{"frames": []}', 'unknown key "frames"'),
        ("flat.yaml", EDITS.replace("0.36]", "0]"), "must be positive"),
    ):
        file = folder / name
        file.write_text(content)
        editor.page.set_input_files("input[type=file]", file)
        editor.said(words)
        assert editor.page.locator(".toast.error", has_text=words).count() >= 1
    assert editor.edits == edits


def test_numbers_move_turn_and_scale(editor: EditorPage) -> None:
    start, edit = cone(editor.pixels()), editor.edit
    editor.fill("Position", edit["pivot"][2] + 0.2, "z")
    assert np.allclose(moved(edit["deformed"], editor.edit["deformed"]), [0, 0, 0.2], atol=1e-3)
    assert cone(editor.pixels()).at[1] < start.at[1] - 15
    before = editor.edit
    editor.fill("Turn by", 90.0, "z")
    A = np.asarray(before["deformed"]) - before["pivot"]
    turned = np.stack([-A[:, 1], A[:, 0], A[:, 2]], axis=1)
    assert np.allclose(np.asarray(editor.edit["deformed"]) - editor.edit["pivot"], turned, atol=1e-9)
    turned_area = cone(editor.pixels()).area
    editor.fill("Scale by", 1.5, "z")
    assert np.ptp(editor.edit["deformed"], axis=0)[2] == pytest.approx(1.5 * 0.36)
    assert cone(editor.pixels()).area > 1.1 * turned_area
    entry = editor.state["entry"]
    field = editor.page.locator(".pane .tp-lblv", has_text="Position").locator("input").nth(2)
    field.fill("9")
    field.press("Enter")
    assert "must stay inside the outer cage" in editor.said("% of it is possible")
    assert editor.state["entry"] == entry
    editor.press("r")  # Enter has left the field: keys are shortcuts again
    assert editor.page.evaluate("cagefield.now.tool") == "rotate"


def test_set_mode_moves_cages_and_not_the_field(editor: EditorPage) -> None:
    plain = editor.pixels()
    start = editor.edit
    editor.tools(mode="set", cage="inner")
    editor.drag(editor.grip("Z"), (0, -20))
    editor.tools(tool="rotate")
    editor.drag(editor.grip("Z"), (15, 0))
    editor.tools(tool="select")
    after = editor.drag(editor.part("corner", 7, "inner"), (6, -6))
    by = moved(start["inner"], after["inner"])
    assert (np.linalg.norm(by, axis=1) > 0.02).all() and after["deformed"] == after["inner"]
    assert after["outer"] == start["outer"] and after["operations"] == []
    assert difference(editor.pixels(), plain) < 0.05


def test_the_inner_cage_is_fitted_and_the_outer_one_is_a_margin_of_it(
    editor: EditorPage, folder: Path
) -> None:
    file = folder / "large.yaml"
    file.write_text(
        EDITS.replace("size: [0.34, 0.32, 0.36]", "size: [0.5, 0.5, 0.36]").replace("-0.215", "-0.19")
    )
    editor.load(file)
    plain = editor.pixels()
    editor.changed(lambda: editor.press("i"))
    inner = np.array(editor.edit["inner"])
    # The cone is .3 high and .21 wide; the field is blurred by about a voxel, .04.
    assert np.allclose(inner.mean(axis=0)[:2], [0.65, 0.5], atol=0.08)
    assert (np.ptp(inner, axis=0)[:2] < 0.45).all() and (np.ptp(inner, axis=0) > 0.15).all()
    margin = editor.page.locator(".pane .tp-lblv", has_text="Margin").locator("input")
    margin.fill("0.2")
    margin.press("Enter")
    editor.changed(lambda: editor.page.click("text=Outer cage by margin"))
    outer = np.array(editor.edit["outer"])
    assert np.allclose(outer.min(axis=0), inner.min(axis=0) - 0.2, atol=1e-6)
    assert np.allclose(outer.max(axis=0), inner.max(axis=0) + 0.2, atol=1e-6)
    assert difference(editor.pixels(), plain) < 0.05


def test_snapping_axes_and_several_corners(editor: EditorPage) -> None:
    page, start = editor.page, editor.edit
    editor.tools(tool="rotate")
    page.keyboard.down("Control")
    turned = editor.drag(editor.grip("Z"), (25, 0))
    page.keyboard.up("Control")
    found = re.fullmatch(r"rotation by \(0, 0, (-?\d+)\) degrees", turned["operations"][0])
    assert found and int(found[1]) and int(found[1]) % 15 == 0
    angle = float(found[1])

    editor.tools(tool="translate", axes="cage")
    along = editor.drag(editor.grip("X"), (-20, 8))
    by = moved(turned["deformed"], along["deformed"])
    x = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    assert np.linalg.norm(by[0]) > 0.01
    assert np.allclose(by, by[0]) and np.linalg.norm(np.cross(by[0], x)) < 1e-6

    editor.tools(tool="select", axes="world")
    for corner in (5, 7):
        page.keyboard.down("Shift")
        page.mouse.click(*editor.part("corner", corner))
        page.keyboard.up("Shift")
    assert page.evaluate("cagefield.now.corners") == [5, 7]
    after = editor.drag(editor.part("corner", 7), (0, -12))
    by = moved(along["deformed"], after["deformed"])
    assert np.linalg.norm(by[7]) > 0.02 and np.allclose(by[5], by[7])
    assert np.allclose(by[[0, 1, 2, 3, 4, 6]], 0)
    assert start["inner"] == after["inner"]
    editor.press("Escape")


def test_the_lattice_is_shown_at_rest_and_in_a_drag(editor: EditorPage) -> None:
    def shown() -> NDArray[np.float64]:
        editor.page.mouse.move(2, 2)
        return (
            np.asarray(Image.open(io.BytesIO(editor.page.screenshot(clip=editor.box))).convert("RGB")) / 255.0
        )

    editor.tools(tool="select")
    plain = shown()
    editor.press("l")
    sees(lambda: np.abs(shown() - plain).max(axis=2) > 0.04, 500)
    straight = shown()
    editor.tools(tool="translate")
    with editor.held(editor.grip("Z"), (0, -30)):
        editor.until("cagefield.picture.drag > 0 && cagefield.picture.seq === cagefield.drag.seq")
        # Before white, where no field moves: the lines are elsewhere than they were.
        sees(lambda: (np.abs(grab(editor) - straight).max(axis=2) > 0.04) & (plain.min(axis=2) > 0.99), 200)
    editor.press("l")
    editor.settle()


def grab(editor: EditorPage) -> NDArray[np.float64]:
    """What is on the screen, with the mouse where it is."""
    return np.asarray(Image.open(io.BytesIO(editor.page.screenshot(clip=editor.box))).convert("RGB")) / 255.0


def sees(pixels: Any, count: int) -> None:
    """Waits until a mask of pixels has so many."""
    end = time.monotonic() + PATIENCE
    while pixels().sum() < count:
        assert time.monotonic() < end, f"{pixels().sum()} pixels, not {count}"


def test_two_pages_show_the_same_and_each_its_own_screenshot(
    editor: EditorPage, server: EditorServer
) -> None:
    start = cone(editor.pixels()).at
    other = editor.tab(server.link)
    other.ready()
    assert other.edits == editor.edits and other.state["selected"] == editor.state["selected"]
    other.press("n")  # another size of picture
    other.settle()
    before = cone(other.pixels())
    with editor.held(editor.grip("Z"), (0, -30)):
        other.until("cagefield.now.state.edits[0].operations.length === 1")  # while it is dragged
    editor.until("cagefield.drag === null")
    editor.settle()
    other.settle()
    assert other.state["edits"][0]["deformed"] == editor.edit["deformed"] != editor.edit["inner"]
    assert other.state["history"] == editor.state["history"]
    edited = editor.pixels()
    assert cone(edited).at[1] < start[1] - 20 and cone(other.pixels()).at[1] < before.at[1] - 20

    shots = [screenshot(page) for page in (editor, other)]
    assert [shot.shape[:2] for shot in shots] == [page.pixels().shape[:2] for page in (editor, other)]
    assert shots[0].shape != shots[1].shape
    assert np.abs(shots[0] - edited).mean() < 0.01  # JPEG's

    # With nothing saved, closing asks first; saved, it does not.
    asked: list[str] = []
    other.page.on("dialog", lambda dialog: (asked.append(dialog.type), dialog.dismiss()))
    other.page.mouse.click(300, 200)
    other.changed(lambda: other.press("Control+z"))
    editor.until(f"cagefield.now.state.entry === {other.state['entry']}")
    editor.settle()
    assert editor.edit["operations"] == [] and cone(editor.pixels()).at == pytest.approx(start, abs=1.0)
    assert not other.state["saved"]
    other.page.close(run_before_unload=True)
    end = time.monotonic() + PATIENCE
    while not asked and time.monotonic() < end:
        other.page.wait_for_timeout(50)
    assert asked == ["beforeunload"] and not other.page.is_closed()
    editor.changed(lambda: editor.press("Control+s"))
    other.until("cagefield.now.state.saved")
    with other.page.expect_event("close"):
        other.page.close(run_before_unload=True)
    assert asked == ["beforeunload"]


def screenshot(editor: EditorPage) -> NDArray[np.float64]:
    """The picture that the page's button downloads."""
    with editor.page.expect_download() as download:
        editor.page.click('.top a[download="screenshot.png"]')
    return np.asarray(Image.open(download.value.path()).convert("RGB"), dtype=np.float64) / 255.0


def test_a_camera_path_is_recorded_played_and_rendered(editor: EditorPage, folder: Path) -> None:
    page, edit = editor.page, editor.edit
    start = cone(editor.pixels()).at
    editor.drag(editor.grip("Z"), (0, -30))
    lifted = cone(editor.pixels()).at
    editor.changed(lambda: editor.press("k"))
    with editor.held((80, 400), (40, 0)):  # where nothing is: turns the view
        pass
    editor.settle()
    editor.changed(lambda: page.click(".add-key"))
    first, second = editor.state["keys"]
    assert first["c2w"] != second["c2w"] and np.allclose(second["c2w"], page.evaluate("cagefield.camera.c2w"))

    # The first keyframe half a second before the second, and without the edit.
    seconds = page.locator('.key input[type="number"]').first
    seconds.fill("0.5")
    # What others change meanwhile (a script's click leaves the focus where it is) takes nothing typed away.
    editor.changed(lambda: page.evaluate("document.querySelector('.edit.chosen .lock').click()"))
    editor.changed(lambda: page.evaluate("document.querySelector('.edit.chosen .lock').click()"))
    assert seconds.input_value() == "0.5"
    editor.changed(lambda: seconds.press("Enter"))
    editor.changed(lambda: page.locator('.key input[type="range"]').first.fill("0"))
    assert editor.state["keys"][0]["seconds"] == 0.5
    assert editor.state["keys"][0]["parts"] == {str(edit["id"]): 0}

    page.click(".key .go >> nth=0")
    editor.settle()
    assert cone(editor.pixels()).at == pytest.approx(lifted, abs=1.0)  # what is looked at is edited
    page.click("button.play")
    editor.until(f"Math.abs(cagefield.camera.c2w[3] - {second['c2w'][3]}) < 1e-6")
    editor.settle()
    editor.press("Home")

    with page.expect_download() as download:
        page.click('a[download="camera_path.json"]')
    path = json.loads(Path(download.value.path()).read_text())
    assert path["camera_type"] == "perspective" and len(path["keyframes"]) == 2 and path["camera_path"]

    video = folder / "path.mp4"
    width, height = (round(editor.box[side] / 4) * 2 for side in ("width", "height"))
    render(editor, video, width, height, 8)
    editor.until("cagefield.now.jobs.some(job => job.state === 'done')")
    frames = read_video(video)
    assert len(frames) == 5 and frames[0].shape == (height, width, 3)
    # The first picture is without the edit; the last with it, from elsewhere.
    assert 2.0 * cone(frames[0]).at == pytest.approx(start, abs=2.5)
    page.click(".key .go >> nth=1")
    editor.settle()
    assert 2.0 * cone(frames[-1]).at == pytest.approx(cone(editor.pixels()).at, abs=2.5)
    editor.press("Home")

    seconds.fill("900")
    editor.changed(lambda: seconds.press("Enter"))
    other = folder / "long.mp4"
    render(editor, other, width, height, 8)
    editor.until("cagefield.now.jobs.some(job => job.state === 'running' && job.done > 1)")
    bar = page.locator(".job.running progress")
    assert 0 < float(bar.get_attribute("value")) < float(bar.get_attribute("max"))
    page.click(".job.running .cancel")
    editor.until("cagefield.now.jobs.some(job => job.state === 'cancelled')")
    end = time.monotonic() + PATIENCE
    while any(file.name.startswith(("long", ".long")) for file in folder.iterdir()):
        assert time.monotonic() < end
        time.sleep(0.05)


def test_playing_a_path_shows_the_edits_on_their_way_and_then_as_they_are(editor: EditorPage) -> None:
    page = editor.page
    plain = editor.pixels()
    start = cone(plain).at
    editor.drag(editor.grip("Z"), (0, -40))
    lifted = cone(editor.pixels()).at
    assert start[1] - lifted[1] > 20
    while editor.state["keys"]:
        editor.changed(lambda: page.click(".key .drop >> nth=0"))
    for _ in range(2):
        editor.changed(lambda: editor.press("k"))
    # Nothing of the edit for as long as the test may take.
    seconds = page.locator('.key input[type="number"]').first
    seconds.fill("3600")
    editor.changed(lambda: seconds.press("Enter"))
    editor.changed(lambda: page.locator('.key input[type="range"]').first.fill("0"))
    before = editor.state

    def playing() -> None:
        page.click("button.play")
        editor.until(
            "cagefield.now.preview !== null && cagefield.picture.revision > cagefield.now.state.revision"
        )
        time.sleep(1.0)  # pictures of the path have no end

    playing()
    assert not page.evaluate("cagefield.settled")
    # Quick pictures, of half the resolution or less: the cone is where it is in one of so many pixels.
    size = None
    while size != (now := page.evaluate("[cagefield.picture.full_width, cagefield.picture.full_height]")):
        size = now
        shown = editor.pixels(cages=True)
    expected = cone(enlarged(plain, *size)).at
    assert lifted[1] + 20 < expected[1] and cone(shown).at == pytest.approx(expected, abs=3.0)
    page.click("button.play")
    editor.until("cagefield.now.preview === null")
    editor.settle()
    assert cone(editor.pixels()).at == pytest.approx(lifted, abs=1.0)
    assert editor.state["history"] == before["history"]
    assert editor.edit["operations"]

    playing()
    page.mouse.move(80, 400)
    page.mouse.wheel(0, 1)  # the user takes the view
    editor.until("cagefield.now.preview === null")
    editor.settle()
    playing()
    editor.changed(lambda: editor.press("Control+z"))
    editor.until("cagefield.now.preview === null")
    editor.settle()
    assert editor.state["keys"][0]["parts"] == {}


def test_save_as_goes_on_with_the_new_folder(editor: EditorPage, folder: Path) -> None:
    page = editor.page
    editor.drag(editor.grip("Z"), (0, -20))
    shutil.copytree(folder / "digger", folder / "second")
    for overwrite in (False, True):
        editor.press("Control+Shift+S")
        page.locator('dialog[open] input[type="text"]').fill(str(folder / "second"))
        page.locator('dialog[open] input[type="checkbox"]').set_checked(overwrite)
        if overwrite:
            editor.changed(lambda: page.click("dialog[open] .primary"))
        else:
            page.click("dialog[open] .primary")
            editor.said("choose to overwrite")
            assert not editor.state["saved"] and editor.state["path"] == str(folder / "digger")
    assert editor.state["saved"] and editor.state["path"] == str(folder / "second")
    (stored,) = load_edits(folder / "second" / "edits.yaml")
    assert np.allclose(stored.deformed.corners, editor.edit["deformed"], atol=1e-6)
    assert (folder / "second" / "field.safetensors").exists()
