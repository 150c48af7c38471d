"""Exported edited splats, opened by Spark in Chromium: its pictures against those of the edited scene.

Spark (`@sparkjsdev/spark`, on three.js) is an independent reader and renderer.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.splat_spark import Spark, alike, served

from cagefield import Cage, Edit, EditStack, Scene
from cagefield.cameras.camera import Camera
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats
from cagefield.images.metrics import psnr
from chromium import chromium_context
from commands import printed
from splat_scenes import random_splats

pytestmark = pytest.mark.nightly

SIZE = 96
INNER = Cage.box((0.2, 0.0, 0.0), (0.9, 0.8, 1.0))
TURNED = Edit.continuous(INNER, INNER.grown(0.5)).rotate((0.2, 0.1, 0.9)).translate((0.1, 0.0, 0.05))
CAMERAS = tuple(
    Camera.look_at(eye, (0, 0, 0), (0, 0, 1), width=SIZE, height=SIZE, fov_x=0.7)
    for eye in ((2.6, -1.9, 1.4), (-3.2, 0.7, -1.0))
)
TO_FILE = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)
"""From the scene's axes, z up, to those of a file of splats, y down."""


@pytest.fixture(scope="module")
def modules() -> Path:
    """Folder of the npm packages `three` and `@sparkjsdev/spark`."""
    beside = Path(__file__).resolve().parents[1] / "web" / "node_modules"
    found = Path(os.environ.get("CAGEFIELD_SPARK_MODULES", beside))
    if not (found / "@sparkjsdev" / "spark").is_dir():
        pytest.skip(
            "no Spark in $CAGEFIELD_SPARK_MODULES or web/node_modules: "
            "`npm install @sparkjsdev/spark@2.2.0 three@0.180` in a folder"
        )
    return found


@pytest.fixture(scope="module")
def spark(modules: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Spark]:
    root = tmp_path_factory.mktemp("spark")
    with chromium_context(viewport={"width": SIZE, "height": SIZE}) as context, served(root) as address:
        yield Spark(root, modules, address, context.new_page())


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Splats of all shapes and colors, turned by a continuous edit in their middle.

    No color is outside of [0, 1], where renderers differ in what they cut off.
    """
    field = random_splats(80, degree=2)
    field = dataclasses.replace(field, sh=0.3 * field.sh)
    return Scene(field, EditStack([TURNED]), {"test": CAMERAS})


def drawn(scene: Scene, camera: Camera) -> Any:
    return scene.render(camera, background="white").rgb


# Spark blends 8,500 splats, many of them faint, in 8 bits; .spz rounds more. Without the edit: 18 to 20 dB.
@pytest.mark.parametrize(("ending", "least"), [(".spz", 33.0), (".ply", 35.0), (".sog", 35.0)])
def test_spark_shows_the_edited_scene(
    spark: Spark, scene: Scene, capsys: pytest.CaptureFixture[str], ending: str, least: float
) -> None:
    scene.save(spark.root / f"scene{ending}")
    file = spark.root / f"edited{ending}"
    printed(capsys, "export", spark.root / f"scene{ending}", "-o", file)
    views = [camera.with_c2w(TO_FILE @ camera.c2w) for camera in CAMERAS]
    field = read_splats(file)
    assert isinstance(field, SplatField)
    pictures = spark.pictures(file, views, alike(field))
    assert pictures is not None, "Spark does not read the file"
    unedited = scene.with_edits(EditStack())
    for camera, (on_white, _) in zip(CAMERAS, pictures, strict=True):
        found = psnr(on_white, drawn(scene, camera))
        assert found > least > psnr(on_white, drawn(unedited, camera)) + 5.0
