"""Drags of splats, pictures at rest and views of the page's own GPU, beside a page that the server draws."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from editor_page import EditorPage, asking, editor_page
from editor_server import editor_server
from page_shots import HALF, alike, db, filled
from splat_scenes import splat_scene
from tiers import nightly_except

SHELL = """\
version: 1
edits:
  - name: shell
    inner: {center: [0.0, 0.0, 0.5], size: [0.7, 0.7, 0.4]}
    outer: {center: [0.0, 0.0, 0.5], size: [1.2, 1.2, 0.8]}
"""
"""An edit that changes nothing yet, of the top of the ball."""

ALIKE = 32.0
"""dB between the page's whole picture and the server's, which is a JPEG of quality 95."""

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("splats")
    splat_scene().save(folder / "ball")
    for name, text in (("half", HALF), ("shell", SHELL)):
        (folder / f"{name}.yaml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def pair(files: Path) -> Iterator[tuple[EditorPage, EditorPage]]:
    """Two pages of one editor: one draws all of its pictures itself, the server draws those of the other."""
    with editor_server(files / "ball") as server, editor_page(asking(server.link, "all"), 360, 220) as first:
        first.ready()
        second = first.tab(asking(server.link, "server"))
        second.ready()
        for page in (second, first):
            page.page.bring_to_front()
            page.press("n")
            page.settle()
        first.until("cagefield.page.here === 'all' && cagefield.page.draws")
        yield first, second


def test_a_drag_of_splats_is_drawn_by_the_page_and_ends_as_the_server_draws_it(
    pair: tuple[EditorPage, EditorPage], files: Path
) -> None:
    own, other = pair
    assert alike(pair) > ALIKE
    before = other.pixels()
    own.page.bring_to_front()
    own.loaded(files / "shell.yaml")
    assert own.page.evaluate("cagefield.picture.picture") == 0, "the page's own picture at rest"
    pictures = own.page.evaluate("cagefield.latency.presented.filter(p => p.drag > 0).length")
    with own.held(own.grip("Z"), (0, -24), steps=3):
        own.until(f"cagefield.latency.presented.filter(p => p.drag > 0).length > {pictures}")
        own.until("cagefield.latency.moves.at(-1).presented !== null")
        uploaded = own.page.evaluate("cagefield.page.uploaded.last")
        # 64 bytes of each splat that moved: some of the ball's 600, not split.
        assert uploaded % 64 == 0 and 20 * 64 < uploaded < 400 * 64
        assert own.page.evaluate("cagefield.picture.picture") == 0, "no picture of the server's"
        assert "drawn here" in own.page.inner_text(".status .figures")
    own.until("cagefield.drag === null")
    assert alike(pair) > ALIKE
    assert db(before, other.pixels()) < 25.0, "the top of the ball went up"
    own.page.bring_to_front()
    own.load(files / "half.yaml")
    assert alike(pair) > ALIKE
    assert filled(own.pixels()) < 0.75 * filled(before)
    assert own.page.evaluate("cagefield.page.loads") == 1


@pytest.mark.parametrize("view", nightly_except(["normals", "depth", "opacity", "split"], "normals", "split"))
def test_views_of_splats_are_the_servers(pair: tuple[EditorPage, EditorPage], view: str) -> None:
    for page in pair:
        page.page.bring_to_front()
        if view == "split":
            page.press("p")
        else:
            page.page.click(f"[data-view={view}]")
    assert alike(pair) > ALIKE
    assert pair[0].page.evaluate("cagefield.picture.picture") == 0
    for page in pair:
        page.page.bring_to_front()
        if view == "split":
            page.press("p")
        else:
            page.page.click("[data-view=color]")
