"""Pasting from another scene in the editor, in a real browser against the real server."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from cagefield.cameras.camera import turntable
from cagefield.edits import Edit, EditStack, dump_edits
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from cagefield.server.web.launch import open_scene
from editor_page import EditorPage, asking, editor_page
from editor_server import EditorServer, editor_server
from editor_server import page as client
from scenes import SH_C0, ball_scene
from splat_scenes import splat_scene

pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


def green(scene: Scene) -> Scene:
    """A scene of a ball with a green one."""
    sh = np.zeros_like(scene.field.sh)
    sh[:, 0] = (np.array([0.1, 0.8, 0.2]) - 0.5) / SH_C0
    return dataclasses.replace(scene, field=dataclasses.replace(scene.field, sh=sh))


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with scenes of a red and a green ball, of voxels and of splats."""
    root = tmp_path_factory.mktemp("pastes")
    cameras = {"train": turntable((0, 0, 0), 6.0, 3, elevation=0.3, width=64, height=48, fov_x=0.8)}
    for name, scene in (("red", ball_scene()), ("green", green(ball_scene()))):
        dataclasses.replace(scene, cameras=cameras).save(root / name)
    for name, scene in (("reds", splat_scene()), ("kept/greens", green(splat_scene()))):
        dataclasses.replace(scene, cameras=cameras).save(root / name)
    return root


@pytest.fixture(scope="module")
def server(root: Path) -> Iterator[EditorServer]:
    with editor_server(root / "red") as running:
        yield running


def greens(pixels: NDArray[np.float64]) -> int:
    """Pixels that are green."""
    return int((pixels[..., 1] > pixels[..., 0] + 0.1).sum())


def scaled(server: EditorServer, page: EditorPage, target: str, by: list[float]) -> None:
    """Scales the selected edit from another page."""
    operation = {"kind": "scale", "by": by, "axes": "world"}
    with client(server) as (other, _):
        page.changed(lambda: other.send("apply", edit=page.edit["id"], target=target, operation=operation))


def chosen(page: EditorPage, source: str, offered: list[str]) -> None:
    """Pastes by the dialogue, which offers these sources."""
    page.press("Shift+V")
    page.until("document.querySelector('dialog select[name=source]') !== null")
    select = page.page.locator("dialog select[name=source]")
    assert select.locator("option").all_inner_texts() == offered
    select.select_option(source)
    page.changed(lambda: page.page.click("dialog .primary"))


@pytest.mark.nightly
@pytest.mark.parametrize("render", ["server", "page"])
def test_a_paste_is_shown_moved_cropped_and_undone(server: EditorServer, render: str) -> None:
    with editor_page(asking(server.link, render), 960, 480) as page:
        page.ready()
        bare = greens(page.pixels())
        chosen(page, "green", ["green"])
        edit = page.edit
        assert edit["kind"] == "copy" and edit["name"] == "green" and edit["problem"] is None
        assert edit["source"].endswith("/green") and bare == 0
        whole = greens(page.pixels())
        assert whole > 500
        assert page.page.locator(".edit.chosen .kind").inner_text() == "paste"
        assert page.page.locator(".pane .tp-lblv", has_text="Pasted from").locator("input").input_value() == (
            "green"
        )
        # Half as large, a quarter of the pixels.
        scaled(server, page, "field", [0.5, 0.5, 0.5])
        assert 0.15 * whole < greens(page.pixels()) < 0.4 * whole
        page.changed(lambda: page.press("Control+z"))
        # In Set mode the cage shrinks alone: its content is cut, and stays where it was.
        before = page.pixels()
        page.tools(mode="set", tool="scale")
        scaled(server, page, "inner", [1.0, 1.0, 0.5])
        cut = page.pixels()
        assert 0.3 * whole < greens(cut) < 0.95 * whole
        lost = (before[..., 1] > before[..., 0] + 0.1) & ~(cut[..., 1] > cut[..., 0] + 0.1)
        fresh = ~(before[..., 1] > before[..., 0] + 0.03) & (cut[..., 1] > cut[..., 0] + 0.1)
        assert lost.sum() > 100 and fresh.sum() < 0.01 * whole + 20
        page.changed(lambda: page.press("Control+z"))
        page.tools(mode="edit", tool="translate")
        page.changed(lambda: page.press("Control+z"))
        assert page.state["edits"] == [] and greens(page.pixels()) == 0


@pytest.mark.nightly
def test_pastes_are_saved_as_their_scene_sees_them(root: Path, server: EditorServer) -> None:
    with editor_page(asking(server.link, "server"), 640, 460) as page:
        page.ready()
        chosen(page, "green", ["green"])
        page.changed(lambda: page.press("Control+s"))
        saved = yaml.safe_load((root / "red" / "edits.yaml").read_text())["edits"]
        assert [edit["source"] for edit in saved] == ["../green"]
        with server.get("/edits.yaml") as answer:
            assert yaml.safe_load(answer.read())["edits"] == saved
        # Text from elsewhere may paste, but not from outside of the root.
        outside = root.parent / "secret"
        ball_scene().save(outside)
        with client(server) as (other, _):
            for source in ("../../secret", str(outside)):
                text = f"- {{source: {source}, inner: {{center: [0, 0, 0], size: 1}}}}"
                other.send("load_edits", text=text, append=True)
                assert "lies outside" in other.notice()["text"]
            for source, problem in (("../secret", "lies outside"), ("reds", "cagefield bake")):
                other.send("paste_scene", source=source)
                assert problem in other.notice()["text"]
        assert len(page.state["edits"]) == 1
        page.changed(lambda: page.press("Delete"))
        page.changed(lambda: page.press("Control+s"))


def test_a_scene_whose_paste_is_gone_opens_and_says_so(root: Path, tmp_path: Path) -> None:
    """What is left is drawn; with the scene back in its place, so is the paste."""
    scene = Scene.open(root / "red")
    edit = scene.paste(root / "green").replace(source="../lost")
    gone = Edit.delete(Cage.box((0.0, 0.0, 0.6), (2.0, 2.0, 0.8)))
    dataclasses.replace(scene, folder=None).with_edits(EditStack()).save(tmp_path / "torn")
    (tmp_path / "torn" / "edits.yaml").write_text(dump_edits(EditStack([gone, edit])))
    for there in (False, True):
        if there:
            Scene.open(root / "green").save(tmp_path / "lost")
        coordinator, _ = open_scene(tmp_path / "torn")
        first, second = (entry.edit for entry in coordinator.session.document.entries)
        drawn = coordinator.session.drawn()
        problem = coordinator.session.problem(second)
        coordinator.store.close()
        assert drawn == ((first, second) if there else (first,))
        assert there == (problem is None) and (there or "is gone" in str(problem))


@pytest.mark.nightly
def test_splats_are_pasted_into_splats(root: Path) -> None:
    """By the server, also for a page that draws what else there is."""
    with (
        editor_server(root / "reds") as running,
        editor_page(asking(running.link, "page"), 960, 480) as page,
    ):
        page.ready()
        chosen(page, "kept/greens", ["kept/greens"])
        assert greens(page.pixels()) > 500
        page.changed(lambda: page.press("Control+z"))
        assert greens(page.pixels()) == 0
