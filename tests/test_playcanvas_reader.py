"""Streamed SOG as it is written, opened by PlayCanvas' engine in Chromium: its picture against a .ply's.

The engine (`playcanvas`) is an independent reader of lod-meta.json; it loads the levels its camera needs.
"""

from __future__ import annotations

import dataclasses
import io
import os
import shutil
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.splat_spark import served
from PIL import Image

from cagefield.formats.splats import sog_lod_writer
from cagefield.formats.splats.splat_files import write_splats
from cagefield.images.metrics import psnr
from chromium import chromium_context
from splat_scenes import random_splats

pytestmark = pytest.mark.nightly

SIZE = 96
PAGE = """<canvas id="c" width="SIZE" height="SIZE" style="width: SIZEpx; height: SIZEpx"></canvas>
<script type="module">
import * as pc from "./playcanvas.mjs";
const canvas = document.getElementById("c");
const options = new pc.AppOptions();
options.graphicsDevice = await pc.createGraphicsDevice(canvas, { deviceTypes: ["webgl2"], antialias: false });
options.componentSystems = [pc.CameraComponentSystem, pc.GSplatComponentSystem];
options.resourceHandlers = [pc.TextureHandler, pc.GSplatHandler];
const app = new pc.AppBase(canvas);
app.init(options);
app.start();
const asset = new pc.Asset("s", "gsplat", { url: new URLSearchParams(location.search).get("file") });
app.assets.add(asset);
await new Promise((done) => { asset.ready(done); app.assets.load(asset); });
const splats = new pc.Entity();
splats.addComponent("gsplat", { asset, unified: true });
app.root.addChild(splats);
const camera = new pc.Entity();
camera.addComponent("camera", { clearColor: new pc.Color(1, 1, 1), fov: 40, nearClip: 0.05 });
app.root.addChild(camera);
camera.setPosition(1.5, 1, 3.5);
camera.lookAt(new pc.Vec3(0, 0, 0));
window.octree = asset.resource.octree ?? null;
window.frames = 0;
app.on("frameend", () => { window.frames += 1; window.shot = canvas.toDataURL(); });
</script>
""".replace("SIZE", str(SIZE))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str, Any]]:
    """(folder of a web site with the engine, its address, a page of Chromium)."""
    engine = Path(os.environ.get("CAGEFIELD_PLAYCANVAS_MODULES", "")) / "playcanvas/build/playcanvas.mjs"
    if not engine.is_file():
        pytest.skip("no engine in $CAGEFIELD_PLAYCANVAS_MODULES: `npm install playcanvas` in a folder")
    root = tmp_path_factory.mktemp("playcanvas")
    shutil.copyfile(engine, root / "playcanvas.mjs")
    (root / "index.html").write_text(PAGE)
    with chromium_context(viewport={"width": SIZE, "height": SIZE}) as context, served(root) as address:
        yield root, address, context.new_page()


def picture(page: Any, address: str, file: str) -> np.ndarray:
    """Picture [SIZE,SIZE,3] of a file once no more comes."""
    page.goto(f"{address}/index.html?file={file}")
    page.wait_for_function("window.frames > 5", timeout=120_000)
    before = None
    while True:
        page.wait_for_load_state("networkidle")
        seen = page.evaluate("window.frames")
        page.wait_for_function(f"window.frames > {seen + 5}", timeout=120_000)
        shot = page.evaluate("window.shot")
        if shot == before:
            return np.asarray(Image.open(io.BytesIO(b64decode(shot.split(",")[1]))).convert("RGB"))
        before = shot


def test_the_engine_shows_the_finest_level(
    site: tuple[Path, str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("LEAF_SPLATS", 30), ("FILE_SPLATS", 60), ("COARSE_SPLATS", 20)):
        monkeypatch.setattr(sog_lod_writer, name, value)
    root, address, page = site
    field = random_splats(150, degree=2)
    field = dataclasses.replace(field, sh=0.3 * field.sh)
    write_splats(field, root / "all.ply")
    write_splats(field, root / "levels" / "lod-meta.json")
    levels = picture(page, address, "levels/lod-meta.json")
    assert page.evaluate("[octree.lodLevels, octree.nodes.length]") == [3, 8]
    whole = picture(page, address, "all.ply")
    assert whole.std() > 20.0  # splats are seen
    assert psnr(levels, whole) > 36.0
