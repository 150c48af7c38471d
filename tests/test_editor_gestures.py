"""Every gesture of the editor once, in one real browser page against one real server, seen in the state.

A red ball of 800 splats over a gray floor, without light. Pixels are checked where a gesture is nothing
else; the nightly tests of the editor see the others in pixels too.
"""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.edits import load_edits, parse_edits
from cagefield.formats.splats.splat_files import read_splats
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.scene.scene import Scene
from editor_cone import cone, moved
from editor_page import PATIENCE, EditorPage, editor_page
from editor_server import EditorServer, editor_server
from page_shots import shot
from splat_scenes import BALL_RADIUS, ball_and_floor, ball_of_splats

pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")

BALL, FLOOR = 800, 576
EDITS = {
    "ball": "- {name: ball, inner: {center: [0, 0, 0], size: 0.6}, outer: {margin: 0.35}, fill: none,"
    " relight: none, lattice: 16}",
    "lattice": """\
- name: net
  inner: {center: [0, 0, 0], size: [0.6, 0.6, 0.6], lattice: {points: [2, 2, 3]}}
  outer: {margin: 0.35}
  relight: none
  lattice: 16
""",
    "chain": """\
- name: arm
  inner: {center: [0, 0, 0], size: [0.8, 0.4, 0.4]}
  outer: {margin: 0.6}
  relight: none
  lattice: 16
  operations: [{rotate_deg: [0, 90, 0]}]
- {name: finger, inner: {center: [0.25, 0, 0], size: 0.2}, outer: {margin: 0.1}, relight: none, lattice: 16}
""",
    "points": """\
- name: face
  inner: {points: [[0, 0, -0.3], [0, 0, -0.05], [0, 0, 0.4]], radius: 0.3}
  relight: none
  lattice: 16
""",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the scene, `ball`, another one to paste, `other`, and edit files."""
    folder = tmp_path_factory.mktemp("gestures")
    camera = Camera.look_at((0.0, -3.0, 0.9), (0, 0, 0), width=320, height=230, fov_x=0.8)
    Scene(ball_and_floor(), cameras={"test": (camera,)}).save(folder / "ball")
    Scene(ball_of_splats(200, 0.3), cameras={"test": (camera,)}).save(folder / "other")
    for name, text in EDITS.items():
        (folder / f"{name}.yaml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[EditorServer]:
    with editor_server(folder / "ball") as running:
        yield running


@pytest.fixture(scope="module")
def opened(server: EditorServer) -> Iterator[EditorPage]:
    with editor_page(server.link, 640, 440) as page:
        page.ready()
        yield page


@pytest.fixture
def editor(opened: EditorPage, folder: Path) -> EditorPage:
    """The page with one continuous edit around the ball, selected, in Edit mode."""
    opened.page.bring_to_front()
    opened.press("Escape", "Escape", "Home")
    return opened.loaded(folder / "ball.yaml")


def place(editor: EditorPage, point: Any) -> NDArray[np.float64]:
    """Window coordinates of a point of the scene."""
    at = editor.page.evaluate(f"cagefield.project({list(map(float, point))})")
    return np.array([at["x"], at["y"]])


def row(editor: EditorPage, label: str) -> Any:
    """A line of the panel."""
    return editor.page.locator(".pane .tp-lblv", has_text=label)


def undone(editor: EditorPage, count: int = 1) -> None:
    for _ in range(count):
        editor.changed(lambda: editor.press("Control+z"))


def test_the_gizmo_translates_rotates_and_scales(editor: EditorPage) -> None:
    clean, history, seen = editor.edits, editor.state["history"], cone(editor.pixels())
    start = editor.edit["deformed"]
    with editor.held(editor.grip("X"), (35, 0)):
        editor.until("cagefield.picture.drag > 0")
        editor.press("Escape")
    editor.settle()
    assert editor.edits == clean and editor.state["history"] == history, "Escape gives a drag up"
    along = editor.drag(editor.grip("X"), (35, 0))["deformed"]
    by = moved(start, along)
    assert by[0, 0] > 0.05 and np.allclose(by, [by[0, 0], 0, 0], atol=1e-9)
    shift = cone(editor.pixels()).at - seen.at
    assert shift[0] == pytest.approx(35, abs=6) and abs(shift[1]) < 4
    editor.tools(tool="rotate", axes="cage")
    editor.page.keyboard.down("Control")
    turned = editor.drag(editor.grip("Z"), (25, 0))
    editor.page.keyboard.up("Control")
    found = re.fullmatch(r"rotation by \(0, 0, (-?\d+)\) degrees", turned["operations"][1])
    assert found and int(found[1]) and int(found[1]) % 15 == 0, "Control snaps to 15 degrees"
    editor.tools(tool="scale", axes="world")
    scaled = editor.drag(editor.grip("Z"), (0, -20))
    factor = np.ptp(scaled["deformed"], axis=0)[2] / np.ptp(turned["deformed"], axis=0)[2]
    assert "scaling" in scaled["operations"][2] and abs(factor - 1.0) > 0.05
    last = editor.edits
    undone(editor, 3)
    assert editor.edits == clean
    for _ in range(3):
        editor.changed(lambda: editor.press("Control+Shift+Z"))
    assert editor.edits == last
    editor.changed(lambda: editor.page.click(".history .entry >> nth=1"))
    assert len(editor.edits) == len(clean) and editor.state["entry"] == 1


def test_a_drag_stops_at_the_outer_cage(editor: EditorPage) -> None:
    outer = np.asarray(editor.edit["outer"])
    with editor.held(editor.grip("Z"), (0, -150)):
        assert "outer cage" in editor.page.inner_text(".status .message")
        editor.until("cagefield.picture.drag > 0 && cagefield.picture.seq === cagefield.drag.seq")
        assert "stay inside the outer cage; enlarge the outer cage (Set mode)" in editor.said("stops here")
    editor.until("cagefield.drag === null")
    top = np.max(editor.edit["deformed"], axis=0)[2]
    assert outer[:, 2].max() - 0.01 < top <= outer[:, 2].max()


def test_corners_edges_and_faces_are_dragged(editor: EditorPage) -> None:
    start = editor.edit
    editor.tools(tool="select")
    corner = editor.drag(editor.part("corner", 7), (12, -14))
    by = moved(start["deformed"], corner["deformed"])
    assert np.linalg.norm(by[7]) > 0.02 and np.allclose(np.delete(by, 7, axis=0), 0)
    edge = editor.drag(editor.part("edge", 9), (-10, 0))  # from corner 1 to 5
    by = moved(corner["deformed"], edge["deformed"])
    assert np.linalg.norm(by[1]) > 0.02 and np.allclose(by[[1, 5]], by[1])
    assert np.allclose(by[[0, 2, 3, 4, 6, 7]], 0)
    face = editor.drag(editor.part("face", 4), (0, -12))
    by = moved(edge["deformed"], face["deformed"])
    assert np.linalg.norm(by[4]) > 0.02 and np.allclose(by[4:], by[4]) and np.allclose(by[:4], 0)
    assert [text.split()[0] for text in face["operations"]] == ["corner", "edge", "face"]


def test_set_mode_places_fits_and_moves_cages(editor: EditorPage) -> None:
    editor.changed(lambda: editor.press("Escape"))
    at = place(editor, (0, 0, 0))
    editor.page.mouse.dblclick(*at)
    editor.until("cagefield.now.state.edits.length === 2 && cagefield.now.mode === 'set'")
    editor.settle()
    placed = editor.edit
    # The point of the ball that looks at the camera, which is at (0, -3, .9).
    np.testing.assert_allclose(
        np.mean(placed["inner"], axis=0), [0.0, -0.958 * BALL_RADIUS, 0.287 * BALL_RADIUS], atol=0.06
    )
    editor.tools(cage="both")
    after = editor.drag(editor.grip("Z"), (0, -20))
    by = moved(placed["inner"], after["inner"])
    assert by[0, 2] > 0.02 and np.allclose(by, by[0], atol=1e-9)
    assert np.allclose(moved(placed["outer"], after["outer"]), by[0], atol=1e-9)
    editor.tools(cage="outer", tool="scale")
    larger = editor.drag(editor.grip("Z"), (0, 12))
    assert np.ptp(larger["outer"], axis=0)[2] > 1.05 * np.ptp(after["outer"], axis=0)[2]
    assert larger["inner"] == after["inner"] and larger["operations"] == []
    editor.changed(lambda: editor.press("Delete"))
    editor.page.click(".edit .name")
    editor.until("cagefield.now.state.selected !== null")
    editor.changed(lambda: editor.press("i"))
    inner = np.array(editor.edit["inner"])
    np.testing.assert_allclose(np.abs(inner), BALL_RADIUS, atol=0.05)


@pytest.mark.nightly
def test_kinds_numbers_and_patches_are_set_in_the_panel(editor: EditorPage) -> None:
    start, pivot = editor.edit["deformed"], editor.edit["pivot"]
    editor.fill("Position", pivot[2] + 0.1, "z")
    assert np.allclose(moved(start, editor.edit["deformed"]), [0, 0, 0.1], atol=1e-3)
    editor.fill("Turn by", 90.0, "z")
    editor.fill("Scale by", 1.2, "z")
    assert np.ptp(editor.edit["deformed"], axis=0)[2] == pytest.approx(0.72)
    field = row(editor, "Position").locator("input").nth(2)
    field.fill("9")
    field.press("Enter")
    assert "must stay inside the outer cage" in editor.said("% of it is possible")
    editor.press("r")  # Enter has left the field: keys are shortcuts again
    assert editor.page.evaluate("cagefield.now.tool") == "rotate"
    editor.changed(lambda: editor.press("d"))
    assert editor.edit["kind"] == "move"
    kind = editor.page.locator(".pane select").first
    for label in ("Copy", "Delete"):
        editor.changed(lambda label=label: kind.select_option(label))
        assert editor.edit["kind"] == label.lower()
    fill = row(editor, "Fill what is uncovered")
    editor.changed(fill.locator(".tp-ckbv_w").click)
    assert editor.edit["fill"] == "surroundings"
    editor.changed(lambda: editor.press("u"))
    assert editor.edit["fill"] == "none"


@pytest.mark.nightly
def test_the_list_hides_locks_renames_duplicates_and_orders(editor: EditorPage) -> None:
    page, first = editor.page, editor.edit["id"]
    line = f'.edit[data-edit="{first}"]'
    editor.changed(lambda: editor.press("h"))
    assert not editor.edit["enabled"]
    editor.changed(lambda: page.click(f"{line} .eye"))
    assert editor.edit["enabled"]
    editor.changed(lambda: page.click(f"{line} .lock"))
    editor.press("Delete")
    assert "is locked" in editor.said("locked") and editor.edit["locked"]
    editor.changed(lambda: page.click(f"{line} .lock"))
    page.locator(f"{line} .name").dblclick()
    page.keyboard.type("red ball")
    editor.changed(lambda: editor.press("Enter"))
    assert page.inner_text(".edit .name") == "red ball"
    editor.changed(lambda: editor.press("Control+d"))
    assert [edit["name"] for edit in editor.edits] == ["red ball", "red ball 2"]
    editor.changed(lambda: page.click(".bar .up"))
    assert [edit["name"] for edit in editor.edits] == ["red ball 2", "red ball"]
    editor.changed(lambda: page.click(".mirror button:has-text('x')"))
    assert len(editor.edits) == 3
    editor.changed(lambda: editor.press("Delete"))
    assert len(editor.edits) == 2


def test_edits_are_text_and_files(editor: EditorPage, folder: Path) -> None:
    editor.press("Control+c")
    editor.said("is copied as text")
    (edit,) = parse_edits(editor.page.evaluate("navigator.clipboard.readText()"))
    assert edit.name == "ball" and np.allclose(edit.inner.corners, editor.edit["inner"])
    editor.changed(lambda: editor.press("Control+v"))
    assert len(editor.edits) == 2
    (folder / "bad.yaml").write_text(EDITS["ball"].replace("size: 0.6", "size: .nan"))
    editor.page.set_input_files("input[type=file]", folder / "bad.yaml")
    editor.said("numbers must be finite, got nan")
    assert len(editor.edits) == 2


def moves(editor: EditorPage) -> NDArray[np.float64]:
    """Displacements [n,3] of the control points of the selected edit."""
    points = editor.edit["points"]
    return np.subtract(points["deformed"], points["canonical"], dtype=np.float64)


@pytest.mark.nightly
def test_lattice_points_are_dragged_alone_and_by_rows(editor: EditorPage, folder: Path) -> None:
    editor.loaded(folder / "lattice.yaml")
    editor.tools(tool="select")
    editor.drag(editor.part("point", 9), (10, -8))
    by = moves(editor)
    assert np.linalg.norm(by[9]) > 0.02 and np.allclose(np.delete(by, 9, axis=0), 0.0)
    assert editor.edit["operations"][0].startswith("point move of point 9 by")
    undone(editor)
    low, high = (np.array(editor.part("point", k)) for k in (5, 9))
    editor.page.keyboard.down("Alt")
    editor.page.mouse.click(*(0.5 * (low + high)))
    editor.page.keyboard.up("Alt")
    assert editor.page.evaluate("cagefield.now.corners") == [1, 5, 9]
    editor.drag(editor.grip("Z"), (0, -10))
    by = moves(editor)
    assert (by[[1, 5, 9], 2] > 0.01).all() and np.allclose(np.delete(by, (1, 5, 9), axis=0), 0.0)
    editor.press("Escape")


@pytest.mark.nightly
def test_control_points_take_neighbors_along_and_are_connected(editor: EditorPage, folder: Path) -> None:
    editor.loaded(folder / "points.yaml")
    editor.tools(tool="select")
    editor.press("o")
    editor.until("cagefield.now.proportional")

    def drag() -> None:
        with editor.held(editor.part("point", 1), (12, 0)):
            before = editor.page.evaluate("cagefield.drag.followed.radius")
            editor.page.mouse.wheel(0, -100)
            editor.until(f"cagefield.drag.followed.radius > {before}")

    editor.changed(drag)
    share = np.linalg.norm(moves(editor), axis=1)
    assert 0.05 * share[1] < share[0] < share[1] and share[2] < share[0]
    editor.press("o")
    editor.changed(lambda: editor.press("Alt+o"))
    assert editor.edit["points"]["connected"] and "connected only is on" in editor.said("connected only")


def test_a_mesh_file_becomes_a_cage(editor: EditorPage, folder: Path) -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    mesh = MeshCage.of_box(Cage.box((0, 0, 0), 0.7))
    obj = "".join(f"v {x} {y} {z}\n" for x, y, z in mesh.vertices)
    obj += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in mesh.triangles)
    (folder / "cube.obj").write_text(obj)
    editor.changed(lambda: editor.page.set_input_files("input.mesh-file", folder / "cube.obj"))
    assert editor.edit["cage"] == "mesh" and editor.edit["name"] == "cube"
    assert len(editor.edit["points"]["edges"]) == 18


@pytest.mark.nightly
def test_a_child_is_dragged_where_its_parent_carries_it(editor: EditorPage, folder: Path) -> None:
    editor.loaded(folder / "chain.yaml")
    arm, finger = (edit["id"] for edit in editor.state["edits"])
    editor.changed(lambda: row(editor, "Parent").locator("select").select_option(label="arm"))
    assert editor.edit["parent"] == arm

    def corner() -> NDArray[np.float64]:
        at = editor.page.evaluate(f"cagefield.screen({finger}, 'corner', 7)")
        return np.array([at["x"], at["y"]])

    # A quarter turn about y takes x to -z: the corner at (.35, .1, .1) is at (.1, .1, -.35).
    np.testing.assert_allclose(corner(), place(editor, (0.1, 0.1, -0.35)), atol=0.5)
    editor.tools(tool="select")
    before = corner()
    editor.drag(tuple(before), (12, 0))
    by = np.subtract(editor.edit["deformed"], editor.edit["inner"])
    assert by[7, 2] > 0.01 and abs(by[7, 0]) < 0.2 * by[7, 2]
    np.testing.assert_allclose(corner() - before, [12, 0], atol=2)


def stroke(editor: EditorPage, points: list[Any]) -> None:
    mouse = editor.page.mouse
    mouse.move(*points[0])
    mouse.down()
    for x, y in points[1:]:
        mouse.move(x, y, steps=2)
    mouse.up()


def selected(editor: EditorPage, action: Any) -> int:
    """Number of selected elements after an action that changes the selection."""
    before = editor.state["entry"]
    action()
    editor.until(f"cagefield.now.state.entry !== {before}", 30)
    count = editor.state["selection"]
    return 0 if count is None else int(count["count"])


@pytest.mark.nightly
def test_elements_are_selected_isolated_deleted_and_restored(editor: EditorPage) -> None:
    editor.changed(lambda: editor.press("Delete"))
    middle = place(editor, (0, 0, 0))
    radius = float(np.linalg.norm(place(editor, (BALL_RADIUS, 0, 0)) - middle))
    ring = [middle + 1.15 * radius * np.array([np.cos(a), np.sin(a)]) for a in np.linspace(0, 2 * np.pi, 12)]
    editor.press("m")
    brushed = selected(editor, lambda: stroke(editor, [middle, (middle[0] + 0.3 * radius, middle[1])]))
    editor.until("cagefield.highlighted > 0", 30)
    assert 10 < brushed < 200
    assert selected(editor, lambda: editor.press("Control++")) > brushed, "the selection grows"
    editor.press("j")
    assert 100 < selected(editor, lambda: stroke(editor, ring)) < BALL
    editor.page.click(".tools .select-flood")
    assert selected(editor, lambda: editor.page.mouse.click(*middle)) == BALL
    assert selected(editor, lambda: editor.press("Control+i")) == FLOOR
    assert selected(editor, lambda: editor.press("a")) == BALL + FLOOR
    assert selected(editor, lambda: editor.press("Alt+a")) == 0
    assert selected(editor, lambda: editor.page.mouse.click(*middle)) == BALL
    editor.press("/")
    editor.until("cagefield.now.state.isolated")
    editor.press("/")
    editor.until("!cagefield.now.state.isolated")
    for key, cage in (("e", "box"), ("Shift+E", "lattice"), ("Alt+e", "mesh")):
        editor.changed(lambda key=key: editor.press(key))
        assert editor.edit["cage"] == cage and editor.edit["problem"] is None
        undone(editor)
    editor.changed(lambda: editor.press("Delete"))
    assert editor.state["removed"]["count"] == BALL
    editor.settle()
    assert cone(editor.pixels()).area < 50
    editor.changed(lambda: editor.page.locator(".restore-deleted").click())
    assert editor.state["removed"] is None
    editor.press("Escape", "Escape")


@pytest.mark.nightly
def test_a_scene_is_pasted(editor: EditorPage) -> None:
    editor.press("Shift+V")
    editor.until("document.querySelector('dialog select[name=source]') !== null")
    editor.page.locator("dialog select[name=source]").select_option("other")
    editor.changed(lambda: editor.page.click("dialog .primary"))
    assert editor.edit["source"].endswith("/other") and editor.edit["problem"] is None
    editor.changed(lambda: editor.press("Delete"))


@pytest.mark.nightly
def test_views_split_and_before(editor: EditorPage) -> None:
    color = shot(editor)
    editor.page.click('.top [data-view="normals"]')
    editor.settle()
    assert editor.page.evaluate("cagefield.picture.view") == "normals"
    assert np.abs(shot(editor) - color).max() > 0.3
    editor.page.click('.top [data-view="color"]')
    editor.settle()
    editor.press("p")
    editor.until("cagefield.picture.split !== null && cagefield.settled")
    editor.press("p")
    editor.page.keyboard.down("b")
    editor.until("cagefield.now.before && cagefield.picture.before && cagefield.settled")
    editor.page.keyboard.up("b")
    editor.until("!cagefield.picture.before && cagefield.settled")
    before = editor.page.evaluate("cagefield.camera.c2w")
    with editor.held((80, 370), (60, 0)):
        pass
    editor.settle()
    assert not np.allclose(editor.page.evaluate("cagefield.camera.c2w"), before)
    editor.press("?")
    editor.until("!document.querySelector('.help').hidden")
    words = editor.page.inner_text(".help")
    for line in ("Proportional editing", "Lasso", "Invert the selection", "Shift+O"):
        assert line in words
    editor.press("Escape")


@pytest.mark.nightly
def test_a_camera_path_is_recorded_and_played(editor: EditorPage) -> None:
    editor.changed(lambda: editor.press("k"))
    with editor.held((80, 370), (60, 0)):
        pass
    editor.settle()
    editor.changed(lambda: editor.page.click(".add-key"))
    second = editor.state["keys"][1]
    assert np.allclose(second["c2w"], editor.page.evaluate("cagefield.camera.c2w"))
    seconds = editor.page.locator('.key input[type="number"]').first
    seconds.fill("0.3")
    editor.changed(lambda: seconds.press("Enter"))
    editor.press("Home")
    editor.settle()
    editor.page.click("button.play")
    editor.until(f"Math.abs(cagefield.camera.c2w[3] - {second['c2w'][3]}) < 1e-6")
    with editor.page.expect_download() as download:
        editor.page.click('a[download="camera_path.json"]')
    assert len(json.loads(Path(download.value.path()).read_text())["keyframes"]) == 2
    editor.page.click("text=Download frames…")
    editor.page.select_option("dialog[open] select[name=form]", "spz")
    editor.page.fill("dialog[open] input[name=fps]", "5")
    with editor.page.expect_download(timeout=1000 * PATIENCE) as download:
        editor.page.click("dialog[open] .primary")
    assert download.value.suggested_filename == "ball.spz.zip"
    with zipfile.ZipFile(download.value.path()) as archive:
        assert archive.namelist() == ["ball_0000.spz", "ball_0001.spz", "ball_0002.spz"]


def test_a_distance_is_measured(editor: EditorPage) -> None:
    editor.press("Shift+M")
    for n, x in enumerate((0.1, -0.1), start=1):
        editor.page.mouse.click(*place(editor, (x, -0.2, 0.05)))
        editor.until(f"cagefield.now.measured.length === {n}")
    measured = np.array(editor.page.evaluate("cagefield.now.measured"))
    editor.page.fill("dialog[open] input[name=meters]", "1.5")
    editor.changed(lambda: editor.page.click("dialog[open] button.primary"))
    distance = float(np.linalg.norm(measured[0] - measured[1]))
    assert editor.state["meters_per_unit"] == pytest.approx(1.5 / distance)
    undone(editor)
    editor.press("Escape")


@pytest.mark.nightly
def test_edits_are_saved_downloaded_and_found_again(
    editor: EditorPage, server: EditorServer, folder: Path
) -> None:
    editor.drag(editor.grip("X"), (35, 0))
    edits = editor.edits
    editor.changed(lambda: editor.press("Control+s"))
    (stored,) = load_edits(folder / "ball" / "edits.yaml")
    assert np.allclose(stored.deformed.corners, edits[0]["deformed"], atol=1e-6)
    with editor.page.expect_download(timeout=1000 * PATIENCE) as waiting:
        editor.page.click(".download")
        editor.page.click("dialog[open] .primary")
    waiting.value.save_as(folder / "down.ply")
    assert read_splats(folder / "down.ply").means[:, 0].max() > BALL_RADIUS + 0.02
    other = editor.tab(server.link)
    other.ready()
    assert other.edits == edits, "another page has them"
    other.page.close()
    editor.page.reload()
    editor.ready()
    assert editor.edits == edits
