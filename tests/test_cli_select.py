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
from cagefield.selection.field_elements import elements_of_field
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


def info(capsys: pytest.CaptureFixture[str], scene: Path) -> str:
    assert main(["info", str(scene)]) == 0
    return capsys.readouterr().out


def test_elements_are_removed_and_restored(
    capsys: pytest.CaptureFixture[str], scene: Path, tmp_path: Path
) -> None:
    out = tmp_path / "clean"
    assert "deleted " not in info(capsys, scene)
    assert f"800 of 1376 deleted written to {out}" in run(
        capsys, scene, "--opacity", 0, 0.85, "--remove", "-o", out
    )
    field = Scene.open(out).field
    assert isinstance(field, SplatField) and len(field) == 576
    assert "deleted     800 of 1376 splats" in info(capsys, out)
    # More of what is left, in place; numbers are those of the whole field.
    text = run(capsys, out, "--flood", -1, -1, -0.3, "--flood-reach", 0.3, "--remove", "--overwrite")
    count = int(text.split()[0])
    assert 0 < count < 576 and f"{800 + count} of 1376 deleted" in text
    left, whole = Scene.open(out).field, Scene.open(out, whole=True).field
    assert isinstance(left, SplatField) and len(left) == 576 - count and len(whole) == 1376  # type: ignore[arg-type]
    floor = np.linalg.norm(left.means - np.array([-1.0, -1.0, -0.3]), axis=1)
    assert floor.min() > 0.2
    before = (out / "removed.json").read_bytes()
    assert "nothing deleted" in run(capsys, out, "--opacity", 0, 0.85, "--remove", "--overwrite")
    assert (out / "removed.json").read_bytes() == before
    back = tmp_path / "back"
    assert f"scene with all 1376 written to {back}" in run(capsys, out, "--restore", "-o", back)
    run(capsys, out, "--restore", "--overwrite")
    for folder in (out, back):
        assert len(Scene.open(folder).field) == 1376  # type: ignore[arg-type]
        assert not (folder / "removed.json").exists()
        assert "deleted " not in info(capsys, folder)
    assert "nothing is deleted from" in refused(capsys, out, "--restore", "--overwrite")
    run(capsys, scene, "--opacity", 0, 0.85, "--remove", "-o", out, "--overwrite")
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
    run(capsys, tmp_path / "ball", "--flood", -0.5, 0, 0, "--flood-reach", 0.3, "--remove", "--overwrite")
    first = Scene.open(tmp_path / "ball").removal
    assert first is not None and 0 < first.selection.count < total
    left = np.linalg.norm(elements_of_field(Scene.open(tmp_path / "ball").field).positions, axis=1)
    run(capsys, tmp_path / "ball", "--flood", 0.5, 0, 0, "--flood-reach", 0.2, "--remove", "--overwrite")
    second = Scene.open(tmp_path / "ball").removal
    assert second is not None and second.selection.total == total
    assert (second.selection.mask >= first.selection.mask).all()
    more = second.selection.mask & ~first.selection.mask
    near = np.linalg.norm(elements_of_field(second.field).positions[more] - np.array([0.5, 0, 0]), axis=1)
    assert 0 < more.sum() < len(left) and near.max() < 0.4
    run(capsys, tmp_path / "ball", "--restore", "--overwrite")
    assert "0 of" in run(capsys, tmp_path / "ball", "--floaters", 0.5)


def test_what_cannot_be_is_refused(capsys: pytest.CaptureFixture[str], scene: Path) -> None:
    assert "give --flood X Y Z" in refused(capsys, scene)
    assert "give -o NEW_SCENE, or --overwrite" in refused(capsys, scene, "--opacity", 0, 1, "--remove")
    assert "give one of them" in refused(capsys, scene, "--opacity", 0, 1, "-o", scene.parent / "x")
    assert "--restore goes alone" in refused(capsys, scene, "--restore", "--remove", "--overwrite")
    assert "low <= high" in refused(capsys, scene, "--opacity", 1, 0)
    assert "strength of floaters" in refused(capsys, scene, "--floaters", 3)
    assert "0 or more" in refused(capsys, scene, "--opacity", 0, 1, "--grow", -1)
    assert "nothing is selected" in refused(
        capsys, scene, "--opacity", 0, 0.1, "--to-cage", scene.parent / "c.yaml"
    )
