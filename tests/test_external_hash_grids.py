"""nerfacto and Instant-NGP through edits, in scenes and by the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ngp_files

pytest.importorskip("torch", reason="these fields need PyTorch")

import nerfacto_files
from cagefield import Cage, Edit, EditStack, Scene
from cagefield.cameras.camera import Camera
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.external.instant_ngp import InstantNgpField
from cagefield.fields.external.nerfacto import NerfactoField
from cagefield.formats.external.read_external import read_external
from cagefield.rendering.external.external_renderer import ExternalRenderer
from commands import printed, refused


def nerfacto(folder: Path) -> NerfactoField:
    path = nerfacto_files.write_run(folder, box=True, background="white", spacing="uniform", far=12.0)
    found = read_external(path)
    assert found is not None and isinstance(found.field, NerfactoField)
    return found.field


def instant_ngp(folder: Path) -> InstantNgpField:
    found = read_external(ngp_files.write(folder / "a.ingp", ngp_files.snapshot()))
    assert found is not None and isinstance(found.field, InstantNgpField)
    return found.field


# nerfacto: the same samples, its bins depend on distances alone. Instant-NGP: its lattice begins elsewhere,
# and the sums differ by its steps' quadrature
@pytest.mark.parametrize(("make", "tolerance"), [(nerfacto, 2e-3), (instant_ngp, 0.02)])
def test_moved_content_looks_as_from_a_camera_moved_along(tmp_path: Path, make, tolerance: float) -> None:
    field: ExternalField = make(tmp_path)
    middle, size = field.bounds.mean(axis=0), float((field.bounds[1] - field.bounds[0]).max())
    shift = np.array([1.5 * size, 0.25 * size, 0.0])
    pose = np.eye(4)
    pose[:3, 3] = middle + np.array([0.0, 0.1 * size, 1.6 * size])
    camera = Camera.from_fov(pose, 8, 6, 0.7)
    plain = ExternalRenderer(field).render(camera, background="black")
    assert plain.opacity.max() > 0.2 and plain.rgb.std() > 0.02
    pose[:3, 3] += shift
    edits = EditStack([Edit.move(Cage.box(middle, 1.02 * size)).translate(tuple(shift))])
    moved = ExternalRenderer(field, edits).render(Camera.from_fov(pose, 8, 6, 0.7), background="black")
    np.testing.assert_allclose(moved.opacity, plain.opacity, atol=tolerance)
    np.testing.assert_allclose(moved.rgb, plain.rgb, atol=tolerance)
    left = ExternalRenderer(field, edits).render(camera, background="black")
    assert left.opacity.max() < 1e-3


@pytest.mark.nightly
def test_the_command_bakes_a_nerfacto_with_its_data_sets_cameras(tmp_path: Path, capsys) -> None:
    path = nerfacto_files.write_run(tmp_path, box=True, background="white")
    out = printed(capsys, "import", path, "-o", tmp_path / "scene", "--resolution", 24, "--compare", 0)
    assert "nerfacto (PyTorch layout): 4 levels 4 to 32" in out and "mean embedding" in out
    scene = Scene.open(tmp_path / "scene")
    assert isinstance(scene.original, NerfactoField)
    camera = Camera.from_fov(scene.cameras["test"][0].c2w, 6, 5, 0.6)
    exact = scene.render(camera, exact=True)
    np.testing.assert_array_equal(exact.rgb, ExternalRenderer(nerfacto_of(path)).render(camera).rgb)
    (tmp_path / "config.yml").unlink()
    assert "--config" in refused(capsys, "import", path, "-o", tmp_path / "other")


def nerfacto_of(path: Path) -> NerfactoField:
    found = read_external(path)
    assert found is not None and isinstance(found.field, NerfactoField)
    return found.field


def test_the_command_bakes_a_snapshot_with_its_own_cameras(tmp_path: Path, capsys) -> None:
    path = ngp_files.write(tmp_path / "a.ingp", ngp_files.snapshot())
    out = printed(capsys, "import", path, "-o", tmp_path / "scene", "--resolution", 24, "--compare", 0)
    assert "Instant-NGP: 4 levels 4 to 32, 4 features" in out and "no file that it wrote" in out
    scene = Scene.open(tmp_path / "scene")
    assert isinstance(scene.original, InstantNgpField) and len(scene.cameras["train"]) == 1
    assert scene.background == (0.25, 0.5, 1.0)
    assert "original    Instant-NGP" in printed(capsys, "info", tmp_path / "scene")


def test_a_splatfacto_checkpoint_is_still_one_of_splats(tmp_path: Path) -> None:
    from cagefield.formats.splats.nerfstudio import is_splatfacto
    from splat_damage import checkpoint_of
    from splat_scenes import ball_of_splats

    (tmp_path / "s.ckpt").write_bytes(checkpoint_of(ball_of_splats(20)))
    assert is_splatfacto(tmp_path / "s.ckpt")
    assert not is_splatfacto(nerfacto_files.write_run(tmp_path))
