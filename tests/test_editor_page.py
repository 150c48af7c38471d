"""The editor in a real browser against the real server: what a user does, seen in pixels and in the state.

One small trained field of the digger, one server and one page for all tests; each loads the same edit file
first. Where the traffic cone is, how large and how it leans is read off the pixels.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.edits import load_edits
from cagefield.geometry.cage import EDGES
from cagefield.scene.scene import Scene
from editor_cone import EDITS, cone, difference, moved
from editor_page import PATIENCE, EditorPage, editor_page
from editor_server import EditorServer, editor_server
from scenes import ball_field

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def scene(trained_digger: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The digger, and an edit file beside it."""
    folder = tmp_path_factory.mktemp("editor")
    shutil.copytree(trained_digger, folder / "digger")
    (folder / "cone.yaml").write_text(EDITS)
    return folder / "digger"


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
    """The page with one edit around the cone, selected, in Edit mode."""
    return opened.loaded(scene.parent / "cone.yaml")


def test_double_click_sets_both_cages_and_they_move_without_the_field(editor: EditorPage) -> None:
    editor.changed(lambda: editor.press("Escape"))  # else the gizmo is in the way
    before = editor.pixels()
    column, row = cone(before).at
    editor.page.mouse.dblclick(editor.box["x"] + column, editor.box["y"] + row)
    editor.until("cagefield.now.state.edits.length === 2 && cagefield.now.mode === 'set'")
    editor.settle()
    placed = editor.edit
    low, high = np.min(placed["inner"], axis=0), np.max(placed["inner"], axis=0)
    outer_low, outer_high = np.min(placed["outer"], axis=0), np.max(placed["outer"], axis=0)
    # The cone's axis is at (.65, .5); the point under the mouse is on its surface.
    assert (low[:2] < [0.65, 0.5]).all() and (high[:2] > [0.65, 0.5]).all() and low[2] < -0.2 < high[2]
    assert (outer_low < low).all() and (outer_high > high).all()

    editor.tools(cage="both")
    lines = editor.pixels(cages=True)
    after = editor.drag(editor.grip("Z"), (0, -40))
    by = moved(placed["inner"], after["inner"])
    assert by[0, 2] > 0.05 and np.allclose(by, by[0], atol=1e-9)
    assert np.allclose(moved(placed["outer"], after["outer"]), by[0], atol=1e-9)
    assert after["operations"] == []

    editor.tools(cage="outer", tool="scale")
    larger = editor.drag(editor.grip("XYZ"), (30, 0))
    assert np.ptp(larger["outer"], axis=0) == pytest.approx(
        np.ptp(after["outer"], axis=0) * larger_by(after, larger)
    )
    assert larger_by(after, larger) > 1.1 and larger["inner"] == after["inner"]

    assert difference(editor.pixels(cages=True), lines) > 0.3
    assert np.allclose(cone(editor.pixels()).at, (column, row), atol=1.0)


def larger_by(before: dict[str, Any], after: dict[str, Any]) -> float:
    """By how much the outer cage's first edge was scaled."""
    return float(np.ptp(after["outer"], axis=0)[0] / np.ptp(before["outer"], axis=0)[0])


def test_the_gizmo_translates_the_cone(editor: EditorPage) -> None:
    before, start = cone(editor.pixels()), editor.edit
    after = editor.drag(editor.grip("Z"), (0, -30))
    by = moved(start["deformed"], after["deformed"])
    assert np.allclose(by, [0, 0, by[0, 2]], atol=1e-9) and by[0, 2] > 0.05
    assert after["inner"] == start["inner"] and len(after["operations"]) == 1
    assert "translation" in after["operations"][0]
    shift = cone(editor.pixels()).at - before.at
    # The handle follows the mouse, and the cone the handle: they are at nearly the same distance.
    assert shift[1] == pytest.approx(-30, abs=9) and abs(shift[0]) < 8


def test_the_gizmo_rotates_the_cone(editor: EditorPage) -> None:
    before, start = cone(editor.pixels()), editor.edit
    editor.tools(tool="rotate")
    after = editor.drag(editor.grip("X"), (25, 0))
    A = np.asarray(start["deformed"]) - start["pivot"]
    B = np.asarray(after["deformed"]) - after["pivot"]
    angle = np.degrees(np.arccos(np.clip((A[:, 1:] * B[:, 1:]).sum() / (A[:, 1:] ** 2).sum(), -1, 1)))
    assert np.allclose(A[:, 0], B[:, 0], atol=1e-9) and 10 < angle < 90
    assert "rotation" in after["operations"][0]
    turned = (cone(editor.pixels()).lean - before.lean + 90) % 180 - 90
    assert abs(turned) > 5


def test_the_gizmo_scales_the_cone(editor: EditorPage) -> None:
    before, start = cone(editor.pixels()), editor.edit
    editor.tools(tool="scale")
    after = editor.drag(editor.grip("XYZ"), (30, 0))
    factor = np.ptp(after["deformed"], axis=0) / np.ptp(start["deformed"], axis=0)
    assert np.allclose(factor, factor[0]) and 1.1 < factor[0] < 1.6
    assert "scaling" in after["operations"][0]
    area = cone(editor.pixels()).area / before.area
    assert area == pytest.approx(factor[0] ** 2, rel=0.3)


def test_corners_edges_and_faces_are_dragged(editor: EditorPage) -> None:
    before, start = editor.pixels(), editor.edit
    editor.tools(tool="select")
    corner = editor.drag(editor.part("corner", 7), (12, -14))
    by = moved(start["deformed"], corner["deformed"])
    assert np.linalg.norm(by[7]) > 0.03 and np.allclose(np.delete(by, 7, axis=0), 0)
    middle = editor.pixels()
    assert difference(before, middle) > 0.1

    # Edge 11 joins corners 3 and 7 of the top and the bottom; edge 9 joins 1 and 5.
    edge = editor.drag(editor.part("edge", 9), (-10, 0))
    by = moved(corner["deformed"], edge["deformed"])
    assert np.linalg.norm(by[1]) > 0.02 and np.allclose(by[1], by[5])
    assert np.allclose(by[[0, 2, 3, 4, 6, 7]], 0)
    assert difference(middle, editor.pixels()) > 0.1

    face = editor.drag(editor.part("face", 4), (0, -15))
    by = moved(edge["deformed"], face["deformed"])
    assert np.linalg.norm(by[4]) > 0.02 and np.allclose(by[4:], by[4]) and np.allclose(by[:4], 0)
    assert [text.split()[0] for text in face["operations"]] == ["corner", "edge", "face"]


def test_a_drag_stops_at_the_outer_cage_and_says_why(editor: EditorPage) -> None:
    outer = np.asarray(editor.edit["outer"])
    with editor.held(editor.grip("Z"), (0, -170)):
        # In the same frame, before the server's answer: the page knows the outer cage.
        assert "outer cage" in editor.page.inner_text(".status .message")
        editor.until("cagefield.picture.drag > 0 && cagefield.picture.seq === cagefield.drag.seq")
        assert "stay inside the outer cage; enlarge the outer cage (Set mode)" in editor.said("stops here")
    editor.until("cagefield.drag === null")
    top = np.max(editor.edit["deformed"], axis=0)[2]
    assert top <= outer[:, 2].max() and top > outer[:, 2].max() - 0.01


def test_escape_gives_a_drag_up(editor: EditorPage) -> None:
    before, edits, history = editor.pixels(), editor.edits, editor.state["history"]
    with editor.held(editor.grip("Z"), (0, -30)):
        editor.until("cagefield.picture.drag > 0")
        editor.press("Escape")
    editor.settle()
    assert editor.edits == edits and editor.state["history"] == history
    assert cone(editor.pixels()).at == pytest.approx(cone(before).at, abs=1.0)


def test_discrete_and_continuous_copy_and_delete(editor: EditorPage) -> None:
    start = cone(editor.pixels())
    editor.changed(lambda: editor.press("d"))
    assert editor.edit["kind"] == "move"
    after = editor.drag(editor.grip("Z"), (0, -60))
    # A discrete edit is not confined: it may leave the outer cage.
    discrete = editor.pixels()
    assert cone(discrete).at[1] < start.at[1] - 30
    editor.changed(lambda: editor.press("d"))
    assert editor.edit["kind"] == "continuous" and editor.edit["deformed"] == after["deformed"]

    editor.press("n")
    kind = editor.page.locator(".pane select").first
    editor.changed(lambda: kind.select_option("Copy"))
    editor.press("n")
    editor.settle()
    assert editor.edit["kind"] == "copy"
    assert cone(editor.pixels()).area == pytest.approx(2 * cone(discrete).area, rel=0.3)

    editor.press("n")
    editor.changed(lambda: kind.select_option("Delete"))
    editor.press("n")
    editor.settle()
    assert editor.edit["kind"] == "delete"
    assert cone(editor.pixels()).area < 0.2 * start.area


def test_ten_steps_are_undone_and_done_again(editor: EditorPage) -> None:
    first, clean, before = editor.state, editor.edits, editor.pixels()
    for n in range(10):
        revision = editor.state["revision"]
        with editor.held(editor.grip("Z"), (0, 6 if n % 2 else -12), steps=2):
            pass
        editor.until(f"cagefield.now.state.revision > {revision} && cagefield.drag === null")
    editor.settle()
    last, done, after = editor.state, editor.edits, editor.pixels()
    assert last["entry"] == first["entry"] + 10
    for key, wanted, edits, seen in (
        ("Control+z", first, clean, before),
        ("Control+Shift+Z", last, done, after),
    ):
        editor.press(*[key] * 10)
        editor.until(f"cagefield.now.state.entry === {wanted['entry']}")
        editor.settle()
        assert editor.edits == edits
        assert difference(editor.pixels(), seen) < 0.2  # JPEG's, of tiles cut elsewhere
    assert cone(after).at[1] < cone(before).at[1] - 15


def test_before_is_shown_while_its_key_is_held(editor: EditorPage) -> None:
    start = cone(editor.pixels()).at
    editor.drag(editor.grip("Z"), (0, -30))
    edited = cone(editor.pixels()).at
    assert edited[1] < start[1] - 20
    editor.page.keyboard.down("b")
    sees(editor, start)
    editor.page.keyboard.up("b")
    sees(editor, edited)


def sees(editor: EditorPage, at: NDArray[np.float64]) -> None:
    """Waits until the cone is there in the picture, to two pixels."""
    end = time.monotonic() + PATIENCE
    while not np.allclose(cone(editor.pixels()).at, at, atol=2.0):
        assert time.monotonic() < end, f"the cone is at {cone(editor.pixels()).at}, not at {at}"


def test_lines_are_solid_before_the_field_and_dashed_behind_it(editor: EditorPage, scene: Path) -> None:
    file = scene.parent / "low.yaml"
    file.write_text(EDITS.replace("-0.215]", "-0.27]").replace("0.36]}", "0.46]}"))  # 0.1 into the ground
    editor.load(file)
    editor.tools(tool="select")
    lines = np.abs(editor.pixels(cages=True) - editor.pixels()).max(axis=2) > 0.1

    def share(i: int, j: int) -> float:
        """Share of the places along an edge at which a line is drawn."""
        a, b = (np.array(editor.part("corner", k)) - [editor.box["x"], editor.box["y"]] for k in (i, j))
        across = np.array([0, 1]) if abs(b - a)[0] > abs(b - a)[1] else np.array([1, 0])
        spots = np.floor(a + np.linspace(0.15, 0.85, 60)[:, None] * (b - a)).astype(int)
        return float(
            np.mean([any(lines[y, x] for x, y in spot + across * [[-1], [0], [1]]) for spot in spots])
        )

    above = [share(i, j) for i, j in EDGES if i & j & 4]
    below = [share(1, 3), share(2, 3)]  # those two that no other line crosses on the screen
    assert len(above) == 4
    # Dashes are 4.5 pixels of every 8.
    assert min(above) > 0.9 and max(below) < 0.8 and min(below) > 0.3, (above, below)


def test_saved_edits_are_found_again_after_a_reload(editor: EditorPage, scene: Path) -> None:
    editor.drag(editor.grip("Z"), (0, -30))
    before, edits = editor.pixels(), editor.edits
    assert editor.state["saved"] is False
    editor.changed(lambda: editor.press("Control+s"))
    assert editor.state["saved"] is True
    (stored,) = load_edits(scene / "edits.yaml")
    assert stored.name == "cone" and np.allclose(stored.deformed.corners, edits[0]["deformed"], atol=1e-6)
    editor.page.reload()
    editor.ready()
    assert editor.edits == edits
    assert editor.page.evaluate("cagefield.now.mode") == "edit"
    assert difference(editor.pixels(), before) < 0.15


def test_a_server_that_is_killed_in_a_drag_is_found_again(
    editor: EditorPage, server: EditorServer, scene: Path
) -> None:
    state = editor.changed(lambda: editor.press("Control+s"))
    with editor.held(editor.grip("Z"), (0, -30)):
        server.kill()
        editor.until("cagefield.now.connection === 'lost'")
        assert editor.page.is_visible(".lost")
    with editor_server(scene, "--port", str(server.port)):
        editor.until("cagefield.now.connection === 'open'")
        editor.until("cagefield.now.state.revision >= 0 && cagefield.drag === null")
        editor.settle()
        assert editor.state["edits"][0]["deformed"] == state["edits"][0]["deformed"]
        assert not editor.page.is_visible(".lost")
        editor.drag(editor.grip("Z"), (0, -20))


def test_a_camera_amid_the_field_orbits_around_what_it_sees(opened: EditorPage, tmp_path: Path) -> None:
    eye, ball = np.array([0.2, -0.9, 0.3]), np.array([0.0, 0.0, 0.1])
    camera = Camera.look_at(eye, ball, width=64, height=48, fov_x=0.9)
    Scene(ball_field(), cameras={"test": (camera,)}).save(tmp_path / "ball")

    def pose() -> NDArray[np.float64]:
        return np.array(page.page.evaluate("cagefield.camera.c2w"), dtype=float).reshape(4, 4)

    with editor_server(tmp_path / "ball") as server:
        page = opened.tab(server.link)
        page.ready()
        page.settle()
        box, before = page.box, pose()
        np.testing.assert_allclose(before, camera.c2w, atol=1e-6)
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        distance = page.page.evaluate("([x, y]) => cagefield.depth(x, y)", list(middle))
        assert 0.3 < distance < 0.6
        seen = before[:3, 3] - distance * before[:3, 2]
        for _ in range(2):
            with page.held(middle, (60, 20)):
                pass
            page.settle()
            after = pose()
            turned = after[:3, 2] @ before[:3, 2]
            assert turned < 0.95
            # It still looks at the point, from as far: to a hundredth, the depth's resolution.
            np.testing.assert_allclose(after[:3, 3] - distance * after[:3, 2], seen, atol=0.01 * distance)
            # Back where it began, the center is taken anew from what is seen there.
            page.page.keyboard.press("Home")
            page.settle()
            np.testing.assert_allclose(pose(), before, atol=1e-6)
        page.page.close()
