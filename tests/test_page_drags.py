"""Drags, pictures at rest and views of the page's own GPU, beside a page that the server draws."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cagefield.cameras.camera import Camera
from cagefield.scene.scene import Scene
from editor_cone import cone
from editor_page import PATIENCE, EditorPage, asking, editor_page
from editor_server import EditorServer, editor_server
from page_shots import HALF, alike
from scenes import ball_cameras, ball_field
from tiers import nightly_except

MANY = "version: 1\nedits:\n" + "".join(
    f"  - {{delete: true, inner: {{center: [{3 + n}.0, 0.0, 0.0], size: [0.5, 0.5, 0.5]}}}}\n"
    for n in range(24)
)
"""More edits than a page's shader holds, all beside the ball."""
BALL = """\
version: 1
edits:
  - name: ball
    inner: {center: [0, 0, 0], size: 0.8}
    outer: {margin: 0.3}
    lattice: 32
    relight: none
"""

ALIKE = 33.0
"""dB between the page's whole picture and the server's, which is a JPEG of quality 95: about 40 by itself."""

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A red ball, and edit files beside it."""
    folder = tmp_path_factory.mktemp("drags")
    camera = Camera.look_at((0.0, -1.9, 0.6), (0, 0, 0), width=320, height=230, fov_x=0.8)
    field = ball_field(resolution=33, radius=0.3)
    Scene(field, cameras={"train": ball_cameras(3), "test": (camera,)}).save(folder / "ball")
    for name, text in (("half", HALF), ("ball", BALL), ("many", MANY)):
        (folder / f"{name}.yaml").write_text(text)
    return folder / "ball"


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[EditorServer]:
    with editor_server(scene) as running:
        yield running


@pytest.fixture(scope="module")
def pair(server: EditorServer) -> Iterator[tuple[EditorPage, EditorPage]]:
    """Two pages of one editor: one draws all of its pictures itself, the server draws those of the other."""
    with editor_page("about:blank", 360, 220) as first:
        first.page.add_init_script(
            "window.sockets = []; const Plain = WebSocket;"
            "window.WebSocket = class extends Plain {"
            " constructor(...given) { super(...given); sockets.push(this); } };"
        )
        first.page.goto(asking(server.link, "all"))
        first.ready()
        own = asking(server.link, "server")
        second = first.tab(own)
        second.ready()
        for page in (second, first):
            page.page.bring_to_front()
            page.press("n")
            page.settle()
        first.until("cagefield.page.here === 'all' && cagefield.page.draws")
        yield first, second


def test_a_drag_is_drawn_by_the_page_and_ends_as_the_server_draws_it(
    pair: tuple[EditorPage, EditorPage], scene: Path
) -> None:
    own, other = pair
    own.page.bring_to_front()
    own.loaded(scene.parent / "ball.yaml")
    assert own.page.evaluate("cagefield.picture.picture") == 0, "the page's own picture at rest"
    assert alike(pair) > ALIKE
    before = cone(other.pixels())
    own.page.bring_to_front()
    pictures = own.page.evaluate("cagefield.latency.presented.filter(p => p.drag > 0).length")
    with own.held(own.grip("Z"), (0, -24), steps=3):
        own.until(f"cagefield.latency.presented.filter(p => p.drag > 0).length > {pictures}")
        own.until("cagefield.latency.moves.at(-1).presented !== null")
        uploaded = own.page.evaluate("cagefield.page.uploaded.last")
        # Rows of the one edit, its lattice of 32 nodes an axis, and what of the occupancy is new.
        assert 32**3 * 6 < uploaded < 32**3 * 6 + 40_000
        assert own.page.evaluate("cagefield.picture.picture") == 0, "no picture of the server's"
        assert "drawn here" in own.page.inner_text(".status .figures")
        # The other page sees the drag too, drawn by the server.
        other.page.bring_to_front()
        other.until("cagefield.picture.revision >= cagefield.now.state.pictured")
        other.until("cagefield.now.state.edits[0].operations.length > 0")
        own.page.bring_to_front()
    own.until("cagefield.drag === null")
    assert alike(pair) > ALIKE
    assert before.at[1] - cone(own.pixels()).at[1] > 5.0, "the ball went up"
    own.page.bring_to_front()
    own.changed(lambda: own.press("Control+z"))
    assert alike(pair) > ALIKE
    own.page.bring_to_front()
    own.load(scene.parent / "half.yaml")
    assert alike(pair) > ALIKE
    # What came and went was never more than a drag's step: the field is there once.
    assert own.page.evaluate("cagefield.page.loads") == 1


@pytest.mark.parametrize("view", nightly_except(["normals", "depth", "opacity", "split"], "depth", "split"))
def test_views_are_the_servers(pair: tuple[EditorPage, EditorPage], scene: Path, view: str) -> None:
    for page in pair:
        page.page.bring_to_front()
        if view == "split":
            page.press("p")
        else:
            page.page.click(f"[data-view={view}]")
    assert alike(pair) > ALIKE
    for page in pair:
        page.page.bring_to_front()
        if view == "split":
            page.press("p")
        else:
            page.page.click("[data-view=color]")


@pytest.mark.nightly
def test_a_page_that_reconnects_keeps_the_field(pair: tuple[EditorPage, EditorPage]) -> None:
    own, _ = pair
    own.page.bring_to_front()
    number = own.page.evaluate("cagefield.now.hello.page")
    own.page.evaluate("sockets.at(-1).close()")
    own.until(f"cagefield.now.hello.page !== {number} && cagefield.page.draws")
    assert own.page.evaluate("cagefield.page.loads") == 1
    # At first the page calls its picture from before the whole one, and may be drawing the next over it.
    begun = time.monotonic()
    while (likeness := alike(pair)) <= ALIKE and time.monotonic() - begun < PATIENCE:
        time.sleep(0.2)
    assert likeness > ALIKE


def test_edits_that_a_page_cannot_draw_are_the_servers_and_the_page_says_why(
    pair: tuple[EditorPage, EditorPage], scene: Path
) -> None:
    own, _ = pair
    own.page.bring_to_front()
    own.load(scene.parent / "many.yaml")
    own.until("cagefield.page.here === 'nothing'")
    own.settle()
    assert own.page.evaluate("cagefield.picture.picture") > 0
    own.until("document.querySelector('.figures').title.includes('24 edits are more than a page')")
    own.changed(lambda: own.press("Control+z"))
    own.until("cagefield.page.here === 'all' && cagefield.page.draws")
    assert alike(pair) > ALIKE
