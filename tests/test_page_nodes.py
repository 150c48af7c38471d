"""Levels of detail of pages: nodes and their parents in files, and in Chromium never both of one."""

from __future__ import annotations

import dataclasses
import math
import threading
from pathlib import Path

import numpy as np
import pytest

from cagefield import Scene
from cagefield.cameras.camera import Camera
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.images.metrics import psnr
from cagefield.pages.page_file import unpack
from cagefield.pages.page_nodes import encode_page_nodes, node_rows
from cagefield.pages.page_splats import MAGIC, VERSION, decode_page_splats
from cagefield.pages.scene_page import INDEX, ScenePage, write_folder
from commands import printed, refused
from exported_page import pixels, rendered, settle, shown, until, web_server
from splat_scenes import ball_of_splats

COARSE, NODE = 240, 500
SIZE = 120
"""Pixels of a side: enough to tell a node from its parent."""
COLUMNS = ("means", "log_scales", "quaternions", "opacities", "sh")


def scene_of_splats() -> Scene:
    camera = Camera.look_at((2.2, -1.6, 1.2), (0, 0, 0), (0, 0, 1), width=SIZE, height=SIZE, fov_x=0.7)
    return Scene(ball_of_splats(2000), cameras={"test": (camera,)})


def joined(fields: list[SplatField]) -> SplatField:
    arrays = {name: np.concatenate([getattr(field, name) for field in fields]) for name in COLUMNS}
    return dataclasses.replace(fields[0], **arrays)


def test_nodes_hold_every_splat_once_and_parents_lie_in_them() -> None:
    field = scene_of_splats().field
    assert isinstance(field, SplatField)
    rows = node_rows(field, NODE)
    assert sorted(np.concatenate(rows)) == list(range(len(field))) and max(map(len, rows)) <= NODE
    files = encode_page_nodes(field, coarse=COARSE, node=NODE)
    header, _ = unpack(files.coarse, MAGIC, VERSION, "splats")
    entries = header["nodes"]
    parents = decode_page_splats(files.coarse).field
    assert len(entries) == len(files.nodes) == 4 and len(parents) == COARSE
    assert header["count"] == COARSE + len(field)
    ends = [entry["coarse"] for entry in entries]
    assert [first for first, _ in ends] == [0, *(end for _, end in ends[:-1])] and ends[-1][1] == COARSE
    found = [decode_page_splats(data).field for data in files.nodes.values()]
    assert [len(node) for node in found] == [entry["count"] for entry in entries]
    # A node's file tells its splats as exactly as the file without levels tells them.
    for node, own, entry in zip(found, rows, entries, strict=True):
        reach = np.abs(node.means - field.means[own]).max()
        assert reach < 2e-4 and entry["url"].split("?")[0] in files.nodes
        np.testing.assert_allclose(node.opacities, field.opacities[own], atol=1e-3)
        low, high = np.array(entry["bounds"])
        inside = parents.means[slice(*entry["coarse"])]
        assert (inside >= low - 0.05).all() and (inside <= high + 0.05).all()


def test_a_page_draws_a_node_or_its_parent(tmp_path: Path) -> None:
    """Coarse, with one node, and whole: the images of exactly these splats, at every stage."""
    scene = scene_of_splats()
    field = scene.field
    assert isinstance(field, SplatField)
    files = encode_page_nodes(field, background=scene.background, coarse=COARSE, node=NODE)
    header, _ = unpack(files.coarse, MAGIC, VERSION, "splats")
    plain = ScenePage.build(scene, "levels")
    page = dataclasses.replace(plain, files={"field": files.coarse}, nodes=files.nodes)
    with pytest.raises(CagefieldError, match="write a folder"):
        page.one_file()
    write_folder(tmp_path, page.folder())
    camera = scene.first_camera
    middles = [np.mean(entry["bounds"], axis=0) for entry in header["nodes"]]
    radii = [0.5 * np.linalg.norm(np.subtract(*entry["bounds"])) for entry in header["nodes"]]
    sizes = [r / (np.linalg.norm(m - camera.origin) - r) for m, r in zip(middles, radii, strict=True)]
    nearest = int(np.argmax(sizes))
    names = list(files.nodes)
    parents = decode_page_splats(files.coarse).field
    found = [decode_page_splats(data).field for data in files.nodes.values()]
    parts = [
        dataclasses.replace(
            parents, **{name: getattr(parents, name)[slice(*e["coarse"])] for name in COLUMNS}
        )
        for e in header["nodes"]
    ]
    coarse = rendered(Scene(parents, background=scene.background), camera)
    one = rendered(
        Scene(
            joined([found[n] if n == nearest else part for n, part in enumerate(parts)]),
            background=scene.background,
        ),
        camera,
    )
    whole = rendered(scene, camera)
    assert max(psnr(coarse, one), psnr(one, whole), psnr(coarse, whole)) < 40.0
    first, second = threading.Event(), threading.Event()
    # The nodes wait for the events; all but the nearest one for the second.
    with (
        web_server(tmp_path, dict.fromkeys(names, 8), first, {names[nearest]: first}, second) as link,
        shown(f"{link}/{INDEX}", size=SIZE) as tab,
    ):
        settle(tab, "level")
        assert psnr(pixels(tab), coarse) >= 45.0
        first.set()
        until(tab, "cagefieldViewer.viewer.renderer.count > 500")
        settle(tab, "level")
        assert psnr(pixels(tab), one) >= 45.0
        second.set()
        settle(tab)
        assert psnr(pixels(tab), whole) >= 45.0
        assert tab.evaluate("cagefieldViewer.viewer.renderer.count") == COARSE + len(field)
        # The GPU's context is lost and restored: parents stay hidden.
        tab.evaluate(
            """window.lost = document.querySelector("canvas").getContext("webgl2")
                .getExtension("WEBGL_lose_context"); window.lost.loseContext()"""
        )
        tab.evaluate("new Promise(done => setTimeout(() => { window.lost.restoreContext(); done() }, 100))")
        until(tab, "cagefieldViewer.viewer.renderer.count === 2240")
        settle(tab)
        assert psnr(pixels(tab), whole) >= 45.0


def test_nodes_out_of_sight_give_way(tmp_path: Path) -> None:
    """Two balls far apart, room for one of them: each is whole when it is seen."""
    ball = ball_of_splats(1000)
    field = joined([ball, dataclasses.replace(ball, means=ball.means + np.float32([40, 0, 0]))])
    views = [
        Camera.look_at((x, -4.0, 0.4), (x, 0, 0), (0, 0, 1), width=SIZE, height=SIZE, fov_x=0.7)
        for x in (0.0, 40.0)
    ]
    scene = dataclasses.replace(scene_of_splats(), field=field, cameras={"test": (views[0],)})
    with pytest.raises(CagefieldError, match="the budget is 739 splats; give 740 at least"):
        encode_page_nodes(field, coarse=COARSE, node=NODE, budget=739)
    files = encode_page_nodes(
        field, background=scene.background, coarse=COARSE, node=NODE, budget=COARSE + 2 * NODE
    )
    header, _ = unpack(files.coarse, MAGIC, VERSION, "splats")
    assert sorted(entry["bounds"][0][0] > 20.0 for entry in header["nodes"]) == [False] * 2 + [True] * 2
    page = dataclasses.replace(
        ScenePage.build(scene, "levels"), files={"field": files.coarse}, nodes=files.nodes
    )
    write_folder(tmp_path, page.folder())
    whole = [rendered(scene, view) for view in views]
    with web_server(tmp_path, {}, threading.Event()) as link, shown(f"{link}/{INDEX}", size=SIZE) as tab:
        tab.emulate_media(reduced_motion="reduce")
        settle(tab)
        assert psnr(pixels(tab), whole[0]) >= 45.0
        for number in (1, 0):
            view = {"c2w": views[number].c2w.ravel().tolist(), "fov_y_deg": math.degrees(0.7)}
            fly = "([view, at]) => cagefieldViewer.viewer.flyTo(view, at)"
            tab.evaluate(fly, [view, [40.0 * number, 0, 0]])
            until(tab, "!cagefieldViewer.viewer.flies")
            close = -1.0
            for _ in range(100):  # details arrive after the first complete picture
                settle(tab)
                close = psnr(pixels(tab), whole[number])
                if close >= 45.0:
                    break
                tab.wait_for_timeout(100)
            assert close >= 45.0
            assert tab.evaluate("cagefieldViewer.viewer.renderer.count") <= COARSE + 2 * NODE


def test_the_command_says_where_levels_belong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene_of_splats().save(tmp_path / "scene")
    export = ["export", str(tmp_path / "scene"), "-o"]
    assert "give --embed" in refused(capsys, *export, str(tmp_path / "a.html"), "--levels")
    assert "give --embed" in refused(capsys, *export, str(tmp_path / "a.ply"), "--levels")
    assert "give --levels, too" in refused(capsys, *export, str(tmp_path / "s"), "--embed", "--budget", "9")
    small = refused(capsys, *export, str(tmp_path / "site"), "--embed", "--levels")
    assert "the scene has 2000 splats and a coarse level" in small
    assert "a page of" in printed(capsys, *export, str(tmp_path / "site"), "--embed")
