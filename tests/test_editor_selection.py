"""Selected elements in a real browser: what a user paints, sees highlighted, undoes and makes a cage of.

A red ball of 800 splats over a gray floor of 576, one server and one page for all tests; each begins without
edits and without a selection.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.scene.scene import Scene
from editor_cone import cone
from editor_page import EditorPage, editor_page
from editor_server import EditorServer, editor_server
from page_shots import shot
from splat_scenes import BALL_RADIUS, ball_and_floor

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

BALL, FLOOR = 800, 576


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EditorServer]:
    folder = tmp_path_factory.mktemp("selections") / "ball"
    camera = Camera.look_at((0.0, -3.0, 0.9), (0, 0, 0), width=320, height=230, fov_x=0.8)
    Scene(ball_and_floor(), cameras={"test": (camera,)}).save(folder)
    with editor_server(folder) as running:
        yield running


@pytest.fixture(scope="module")
def opened(server: EditorServer) -> Iterator[EditorPage]:
    with editor_page(server.link, 760, 520) as page:
        page.ready()
        yield page


@pytest.fixture
def editor(opened: EditorPage) -> EditorPage:
    """The page at the beginning of its history, with no tool that selects."""
    opened.page.bring_to_front()
    opened.press("Home")
    opened.press("Escape", "Escape")
    if opened.state["entry"] > 0:
        opened.changed(lambda: opened.page.locator(".history .entry").first.click())
    opened.settle()
    return opened


def ball_at(editor: EditorPage) -> tuple[NDArray[np.float64], float]:
    """(middle of the ball in the window, its radius in pixels)."""

    def place(point: tuple[float, ...]) -> NDArray[np.float64]:
        at = editor.page.evaluate(f"cagefield.project({list(point)})")
        return np.array([at["x"], at["y"]])

    middle = place((0.0, 0.0, 0.0))
    return middle, float(np.linalg.norm(place((BALL_RADIUS, 0.0, 0.0)) - middle))


def selected(editor: EditorPage, action: Any) -> int:
    """Number of selected elements after an action that changes the selection, its highlight drawn."""
    before = editor.state["entry"]
    action()
    editor.until(f"cagefield.now.state.entry !== {before}", 30)
    count = editor.state["selection"]
    if count is not None:
        editor.until("cagefield.highlighted > 0", 30)
    return 0 if count is None else int(count["count"])


def stroke(editor: EditorPage, points: list[Any]) -> None:
    mouse = editor.page.mouse
    mouse.move(*points[0])
    mouse.down()
    for x, y in points[1:]:
        mouse.move(x, y, steps=3)
    mouse.up()


def around(middle: NDArray[np.float64], radius: float) -> list[Any]:
    """A closed polygon of 16 corners."""
    angles = np.linspace(0.0, 2.0 * np.pi, 16)
    return [tuple(middle + radius * np.array([np.cos(a), np.sin(a)])) for a in angles]


def orange(picture: NDArray[np.float64]) -> int:
    """Number of pixels with the highlight's tint: more green than the red ball, less blue than the floor."""
    red, green, blue = np.moveaxis(picture, -1, 0)
    return int(((red > 0.7) & (green > 0.28) & (blue < 0.2)).sum())


def test_a_stroke_of_the_brush_selects_the_visible_surface(editor: EditorPage) -> None:
    middle, radius = ball_at(editor)
    plain = orange(shot(editor))
    editor.press("m")
    count = selected(
        editor, lambda: stroke(editor, [middle + by for by in radius * np.array([[-0.4, 0], [0.4, 0]])])
    )
    # A stroke of .8 by .3 radii or so, on the side of the ball that faces the camera.
    assert 15 < count < 200
    assert orange(shot(editor)) > plain + 300
    more = selected(editor, lambda: stroke(editor, [middle + radius * np.array([0, 0.5])]))
    assert more > count, "the brush adds"
    assert editor.state["saved"], "a selection is no unsaved change"
    editor.press("Control+z", "Control+z")
    editor.until("cagefield.now.state.selection === null && cagefield.highlighted === 0", 30)
    assert abs(orange(shot(editor)) - plain) < 50
    assert selected(editor, lambda: editor.press("Control+Shift+z")) == count


def test_lasso_through_and_keys(editor: EditorPage) -> None:
    middle, radius = ball_at(editor)
    editor.press("j")
    through = editor.page.locator(".selection .tp-lblv", has_text="Through all").locator("label")
    visible = selected(editor, lambda: stroke(editor, around(middle, 1.15 * radius)))
    through.click()
    count = selected(editor, lambda: stroke(editor, around(middle, 1.15 * radius)))
    through.click()
    assert visible < 700 and count >= BALL
    floor = selected(editor, lambda: editor.press("Control+i"))
    assert floor == BALL + FLOOR - count
    assert selected(editor, lambda: editor.press("a")) == BALL + FLOOR
    assert selected(editor, lambda: editor.press("Alt+a")) == 0
    editor.press("Escape")
    assert editor.page.evaluate("cagefield.now.selecting") is None


def test_rectangle_by_shift_grows_and_shrinks(editor: EditorPage) -> None:
    middle, radius = ball_at(editor)

    def rectangle() -> None:
        editor.page.keyboard.down("Shift")
        stroke(editor, [middle - 0.3 * radius, middle + 0.3 * radius])
        editor.page.keyboard.up("Shift")

    count = selected(editor, rectangle)
    assert count > 10
    grown = selected(editor, lambda: editor.press("Control++"))
    assert grown > count
    assert selected(editor, lambda: editor.press("Control+-")) < grown


def test_modifier_keys_subtract(editor: EditorPage) -> None:
    middle, radius = ball_at(editor)
    editor.press("j")
    whole = selected(editor, lambda: stroke(editor, around(middle, 0.9 * radius)))

    def subtract() -> None:
        editor.page.keyboard.down("Control")
        stroke(editor, around(middle, 0.4 * radius))
        editor.page.keyboard.up("Control")

    assert 0 < selected(editor, subtract) < whole
    assert editor.page.evaluate("document.querySelectorAll('.toast').length") == 0


def test_a_flood_becomes_a_cage_in_one_key(editor: EditorPage) -> None:
    middle, _ = ball_at(editor)
    editor.page.click(".tools .select-flood")
    assert selected(editor, lambda: editor.page.mouse.click(*middle)) == BALL
    editor.changed(lambda: editor.press("e"))
    inner = np.array(editor.edit["inner"])
    np.testing.assert_allclose(inner.mean(axis=0), 0.0, atol=0.03)
    assert (np.ptp(inner, axis=0) > 2.0 * BALL_RADIUS).all() and (np.ptp(inner, axis=0) < 0.9).all()
    assert editor.page.evaluate("cagefield.now.mode") == "set"
    assert editor.state["history"][-1] == "Cage around the selection"
    # Moved by its cage: the highlight goes along with the ball.
    before = cone(editor.pixels())
    editor.press("Escape")
    editor.tools(mode="edit", tool="translate", axes="world")
    editor.drag(editor.grip("X"), (60, 0))
    editor.until("cagefield.highlighted > 0", 30)
    assert cone(editor.pixels()).at[0] > before.at[0] + 30
    at = np.argwhere(_tinted(shot(editor))).mean(axis=0)[::-1]
    assert at[0] > before.at[0] + 30
    editor.changed(lambda: editor.press("Control+z"))


def _tinted(picture: NDArray[np.float64]) -> NDArray[np.bool_]:
    red, green, blue = np.moveaxis(picture, -1, 0)
    return np.asarray((red > 0.85) & (green > 0.28) & (green < 0.75) & (blue < 0.2))


def test_another_page_shows_the_selection_and_undoes_it(editor: EditorPage, server: EditorServer) -> None:
    middle, radius = ball_at(editor)
    editor.press("m")
    count = selected(editor, lambda: stroke(editor, [middle, middle + radius * np.array([0.2, 0])]))
    other = editor.tab(server.link)
    other.ready()
    other.until("cagefield.highlighted > 0", 30)
    assert other.state["selection"]["count"] == count
    other.press("Control+z")
    editor.page.bring_to_front()
    editor.until("cagefield.now.state.selection === null", 30)
    other.page.close()


def test_the_brush_has_a_ring_of_its_size(editor: EditorPage) -> None:
    middle, _ = ball_at(editor)
    editor.press("m")
    editor.page.mouse.move(*middle)
    ring = "Number(document.querySelector('.region circle').getAttribute('r'))"
    radius = editor.page.evaluate(ring)
    assert radius == pytest.approx(0.04 * editor.box["height"], rel=0.01)
    camera = editor.page.evaluate("cagefield.camera.seq")
    editor.press("]", "]")
    assert editor.page.evaluate(ring) == pytest.approx(1.44 * radius)
    editor.press("[", "[")
    assert editor.page.evaluate(ring) == pytest.approx(radius)
    assert editor.page.evaluate("cagefield.camera.seq") == camera, "the keys go to no other camera"


def test_a_range_of_the_histogram_selects(editor: EditorPage) -> None:
    if not editor.page.evaluate("document.querySelector('.section.selection').open"):
        editor.page.click(".section.selection > summary")
    editor.page.click(".histogram summary")
    editor.until("document.querySelector('.histogram .all').getAttribute('d') !== ''", 30)
    box = editor.page.locator(".histogram svg").bounding_box()
    # The floor's splats have an opacity of .9, those of the ball .8.
    at = [(box["x"] + share * box["width"], box["y"] + 20) for share in (0.85, 0.99)]
    assert selected(editor, lambda: stroke(editor, at)) == FLOOR
    editor.until("document.querySelector('.histogram .chosen').getAttribute('d') !== ''", 30)
    editor.page.click(".histogram summary")


def test_the_help_lists_the_keys(editor: EditorPage) -> None:
    editor.press("?")
    text = editor.page.inner_text(".sheet")
    for words in ("Selection", "Brush: paint over elements", "Lasso", "Invert the selection", "Enclose"):
        assert words in text
    editor.press("?")


def test_isolated_splats_alone_are_seen(editor: EditorPage) -> None:
    middle, _ = ball_at(editor)
    floor = shot(editor)[-75:-60, 60:-60]
    assert floor.max() < 0.6
    editor.page.click(".tools .select-flood")
    assert selected(editor, lambda: editor.page.mouse.click(*middle)) == BALL
    editor.press("/")
    editor.until("cagefield.now.state.isolated")
    editor.settle()
    assert shot(editor)[-75:-60, 60:-60].min() > 0.95, "the floor is gone"
    assert cone(editor.pixels()).area > 1000
    editor.press("/")
    editor.until("!cagefield.now.state.isolated")
    editor.settle()
    assert shot(editor)[-75:-60, 60:-60].max() < 0.6


def test_the_selection_becomes_a_lattice_or_a_mesh_by_one_key(editor: EditorPage) -> None:
    middle, radius = ball_at(editor)
    editor.press("j")
    selected(editor, lambda: stroke(editor, around(middle, 0.9 * radius)))
    for key, cage in (("Shift+E", "lattice"), ("Alt+e", "mesh")):
        editor.changed(lambda key=key: editor.press(key))
        assert editor.edit["cage"] == cage and editor.edit["kind"] == "continuous"
        assert editor.edit["problem"] is None
        editor.until("cagefield.now.mode === 'edit'")
        editor.changed(lambda: editor.press("Control+z"))
    editor.press("Escape", "Escape")


def test_the_selection_is_deleted_saved_and_restored(editor: EditorPage, server: EditorServer) -> None:
    middle, radius = ball_at(editor)

    def red() -> int:
        picture = shot(editor)
        return int(((picture[..., 0] > 0.5) & (picture[..., 1] < 0.3)).sum())

    before = red()
    editor.press("j")
    editor.page.locator(".selection .tp-lblv", has_text="Through all").locator("label").click()
    count = selected(editor, lambda: stroke(editor, around(middle, 1.15 * radius)))
    editor.page.locator(".selection .tp-lblv", has_text="Through all").locator("label").click()
    editor.changed(lambda: editor.press("Delete"))
    assert editor.state["removed"]["count"] == count and editor.state["selection"] is None
    editor.settle()
    assert red() < 0.05 * before
    other = editor.tab(server.link)
    other.ready()
    assert other.state["removed"]["count"] == count
    other.page.close()
    editor.page.bring_to_front()
    editor.changed(lambda: editor.press("Control+s"))
    assert len(Scene.open(editor.state["path"]).field) == BALL + FLOOR - count
    editor.changed(lambda: editor.page.locator(".restore-deleted").click())
    editor.settle()
    assert editor.state["removed"] is None and abs(red() - before) < 0.02 * before
    editor.changed(lambda: editor.press("Control+s"))
    assert len(Scene.open(editor.state["path"]).field) == BALL + FLOOR
    editor.press("Escape", "Escape")
