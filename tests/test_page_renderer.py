"""Views that the page's own GPU draws, in a real browser against the real server: same picture, sooner."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.edits import EditStack
from editor_page import USUAL, EditorPage, Point, asking, editor_page
from editor_server import EditorServer, editor_server
from editor_server import page as socket_page
from hand import Hand
from page_fields import lumps_scene
from page_shots import HALF, db, filled, shot
from splat_scenes import splat_scene

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


SIDES = 360, 220
"""Width and height of the window."""
HOLD = (100.0, 160.0)
"""Where the view is taken hold of."""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    dataclasses.replace(lumps_scene(), edits=EditStack(), background=(1.0, 1.0, 1.0)).save(folder / "lumps")
    (folder / "half.yaml").write_text(HALF)
    return folder / "lumps"


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[EditorServer]:
    with editor_server(scene) as running:
        yield running


DRAWN_BY = "document.querySelector('.status .figures').textContent.includes('{}')"
"""The figures follow the pictures a moment later."""


def turned(page: EditorPage, by: tuple[float, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(what the page draws with the button held, what the server draws then at rest) of a turned view."""
    drawn, seq = page.page.evaluate("[cagefield.page.drawn, cagefield.camera.seq]")
    with page.held(HOLD, by, steps=8):
        page.until(f"cagefield.page.drawn > {drawn + 3}")
        assert page.page.evaluate("cagefield.camera.seq") == seq, "the server need not know yet"
        page.until(DRAWN_BY.format("drawn here"))
        own = shot(page)
    page.until(f"cagefield.camera.seq > {seq}")  # else the picture before the turn counts as settled
    page.settle()
    page.until(DRAWN_BY.format("by the server"))
    return own, shot(page)


def test_the_page_draws_the_view_that_is_turned(server: EditorServer, scene: Path) -> None:
    with editor_page(asking(server.link, "page"), *SIDES) as page:
        page.ready()
        page.press("n", "Shift+O")  # room for the picture, and no cages on it
        page.until("cagefield.page.why === null && cagefield.page.draws")
        page.settle()
        still = shot(page)
        page.load(scene.parent / "half.yaml")
        page.settle()
        page.until("cagefield.page.draws")
        own, whole = turned(page, (90.0, 15.0))
        # Software draws few pixels; they are the right ones.
        assert db(still, whole) < 20.0
        assert db(own, whole) > 22.0
        # With its edits: half of the field is gone.
        assert filled(whole) < 0.75 * filled(still) and filled(own) < 0.85 * filled(still)
        # A context that is lost and restored draws again.
        page.page.evaluate(
            "window.lost = document.querySelector('canvas').getContext('webgl2')"
            ".getExtension('WEBGL_lose_context'); lost.loseContext()"
        )
        page.page.wait_for_timeout(150)
        page.page.evaluate("lost.restoreContext()")
        page.page.wait_for_timeout(150)
        turned(page, (30.0, 0.0))


@pytest.mark.nightly
def test_software_and_addresses_leave_it_to_the_server(server: EditorServer) -> None:
    for render, why in (("best", "no GPU"), ("server", "address")):
        with editor_page(asking(server.link, render), *SIDES) as page:
            page.ready()
            assert why in page.page.evaluate("cagefield.page.why")
            with page.held(HOLD, (60.0, 5.0)):
                pass
            page.settle()
            assert page.page.evaluate("cagefield.page.drawn") == 0


@pytest.mark.nightly
def test_fingers_turn_shift_and_pinch(server: EditorServer) -> None:
    with editor_page(asking(server.link, "page"), *SIDES, touch=True) as page:
        page.ready()
        page.press("n", "Shift+O")
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

        eye, ahead = moved([(200, 150)], [(203, 150)])
        turned, other = moved([(200, 150)], [(280, 150)])
        assert np.dot(ahead, other) < 0.95 and not np.allclose(eye, turned)
        shifted, same = moved([(150, 160), (250, 160)], [(150, 130), (250, 130)])
        np.testing.assert_allclose(same, other, atol=1e-3)
        assert abs(np.dot(shifted - turned, other)) < 0.1 * np.linalg.norm(shifted - turned)
        near, same = moved([(150, 150), (250, 150)], [(100, 150), (300, 150)])
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


@pytest.mark.nightly
def test_splats_are_drawn_by_the_page(tmp_path: Path) -> None:
    scene = tmp_path / "splats"
    splat_scene().save(scene)
    (tmp_path / "half.yaml").write_text(HALF)
    with editor_server(scene) as server, editor_page(asking(server.link, "page"), *SIDES) as page:
        page.ready()
        page.press("n", "Shift+O")
        page.until("cagefield.page.why === null && cagefield.page.draws")
        page.settle()
        own, whole = turned(page, (90.0, 15.0))
        # Software draws few pixels, of a ball with sharp edges; they are the right ones.
        assert db(own, whole) > 20.0
        page.load(tmp_path / "half.yaml")
        page.settle()
        page.until("cagefield.page.draws")
        full = filled(whole)
        own, whole = turned(page, (-70.0, 5.0))
        assert db(own, whole) > 20.0
        assert filled(whole) < 0.75 * full and filled(own) < 0.85 * full


@pytest.mark.nightly
def test_discs_are_drawn_by_the_server(tmp_path: Path) -> None:
    scene = tmp_path / "discs"
    ball = splat_scene()
    dataclasses.replace(ball, field=dataclasses.replace(ball.field, discs=True)).save(scene)
    usual = (*USUAL, "status of 409")
    with (
        editor_server(scene) as server,
        editor_page(asking(server.link, "page"), *SIDES, usual=usual) as page,
    ):
        page.ready()
        page.until("cagefield.page.why.includes('discs')")
