"""Commands on scenes of splats: info, edit, render, bake."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cagefield import Scene, load_edits
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.image_files import read_image
from commands import printed, refused
from scenes import ball_scene, files_of
from splat_scenes import splat_scene

EDITS = """
edits:
  - name: lift
    inner: {center: [0, 0, 0.5], size: 1}
    outer: {margin: 0.4}
    lattice: 16
    operations:
      - translate: [0, 0, 0.2]
  - name: gone
    delete: true
    inner: {center: [0, 0, -0.5], size: 0.5}
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene folder with a ball of splats."""
    splat_scene().save(tmp_path / "scene")
    return tmp_path / "scene"


@pytest.fixture
def edit_file(tmp_path: Path) -> Path:
    """An edit file with a continuous edit and a delete."""
    (tmp_path / "edits.yaml").write_text(EDITS)
    return tmp_path / "edits.yaml"


def test_info_says_what_is_there(capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path) -> None:
    opened = Scene.open(scene)
    # Splats count with their opacity: here those above the middle with nine times that of the others.
    up = opened.field.means[:, 2] > 0
    field = replace(opened.field, opacities=np.where(up, 0.9, 0.1), antialiased=True)
    replace(opened, field=field, edits=load_edits(edit_file)).save(scene, overwrite=True)
    text = printed(capsys, "info", scene)
    share = 0.9 * up.sum() / (0.9 * up.sum() + 0.1 * (~up).sum())
    box = np.abs(field.means + np.array([0, 0, 0.5])) <= 0.25
    empties = field.opacities[box.all(axis=1)].sum() / field.opacities.sum()
    width = field.sample_spacing
    for fact in (
        "600 splats (0.0 MB in memory), antialiased",
        "box 2 x 2 x 2 around (0, 0, 0)",
        f"splat width {width:.4g}, color SH degree 0",
        "train: 3 24x16",
        '1. "lift": continuous, flow shell, lattice of 16^3 nodes',
        f"{share:.1%} of the field's splats follow the cage, whose corners move by up to 0.2",
        f"empties {empties:.1%} of the field's splats",
    ):
        assert fact in text
    assert re.search(r"the lattice is off by [\d.e-]+ splat widths on average, [\d.e-]+ at most", text)
    replace(opened, field=replace(field, unbounded=True)).save(scene, overwrite=True)
    assert "unbounded, box of interest 2 x 2 x 2" in printed(capsys, "info", scene)


def test_edit_applies_and_checks(capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path) -> None:
    before = files_of(scene)
    assert "of the field's splats follow the cage" in printed(capsys, "edit", scene, edit_file, "--check")
    printed(capsys, "edit", scene, edit_file, "-o", scene.parent / "edited")
    assert files_of(scene) == before
    edited = Scene.open(scene.parent / "edited")
    assert edited.edits == load_edits(edit_file) and len(edited.field) == 600


def test_render_in_all_ways(
    capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path, tmp_path: Path
) -> None:
    printed(capsys, "edit", scene, edit_file, "--overwrite")
    opened, out = Scene.open(scene), tmp_path / "out"
    printed(capsys, "render", scene, "-o", out)
    for index, camera in enumerate(opened.cameras["test"]):
        np.testing.assert_array_equal(read_image(out / f"{index:04d}.png"), opened.render(camera).rgb8())
    printed(
        capsys, "render", scene, "-o", tmp_path / "all.png", "--views", 0, "--compare", "--depth", "--normals"
    )
    both, depth = read_image(tmp_path / "all.png"), np.load(tmp_path / "all_depth.npy")
    frame = opened.render(opened.cameras["test"][0])
    np.testing.assert_array_equal(both[:, -24:], frame.rgb8())
    np.testing.assert_array_equal(depth[:, -24:], frame.depth)
    assert np.abs(both[:, :24].astype(int) - both[:, -24:]).max() > 100
    assert (tmp_path / "all_normals.png").is_file()
    printed(capsys, "render", scene, "-o", tmp_path / "exact.png", "--views", 0, "--exact")
    exact = opened.render(opened.cameras["test"][0], exact=True)
    np.testing.assert_array_equal(read_image(tmp_path / "exact.png"), exact.rgb8())
    assert "3 pictures" in printed(
        capsys, "render", scene, "-o", tmp_path / "turn", "--turntable", 3, "--size", "20x10"
    )
    assert read_image(tmp_path / "turn" / "0002.png").shape == (10, 20, 3)


def test_bake_makes_a_new_scene_of_voxels(
    capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path, tmp_path: Path
) -> None:
    opened = Scene.open(scene)
    cameras = {name: [c.resized(120, 80) for c in group] for name, group in opened.cameras.items()}
    replace(opened, cameras=cameras, edits=load_edits(edit_file)).save(scene, overwrite=True)
    before = files_of(scene)
    text = printed(capsys, "bake", scene, "-o", tmp_path / "voxels", "--resolution", 48)
    match = re.search(r"PSNR of the voxels against the splats ([\d.]+) dB \(2 views\)", text)
    assert match and float(match[1]) > 24.0
    voxels = Scene.open(tmp_path / "voxels")
    assert isinstance(voxels.field, VoxelField) and max(voxels.field.resolution) == 48
    assert voxels.original is None
    assert voxels.edits == load_edits(edit_file) and voxels.cameras == Scene.open(scene).cameras
    assert files_of(scene) == before
    assert "voxels in the place of the splats" in refused(capsys, "bake", scene, "--overwrite")
    assert "voxels in the place of the splats" in refused(capsys, "bake", scene, "-o", scene, "--overwrite")
    assert "give -o NEW_SCENE, or --overwrite" in refused(capsys, "bake", scene)
    assert "exists already" in refused(capsys, "bake", scene, "-o", tmp_path / "voxels")
    assert files_of(scene) == before


def test_bake_needs_splats_or_an_original(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "voxels")
    error = refused(capsys, "bake", tmp_path / "voxels", "-o", tmp_path / "new")
    assert "holds no original field to bake, only voxels" in error


def test_damage_is_one_line(capsys: pytest.CaptureFixture[str], scene: Path, tmp_path: Path) -> None:
    file = scene / "field.safetensors"
    file.write_bytes(file.read_bytes()[:1000])
    for command in (("info",), ("render", "-o", tmp_path / "out"), ("bake", "-o", tmp_path / "new")):
        assert "truncated" in refused(capsys, command[0], scene, *command[1:])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene"]
