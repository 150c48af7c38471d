"""Hotspots whose texts are scripts, in exported pages in Chromium: texts are shown, nothing runs."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest
from benchmarks.splat_spark import served

from cagefield import Hotspot, Scene
from cagefield.cameras.camera import Camera
from cagefield.errors import SceneError
from cagefield.pages.scene_page import INDEX, ScenePage, write_folder
from cagefield.scene.hotspots import MAX_TITLE_CHARACTERS
from exported_page import shown, until
from splat_scenes import ball_of_splats

pytestmark = pytest.mark.nightly

TEXTS = (
    "</script><script>window.taken = 1</script>",
    "<!--<script>window.taken = 1</script>-->",
    "<!--<script><!--</script><img src=x onerror=window.taken=1>",
    '"><img src=x onerror="window.taken = 1">',
    "'-(window.taken = 1)-'",
    "`${window.taken = 1}`",
    "\\u003cscript\\u003ewindow.taken=1\\u003c/script\\u003e\\",
    "<svg/onload=window.taken=1>",
    "<svg><animate onbegin=window.taken=1 attributeName=x dur=1s>",
    "<iframe srcdoc='<script>parent.taken=1</script>'></iframe>",
    "<a href=javascript:window.taken=1 autofocus onfocus=window.taken=1>a</a>",
    "javascript:window.taken=1//",
    "</textarea></title></style><script>window.taken=1</script>",
    '<noscript><p title="</noscript><img src=x onerror=window.taken=1>">',
    "<math><mtext><table><mglyph><style></math><img src onerror=window.taken=1>",
    "<style>@import url(http://localhost:1/x.css); body { display: none }</style>",
    "<base href=http://localhost:1/><link rel=stylesheet href=x.css>",
    "<meta http-equiv=refresh content='0;url=http://localhost:1/'>",
    "<form action=http://localhost:1/><button autofocus>send</button></form>",
    "\u2028window.taken=1\u2029//\u202e\ufeff",
    "]]>&lt;script&gt;window.taken=1&lt;/script&gt;&#60;img src=x onerror=window.taken=1&#62;",
    '{"__proto__": {"taken": 1}}',
)
SCRIPTS = "[...document.querySelectorAll('script, iframe, img, svg, link, base, meta, form, style')].length"
RAN = "window.taken !== undefined || ({}).taken !== undefined"


def scene_of(texts: tuple[str, ...]) -> Scene:
    """A ball whose hotspots have each of the texts as their title and as their text."""
    first = Camera.look_at((0, -3, 0), (0, 0, 0), (0, 0, 1), width=64, height=64, fov_x=0.8)
    hotspots = tuple(
        Hotspot(text[:MAX_TITLE_CHARACTERS], (0.0, -0.5, 0.02 * n), text) for n, text in enumerate(texts)
    )
    return Scene(ball_of_splats(100), cameras={"test": (first,)}, hotspots=hotspots)


def look(page: Any, texts: tuple[str, ...], elements: int) -> None:
    """Opens each card: its texts are the hotspot's, no element is new, and no script ran."""
    page.emulate_media(reduced_motion="reduce")
    marks = page.evaluate("[...document.querySelectorAll('.hotspots button')].map(mark => mark.title)")
    for n, text in enumerate(texts):
        assert marks[n] == text[:MAX_TITLE_CHARACTERS]
        page.evaluate(f"cagefieldViewer.hotspots.open({n})")
        shown_texts = page.evaluate(
            "[...document.querySelectorAll('.card h2, .card p')].map(e => e.textContent)"
        )
        assert shown_texts == [text[:MAX_TITLE_CHARACTERS], text]
        assert page.evaluate(SCRIPTS) == elements
        assert not page.evaluate(RAN), text


def elements_of(page: Any) -> int:
    count: int = page.evaluate(SCRIPTS)
    return count


@pytest.mark.parametrize("kind", ["one file", "a folder"])
def test_no_script_of_a_hotspot_runs_in_an_exported_page(tmp_path: Path, kind: str) -> None:
    plain = tmp_path / "plain.html"
    plain.write_text(ScenePage.build(scene_of(("a",)), "plain").one_file(), encoding="utf-8")
    page_of_texts = ScenePage.build(scene_of(TEXTS), TEXTS[0])
    if kind == "one file":
        with shown(plain, size=64) as page:
            elements = elements_of(page)
        (tmp_path / "hostile.html").write_text(page_of_texts.one_file(), encoding="utf-8")
        with shown(tmp_path / "hostile.html", size=64) as page:
            look(page, TEXTS, elements)
        return
    write_folder(tmp_path / "plain", ScenePage.build(scene_of(("a",)), "plain").folder())
    write_folder(tmp_path / "hostile", page_of_texts.folder())
    with served(tmp_path) as address:
        with shown(f"{address}/plain/{INDEX}", size=64) as page:
            until(page, "window.cagefieldViewer?.viewer?.whole")
            elements = elements_of(page)
        with shown(f"{address}/hostile/{INDEX}", size=64) as page:
            until(page, "window.cagefieldViewer?.viewer?.whole")
            look(page, TEXTS, elements)


def test_texts_of_a_manifest_of_others_stay_texts(tmp_path: Path) -> None:
    """A scene.json from elsewhere: markup in titles, texts and names passes through files unchanged."""
    scene = scene_of(TEXTS)
    scene.save(tmp_path / "scene")
    manifest = json.loads((tmp_path / "scene" / "scene.json").read_text(encoding="utf-8"))
    (tmp_path / "scene" / "scene.json").write_text(json.dumps(manifest), encoding="utf-8")
    assert Scene.open(tmp_path / "scene").hotspots == scene.hotspots
    for control in "\0\x1b\x7f\x85":
        with pytest.raises(SceneError, match="holds a control character"):
            Hotspot(f"a{control}b", (0.0, 0.0, 0.0))
    other = dataclasses.replace(scene, hotspots=Scene.open(tmp_path / "scene").hotspots)
    text = ScenePage.build(other, TEXTS[0]).one_file()
    assert "window.taken" in text
    for raw in TEXTS[:3]:
        assert raw not in text  # escaped inside of the page's own script
