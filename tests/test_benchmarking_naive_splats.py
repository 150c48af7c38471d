"""Naive editing of splats: each way lacks what its name says, and nothing else."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from benchmarks.common.cases import CASES
from benchmarks.common.figures import Figures
from benchmarks.common.workbench import Settings
from benchmarks.edits.edits_table import Score, table
from benchmarks.edits.naive_splats import NAIVE, naive_splats, seen_naively

from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.raster_splats import deformed_splats
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.scene.scene import Scene
from cagefield.training.splats.splat_config import SplatConfig
from splat_scenes import random_splats

INNER = Cage.box((0, 0, 0), 0.9)
CAMERA = Camera.look_at((2.6, -1.9, 1.4), (0, 0, 0), width=48, height=40, fov_x=0.75)
EDITS = {
    "turn": Edit.continuous(INNER, INNER.grown(0.3)).rotate((0.2, 0.4, 1.0)),
    "copy": Edit.copy(INNER).rotate((0, 0, 0.7)).translate((1, 0, 0)),
    "delete": Edit.delete(INNER),
}


@pytest.mark.nightly
@pytest.mark.parametrize("name", EDITS)
def test_each_way_lacks_what_its_name_says(name: str) -> None:
    field, edits = random_splats(300, degree=2), EditStack([EDITS[name]])
    whole = deformed_splats(field, edits)
    ways = dict(naive_splats(field, edits))
    assert tuple(ways) == NAIVE
    for splats in ways.values():
        for part in ("means", "opacities", "sh"):
            assert np.array_equal(getattr(splats, part), getattr(whole, part))
    assert np.array_equal(ways["no turned SH"].covariances, whole.covariances)
    assert ways["means only"].rotations is None and ways["no turned SH"].rotations is None
    assert (ways["not split"].rotations is None) == (name == "delete")
    # Every splat has the covariance of one of the field's, and where it moved, not the one it should have.
    own = {row.tobytes() for row in deformed_splats(field, EditStack()).covariances}
    assert all(row.tobytes() in own for row in ways["means only"].covariances)
    assert np.array_equal(ways["means only"].covariances, whole.covariances) == (name == "delete")


@pytest.mark.nightly
def test_pictures_are_those_of_the_scene_where_nothing_is_bent_cut_or_turned() -> None:
    field = random_splats(200, degree=2)
    cage = Cage.box((0, 0, 0), 50.0)
    scene = Scene(field=field, edits=EditStack([Edit.move(cage).translate((0.2, 0, 0))]))
    want = np.clip(SplatRenderer(field, scene.edits).render(CAMERA, background="white").rgb, 0.0, 1.0)
    for _, pictures in seen_naively(scene, [CAMERA]):
        np.testing.assert_allclose(pictures[0], want, atol=1e-6)
    turned = dataclasses.replace(scene, edits=EditStack([EDITS["turn"]]))
    seen = {name: pictures[0] for name, pictures in seen_naively(turned, [CAMERA])}
    # Each simplification shows.
    assert np.abs(seen["means only"] - seen["no turned SH"]).max() > 0.02
    assert np.abs(seen["no turned SH"] - seen["not split"]).max() > 0.02


def test_the_table_has_a_column_for_each_way() -> None:
    figures = Figures(20.0, 19.9, 0.9, 0.9, 20.0, 19.9, 10.0, 0.1)
    score = Score(CASES[0], "photos", 1, 16, figures, 1.0, naive=(3.0, 2.0, 1.0))
    text = table([score], Settings(config=SplatConfig(steps=70))).markdown()
    assert "| lost, means only | lost, no turned SH | lost, not split |" in text
    assert "| 3.00 | 2.00 | 1.00 |" in text
    assert "means only: 3.00, no turned SH: 2.00, not split: 1.00" in text
