"""Views that the page's own GPU draws, in a real browser against the real server: same picture, sooner."""

from __future__ import annotations

import io
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from editor_cone import EDITS, cone
from editor_page import USUAL, EditorPage, Point, asking, editor_page
from editor_server import EditorServer, editor_server
from editor_server import page as socket_page
from hand import Hand
from splat_scenes import splat_scene

HALF = """\
version: 1
edits:
  - name: half
    delete: true
    inner: {center: [1.0, 0.0, 0.0], size: [2.0, 4.0, 4.0]}
"""
"""Nothing is left of what lies at x > 0."""

MANY = "version: 1\nedits:\n" + "".join(
    f"  - {{delete: true, inner: {{center: [{3 + n}.0, 0.0, 0.0], size: [0.5, 0.5, 0.5]}}}}\n"
    for n in range(24)
)
"""More edits than a page's shader holds, all beside the digger."""

ALIKE = 33.0
"""dB between the page's whole picture and the server's, which is a JPEG of quality 95: 38 to 40 by itself."""

pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture(scope="module")
def scene(trained_digger: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    shutil.copytree(trained_digger, folder / "digger")
    (folder / "half.yaml").write_text(HALF)
    (folder / "cone.yaml").write_text(EDITS)
    (folder / "many.yaml").write_text(MANY)
    return folder / "digger"


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[EditorServer]:
    with editor_server(scene) as running:
        yield running


def shot(page: EditorPage) -> NDArray[np.float64]:
    """The picture on the screen as it is, the mouse where it is."""
    page.page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    image = Image.open(io.BytesIO(page.page.screenshot(clip=page.box)))
    return np.asarray(image.convert("RGB"), dtype=np.float64) / 255.0


def turned(page: EditorPage, by: tuple[float, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(what the page draws with the button held, what the server draws then at rest) of a turned view."""
    drawn, seq = page.page.evaluate("[cagefield.page.drawn, cagefield.camera.seq]")
    with page.held((120.0, 330.0), by, steps=8):
        page.until(f"cagefield.page.drawn > {drawn + 3}")
        assert page.page.evaluate("cagefield.camera.seq") == seq, "the server need not know yet"
        assert "drawn here" in page.page.inner_text(".status .figures")
        own = shot(page)
    page.settle()
    assert "by the server" in page.page.inner_text(".status .figures")
    return own, shot(page)


def filled(picture: NDArray[np.float64]) -> float:
    """The share of a picture that is not the white background."""
    return float((picture.min(axis=2) < 0.9).mean())


def db(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    return float(-10.0 * np.log10(np.mean(np.square(one - other))))


def test_the_page_draws_the_view_that_is_turned(server: EditorServer, scene: Path) -> None:
    with editor_page(asking(server.link, "page"), 500, 420) as page:
        page.ready()
        page.press("n", "o")  # room for the picture, and no cages on it
        page.until("cagefield.page.why === null && cagefield.page.draws")
        page.settle()
        still = shot(page)
        own, whole = turned(page, (90.0, 15.0))
        # Software draws few pixels; they are the right ones.
        assert db(still, whole) < 20.0
        assert db(own, whole) > 22.0
        page.load(scene.parent / "half.yaml")
        page.settle()
        page.until("cagefield.page.draws")
        full = filled(whole)
        own, whole = turned(page, (-70.0, 5.0))
        assert db(own, whole) > 22.0
        # With its edits: half of the digger is gone, and the picture is not the one before them.
        assert filled(whole) < 0.75 * full and filled(own) < 0.85 * full
        page.press("u")
        # A context that is lost and restored draws again.
        page.page.evaluate(
            "window.lost = document.querySelector('canvas').getContext('webgl2')"
            ".getExtension('WEBGL_lose_context'); lost.loseContext()"
        )
        page.page.wait_for_timeout(150)
        page.page.evaluate("lost.restoreContext()")
        page.page.wait_for_timeout(150)
        turned(page, (30.0, 0.0))


@pytest.fixture(scope="module")
def pair(server: EditorServer) -> Iterator[tuple[EditorPage, EditorPage]]:
    """Two pages of one editor: one draws all of its pictures itself, the server draws those of the other."""
    with editor_page("about:blank", 500, 240) as first:
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


def alike(pair: tuple[EditorPage, EditorPage]) -> float:
    """dB between what both pages show at rest, the first by itself."""
    pictures = []
    for page in pair:
        page.page.bring_to_front()
        page.settle()
        pictures.append(page.pixels())
    assert filled(pictures[0]) > 0.02
    return db(*pictures)


def test_a_drag_is_drawn_by_the_page_and_ends_as_the_server_draws_it(
    pair: tuple[EditorPage, EditorPage], scene: Path
) -> None:
    own, other = pair
    own.page.bring_to_front()
    own.loaded(scene.parent / "cone.yaml")
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
    assert before.at[1] - cone(own.pixels()).at[1] > 5.0, "the cone went up"
    own.page.bring_to_front()
    own.changed(lambda: own.press("Control+z"))
    assert alike(pair) > ALIKE
    own.page.bring_to_front()
    own.load(scene.parent / "half.yaml")
    assert alike(pair) > ALIKE
    # What came and went was never more than a drag's step: the field is there once.
    assert own.page.evaluate("cagefield.page.loads") == 1


@pytest.mark.parametrize("view", ["normals", "depth", "opacity", "split"])
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
            page.page.click("[data-view=colour]")


def test_a_page_that_reconnects_keeps_the_field(pair: tuple[EditorPage, EditorPage]) -> None:
    own, _ = pair
    own.page.bring_to_front()
    number = own.page.evaluate("cagefield.now.hello.page")
    own.page.evaluate("sockets.at(-1).close()")
    own.until(f"cagefield.now.hello.page !== {number} && cagefield.page.draws")
    own.settle()
    assert own.page.evaluate("cagefield.page.loads") == 1
    assert alike(pair) > ALIKE


def test_edits_that_a_page_cannot_draw_are_the_servers_and_the_page_says_why(
    pair: tuple[EditorPage, EditorPage], scene: Path
) -> None:
    own, _ = pair
    own.page.bring_to_front()
    own.load(scene.parent / "many.yaml")
    own.until("cagefield.page.here === 'nothing'")
    own.settle()
    assert own.page.evaluate("cagefield.picture.picture") > 0
    assert "24 edits are more than a page's GPU takes" in str(
        own.page.get_attribute(".status .figures", "title")
    )
    own.changed(lambda: own.press("Control+z"))
    own.until("cagefield.page.here === 'all' && cagefield.page.draws")
    assert alike(pair) > ALIKE


def test_software_and_addresses_leave_it_to_the_server(server: EditorServer) -> None:
    for render, why in (("best", "no GPU"), ("server", "address")):
        with editor_page(asking(server.link, render), 500, 420) as page:
            page.ready()
            assert why in page.page.evaluate("cagefield.page.why")
            with page.held((120.0, 330.0), (60.0, 5.0)):
                pass
            page.settle()
            assert page.page.evaluate("cagefield.page.drawn") == 0


def test_fingers_turn_shift_and_pinch(server: EditorServer) -> None:
    with editor_page(asking(server.link, "page"), 500, 420, touch=True) as page:
        page.ready()
        page.press("n", "o")
        page.until("cagefield.page.draws")
        page.settle()
        hand = Hand(page.page)

        def moved(first: list[Point], last: list[Point]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            """Where the camera is after fingers moved, and where it looks; the page has drawn it."""
            drawn = page.page.evaluate("cagefield.page.drawn")
            hand.move(first, last)
            page.settle()
            assert page.page.evaluate("cagefield.page.drawn") > drawn
            c2w = np.array(page.page.evaluate("cagefield.camera.c2w")).reshape(4, 4)
            return c2w[:3, 3], -c2w[:3, 2]

        eye, ahead = moved([(200, 330)], [(203, 330)])
        turned, other = moved([(200, 330)], [(280, 330)])
        assert np.dot(ahead, other) < 0.95 and not np.allclose(eye, turned)
        shifted, same = moved([(150, 330), (250, 330)], [(150, 280), (250, 280)])
        np.testing.assert_allclose(same, other, atol=1e-3)
        assert abs(np.dot(shifted - turned, other)) < 0.1 * np.linalg.norm(shifted - turned)
        near, same = moved([(150, 330), (250, 330)], [(100, 330), (300, 330)])
        np.testing.assert_allclose(same, other, atol=1e-3)
        assert np.dot(near - shifted, other) > 0.9 * np.linalg.norm(near - shifted) > 0.1


def test_pages_that_are_closed_leave_nothing_in_the_server(server: EditorServer) -> None:
    def held() -> tuple[int, int]:
        """Files and sockets, and threads, of the server and its rendering process."""
        pids = [server.process.pid, *server.children()]
        folders = [Path(f"/proc/{pid}") for pid in pids]
        return sum(len(list((folder / "fd").iterdir())) for folder in folders), sum(
            len(list((folder / "task").iterdir())) for folder in folders
        )

    def open_and_close() -> None:
        with socket_page(server) as (client, hello):
            client.look_from(hello)
            client.final()

    open_and_close()
    before = held()
    for _ in range(4):
        open_and_close()
    end = time.monotonic() + 20.0
    # Sockets close a moment after the page has gone.
    while held() > before and time.monotonic() < end:
        time.sleep(0.05)
    assert held() <= before


def test_splats_are_drawn_by_the_server(tmp_path: Path) -> None:
    scene = tmp_path / "splats"
    splat_scene().save(scene)
    usual = (*USUAL, "status of 404")
    with (
        editor_server(scene) as server,
        editor_page(asking(server.link, "page"), 500, 420, usual=usual) as page,
    ):
        page.ready()
        page.until("cagefield.page.why.includes('only voxel fields')")
