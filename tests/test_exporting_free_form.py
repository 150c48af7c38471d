"""Lattices, control points and mesh cages that move along the camera path of an exported page."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.keyframes import Keyframe, Timeline
from cagefield.edits import Continuous, Edit, EditStack
from cagefield.edits.partial_edit import partial_edit
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.images.metrics import psnr
from cagefield.pages.scene_page import ScenePage
from cagefield.scene.scene import Scene
from exported_page import pixels, rendered, settle, shown, until
from page_fields import SIZE, lumps_scene
from test_exporting_splats import splats_scene
from tiers import nightly_after_first

pytestmark = pytest.mark.nightly

FREE_FORM: tuple[Continuous, ...] = (
    Edit.continuous(
        Cage.box((-0.4, 0, 0), (0.7, 0.7, 1.0)).subdivided((1, 1, 3)),
        Cage.box((-0.4, 0, 0), (1.9, 1.9, 1.9)),
        name="lattice",
    )
    .bend("z", 0.7)
    .move_points((0, 1, 2, 3), (0.1, 0.0, 0.0)),
    Edit.points([(0.5, 0.2, 0.1), (0.3, -0.4, 0.0)], radius=0.6, name="points").move_point(0, (0.2, 0, 0.15)),
    Edit.continuous(
        MeshCage.of_box(Cage.box((0.4, 0, 0), (0.6, 0.7, 0.8))),
        Cage.box((0.4, 0, 0), (1.6, 1.6, 1.6)),
        name="mesh",
    )
    .twist("z", 0.6)
    .move_point(7, (0.1, 0.1, 0.1)),
)


def scene_of(kind: str) -> Scene:
    edits = [edit.replace(relight="none", lattice=32) for edit in FREE_FORM]
    if kind == "splats":
        return splats_scene(*edits)
    return dataclasses.replace(lumps_scene(), edits=EditStack(edits))


# Splats change their shape on the way too, by chords of it; they are drawn one by one.
@pytest.mark.parametrize(("kind", "least"), nightly_after_first([("voxels", 36.0), ("splats", 34.0)]))
def test_free_form_edits_move_along_the_camera_path(kind: str, least: float, tmp_path: Path) -> None:
    scene = scene_of(kind)
    camera = scene.cameras["test"][0]
    pose = tuple(camera.c2w.ravel())
    keys = (
        Keyframe(pose, 45.0, 0.5, {1: 0.0, 2: 0.0, 3: 0.0}),
        Keyframe(pose, 45.0, 0.25, {1: 1.0, 2: 0.3, 3: 0.5}),
        Keyframe(pose, 45.0, 1.0, {1: 1.0, 2: 1.0, 3: 1.0}),
    )
    page_of = ScenePage.build(scene, kind, keys)
    assert page_of.along is not None and 5 < page_of.along.states <= 10
    assert 0.0 < page_of.along.error[0] < 5e-3
    file = tmp_path / "scene.html"
    file.write_text(page_of.one_file(), encoding="utf-8")
    line = Timeline(keys, loop=False)
    focal = 0.5 * SIZE / np.tan(np.radians(22.5))
    seen = dataclasses.replace(camera, fx=focal, fy=focal)
    with shown(file) as page:
        until(page, "cagefieldViewer.viewer.canPlay")
        pictures = []
        for seconds in (0.23, 0.75):
            page.evaluate(f"cagefieldViewer.viewer.seek(cagefieldViewer.viewer.header.path, {seconds})")
            settle(page)
            parts = line.parts(np.array([seconds]))
            there = [partial_edit(edit, float(parts[n][0])) for n, edit in enumerate(scene.edits, start=1)]
            stack = EditStack([edit for edit in there if edit is not None])
            pictures.append(rendered(dataclasses.replace(scene, edits=stack), seen))
            assert psnr(pixels(page), pictures[-1]) >= least, seconds
        page.press("body", "h")
        settle(page)
        assert psnr(pixels(page), rendered(scene, camera)) >= 40.0
    for one, other in itertools.pairwise(pictures):
        assert psnr(one, other) < 32.0
