"""Views that the page's own GPU draws, in a real browser against the real server: same picture, sooner."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from editor_page import EditorPage, editor_page
from editor_server import EditorServer, editor_server
from page_shots import HALF, asking, db, filled, shot
from splat_scenes import splat_scene

pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture(scope="module")
def scene(trained_digger: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    shutil.copytree(trained_digger, folder / "digger")
    (folder / "half.yaml").write_text(HALF)
    return folder / "digger"


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[EditorServer]:
    with editor_server(scene) as running:
        yield running


def turned(page: EditorPage, by: tuple[float, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(what the page draws with the button held, what the server draws then at rest) of a turned view."""
    drawn, seq = page.page.evaluate("[cagefield.page.drawn, cagefield.camera.seq]")
    with page.held((120.0, 330.0), by, steps=8):
        page.until(f"cagefield.page.drawn > {drawn + 3}")
        assert page.page.evaluate("cagefield.camera.seq") == seq, "the server need not know yet"
        assert "drawn here" in page.page.inner_text(".status .figures")
        own = shot(page)
    page.settle()
    page.until("document.querySelector('.status .figures').textContent.includes('by the server')")
    return own, shot(page)


def test_the_page_draws_the_view_that_is_turned(server: EditorServer, scene: Path) -> None:
    with editor_page(asking(server, "page"), 500, 420) as page:
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


def test_software_and_addresses_leave_it_to_the_server(server: EditorServer) -> None:
    for render, why in (("best", "no GPU"), ("server", "address")):
        with editor_page(asking(server, render), 500, 420) as page:
            page.ready()
            assert why in page.page.evaluate("cagefield.page.why")
            with page.held((120.0, 330.0), (60.0, 5.0)):
                pass
            page.settle()
            assert page.page.evaluate("cagefield.page.drawn") == 0


def test_splats_are_drawn_by_the_server(tmp_path: Path) -> None:
    scene = tmp_path / "splats"
    splat_scene().save(scene)
    with editor_server(scene) as server, editor_page(asking(server, "page"), 500, 420) as page:
        page.ready()
        page.until("cagefield.page.why.includes('only voxel fields')")
