"""`cagefield select` on a red ball of 800 splats over a gray floor of 576."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cagefield.cli import main
from cagefield.edits import Edit, EditStack, load_edits
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from scenes import ball_scene
from splat_scenes import BALL_RADIUS, ball_and_floor


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    Scene(ball_and_floor()).save(tmp_path / "scene")
    return tmp_path / "scene"


def run(capsys: pytest.CaptureFixture[str], *args: object) -> str:
    code = main(["select", *map(str, args)])
    out, err = capsys.readouterr()
    assert code == 0, err
    return out


def refused(capsys: pytest.CaptureFixture[str], *args: object) -> str:
    assert main(["select", *map(str, args)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    return err


def test_a_flood_becomes_a_cage(capsys: pytest.CaptureFixture[str], scene: Path, tmp_path: Path) -> None:
    cage = tmp_path / "cage.yaml"
    text = run(capsys, scene, "--flood", 0, 0, 0.25, "--to-cage", cage, "--margin", 0.02)
    assert "800 of 1376 splats selected" in text and "edit --append" in text
    (edit,) = load_edits(cage)
    np.testing.assert_allclose(edit.inner.center, 0.0, atol=0.02)
    lengths = np.linalg.norm(edit.inner.affine[0], axis=0)
    assert (lengths > 2.0 * BALL_RADIUS).all() and (lengths < 2.5 * BALL_RADIUS).all()
    assert "exists already" in refused(capsys, scene, "--flood", 0, 0, 0, "--to-cage", cage)


def test_the_cage_is_where_edits_show_the_selection(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    moved = Edit.move(Cage.box((0, 0, 0), 0.6), fill="none").translate((0.6, 0, 0))
    Scene(ball_and_floor(), edits=EditStack([moved])).save(tmp_path / "moved")
    run(capsys, tmp_path / "moved", "--flood", 0.6, 0, 0.25, "--to-cage", tmp_path / "cage.yaml")
    (edit,) = load_edits(tmp_path / "cage.yaml")
    np.testing.assert_allclose(edit.inner.center, (0.6, 0, 0), atol=0.02)


def test_criteria_are_met_together(capsys: pytest.CaptureFixture[str], scene: Path) -> None:
    assert "576 of" in run(capsys, scene, "--opacity", 0.85, 1)
    assert "800 of" in run(capsys, scene, "--opacity", 0.85, 1, "--invert")
    assert "0 of" in run(capsys, scene, "--opacity", 0.85, 1, "--red", 0.8, 1)
    assert "800 of" in run(capsys, scene, "--saturation", 0.5, 1, "--value", 0.8, 1)
    grown = run(capsys, scene, "--opacity", 0, 0.85, "--grow", 30)
    assert int(grown.split()[0]) > 800


def test_elements_are_removed(capsys: pytest.CaptureFixture[str], scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "clean"
    assert f"written to {out}" in run(capsys, scene, "--opacity", 0, 0.85, "--remove", "-o", out)
    field = Scene.open(out).field
    assert isinstance(field, SplatField) and len(field) == 576
    assert "exists already" in refused(capsys, scene, "--opacity", 0, 0.85, "--remove", "-o", out)
    assert "leave something" in refused(
        capsys, scene, "--opacity", 0, 1, "--remove", "-o", out, "--overwrite"
    )
    assert len(Scene.open(out).field) == 576  # type: ignore[arg-type]


def test_voxels(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "ball")
    text = run(capsys, tmp_path / "ball", "--flood", 0, 0, 0)
    count, total = (int(text.split()[n]) for n in (0, 2))
    assert count == total > 100 and "cells" in text
    assert "0 of" in run(capsys, tmp_path / "ball", "--floaters", 0.5)


def test_what_cannot_be_is_refused(capsys: pytest.CaptureFixture[str], scene: Path) -> None:
    assert "give --flood X Y Z" in refused(capsys, scene)
    assert "give both --remove and -o" in refused(capsys, scene, "--opacity", 0, 1, "--remove")
    assert "low <= high" in refused(capsys, scene, "--opacity", 1, 0)
    assert "strength of floaters" in refused(capsys, scene, "--floaters", 3)
    assert "0 or more" in refused(capsys, scene, "--opacity", 0, 1, "--grow", -1)
    assert "nothing is selected" in refused(
        capsys, scene, "--opacity", 0, 0.1, "--to-cage", scene.parent / "c.yaml"
    )
