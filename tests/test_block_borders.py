"""Edits across the borders of blocks: those of the same splats trained as one set."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cagefield import Cage, Edit, EditStack, Scene
from cagefield.cli import main
from cagefield.exporting import edited_splats
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats
from cagefield.training.splats.blocks import Block, merge, partition
from splat_scenes import ball_of_splats, splat_scene
from tiers import nightly_after_first

INNER = Cage.box((0.05, 0.1, 0.0), (0.6, 0.7, 1.2))
EDITS = {
    "bent": Edit.continuous(INNER, INNER.grown(0.5)).rotate((0.2, 0.0, 0.7)).scale((1.4, 1.0, 0.8)),
    "moved": Edit.move(INNER, fill="none").rotate((0.0, 0.4, 0.0)).translate((0.3, 0.0, 0.1)),
    "graded": Edit.continuous(INNER, INNER.grown(0.5)).translate((0.1, 0.0, 0.2)).grade(exposure=0.4),
}


def sorted_rows(field: SplatField) -> np.ndarray:
    """Splats [N,F] in the order of their values."""
    columns = (field.means, field.log_scales, field.quaternions, field.opacities[:, None])
    rows = np.concatenate([*columns, field.sh.reshape(len(field), -1)], axis=1)
    return rows[np.lexsort(rows.T)]


@pytest.fixture(scope="module")
def scenes() -> tuple[Scene, Scene]:
    """A ball as one set of splats, and merged from four blocks whose borders cross the cages."""
    ball = ball_of_splats()
    cells = partition(ball.means, 4)
    blocks = [Block(cell, cell, (), np.arange(0), 0, 0, np.zeros((1, 3)), 0.499) for cell in cells]
    away = dataclasses.replace(ball, means=ball.means + np.float32(9.0), bounds=ball.bounds)
    near = dataclasses.replace(ball, means=0.99 * ball.means, bounds=ball.bounds)
    inside = INNER.contains(near.means.astype(np.float64))
    assert all(0 < (inside & block.contains(near.means)).sum() < inside.sum() for block in blocks)
    merged = merge(blocks, [block.own(near) for block in blocks], away)
    one = dataclasses.replace(
        near,
        **{
            name: np.concatenate([getattr(near, name), getattr(away, name)])
            for name in ("means", "log_scales", "quaternions", "opacities", "sh")
        },
    )
    assert (merged.means != one.means).any()
    np.testing.assert_array_equal(sorted_rows(merged), sorted_rows(one))
    scene = splat_scene()
    return dataclasses.replace(scene, field=one), dataclasses.replace(scene, field=merged)


@pytest.mark.parametrize("name", EDITS)
def test_pictures_of_an_edit_across_borders(scenes: tuple[Scene, Scene], name: str) -> None:
    camera = scenes[0].cameras["test"][0].resized(96, 64)
    plain, one, merged = (
        scene.with_edits(EditStack(edits)).render(camera)
        for scene, edits in ((scenes[0], []), (scenes[0], [EDITS[name]]), (scenes[1], [EDITS[name]]))
    )
    assert np.abs(one.rgb - plain.rgb).max() > 0.2
    # one order of blending: equal but for splats of one depth
    np.testing.assert_allclose(merged.rgb, one.rgb, atol=1e-5)
    np.testing.assert_allclose(merged.opacity, one.opacity, atol=1e-5)


@pytest.mark.parametrize("name", nightly_after_first(EDITS))
def test_exports_of_an_edit_across_borders(scenes: tuple[Scene, Scene], tmp_path: Path, name: str) -> None:
    """Splats of the edited scenes, and of their files, as sets."""
    edited = [scene.with_edits(EditStack([EDITS[name]])) for scene in scenes]
    one, merged = (sorted_rows(edited_splats(scene)) for scene in edited)
    np.testing.assert_array_equal(merged, one)
    files = []
    for number, scene in enumerate(edited):
        scene.save(tmp_path / str(number))
        target = tmp_path / f"{number}.ply"
        assert main(["export", str(tmp_path / str(number)), "-o", str(target)]) == 0
        files.append(sorted_rows(read_splats(target)))
    np.testing.assert_array_equal(files[1], files[0])
