"""The page of a link that may look but not change anything, in a real browser."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest

from editor_page import EditorPage, editor_page
from editor_server import EditorServer, editor_server, page
from scenes import ball_scene

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

BALL = {"inner": {"center": [0, 0, 0], "size": 1.1}, "outer": {"margin": 0.4}, "lattice": 16, "name": "ball"}
EDITING_KEYS = [
    "Delete",
    "d",
    "u",
    "h",
    "i",
    "k",
    "g",
    "Tab",
    "Shift+V",
    "Control+d",
    "Control+z",
    "Control+Shift+Z",
    "Control+s",
    "Control+Shift+S",
]
WORDS = "this link may look but not change anything"


@pytest.fixture(scope="module")
def links(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[EditorServer, str]]:
    """An editor with an edit and a keyframe, not saved, and its link to look only."""
    scene = tmp_path_factory.mktemp("looked at") / "scene"
    ball_scene().save(scene)
    with editor_server(scene, "--read-only-link") as server:
        assert server.process.stdout is not None
        match = re.search(r"to look only: (\S+)", server.process.stdout.readline())
        assert match
        with page(server) as (client, hello):
            client.send("load_edits", text=json.dumps({"edits": [BALL]}))
            client.state(lambda state: len(state["edits"]) == 1)
            client.send("set_path", keys=[{"c2w": hello["start"]["c2w"], "fov_y_deg": 40.0}], loop=False)
            client.state(lambda state: len(state["keys"]) == 1)
        yield server, match.group(1)


def tried(shown: EditorPage) -> None:
    """All that edits, by mouse and by keys."""
    box = shown.box
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    shown.page.mouse.dblclick(*middle)
    for cage in ("deformed", "inner"):
        start = shown.part("corner", 6, cage)
        with shown.held((start[0] + box["x"], start[1] + box["y"]), (30.0, 10.0)):
            pass
    for key in EDITING_KEYS:
        shown.press(key)
    shown.page.evaluate(
        "for (const each of document.querySelectorAll('.edits li, .history li, .panel button, .panel input'))"
        " { each.click(); each.dispatchEvent(new MouseEvent('dblclick', {bubbles: true})); }"
    )


def test_who_may_look_finds_nothing_that_edits(links: tuple[EditorServer, str]) -> None:
    server, link = links
    with editor_page(link, 1100, 760) as shown:
        shown.ready()
        assert shown.page.inner_text(".mode-badge") == "Read only"
        assert shown.page.get_attribute(".mode-badge", "title") == WORDS
        assert shown.page.locator(".panel :is(button, input, select)").count() > 20
        assert shown.page.locator(".panel :is(button, input, select):enabled").count() == 0
        for name in ("save", "save-as", "load", "tool-translate", "mode-set", "cage-inner", "snap"):
            assert not shown.page.is_visible(f".{name}"), name
        assert shown.page.is_visible(".tools .cages") and shown.page.is_visible(".edits .name")
        before, revision = shown.edits, shown.state["revision"]
        tried(shown)
        assert WORDS in shown.said("may look")
        assert shown.page.locator("dialog[open]").count() == 0
        with page(server) as (client, _):
            assert client.joined["revision"] == revision and not client.joined["saved"]
            assert [edit["name"] for edit in client.joined["edits"]] == ["ball"]
        assert shown.edits == before
        shown.page.click(".split")
        shown.page.click("[data-view=depth]")
        shown.until("cagefield.now.view === 'depth' && cagefield.now.split !== null")
        shown.settle()


def test_the_other_link_edits(links: tuple[EditorServer, str]) -> None:
    server, _ = links
    with editor_page(server.link, 1100, 760) as shown:
        shown.ready()
        assert shown.page.inner_text(".mode-badge") == "Edit field"
        assert shown.page.is_visible(".save") and shown.page.is_enabled(".panel .add")
        before = len(shown.edits)
        shown.changed(lambda: shown.press("Control+d"))
        assert len(shown.edits) == before + 1
        shown.changed(lambda: shown.press("Control+z"))
