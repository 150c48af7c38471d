"""Meters and the up direction of a scene: found, kept in its folder, and honored by exports."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.edits import EditStack
from cagefield.errors import SceneError
from cagefield.exporting.similarity import aligned_splats
from cagefield.exporting.usd_scenes import StageScene, edited_parts
from cagefield.files.ply import read_ply
from cagefield.formats.splats.splat_files import read_splats
from cagefield.formats.splats.usd_stage import camera_pose
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.scene.alignment import (
    Alignment,
    dominant_plane,
    meters_per_unit,
    nearest_axis,
    up_from_points,
)
from cagefield.scene.scene import Scene
from commands import printed, refused
from scenes import ball_scene
from splat_scenes import splat_scene

TILTED = Rotation.from_euler("xyz", (7.0, -4.0, 30.0), degrees=True).as_matrix() @ (0.0, 0.0, 1.0)
"""An up direction near z."""


def test_the_matrix_levels_and_scales() -> None:
    matrix = Alignment(0.25, TILTED).matrix
    np.testing.assert_allclose(matrix[:3, :3] @ TILTED, (0.0, 0.0, 0.25), atol=1e-12)
    np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, 0.0625 * np.eye(3), atol=1e-12)
    assert (Alignment().matrix == np.eye(4)).all() and not Alignment()
    assert (Alignment(up=np.array([0.0, -3.0, 0.0])).matrix == np.eye(4)).all()
    assert (nearest_axis((0.1, -0.9, 0.4)) == (0.0, -1.0, 0.0)).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"meters_per_unit": 0}, "meters_per_unit is 0; it must be a number above 0"),
        ({"meters_per_unit": float("nan")}, "meters_per_unit is nan"),
        ({"meters_per_unit": True}, "meters_per_unit is True"),
        ({"up": [0, 0, 0]}, "up is"),
        ({"up": [0, 1]}, "up is"),
        ({"up": [0, 0, float("inf")]}, "up is"),
        ({"up": "z"}, "up is 'z'"),
        ({"north": [0, 1, 0]}, "must have meters_per_unit or up"),
        ([1], "must have meters_per_unit or up"),
    ],
)
def test_impossible_alignments_are_refused(values: object, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Alignment.from_value(values)


def test_scale_and_up_of_points() -> None:
    assert meters_per_unit((1, 0, 0), (1, 3, 4), 0.5) == pytest.approx(0.1)
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    for order in (points, points[::-1]):
        np.testing.assert_allclose(up_from_points(order, (0.1, 0.0, -1.0)), (0, 0, -1), atol=1e-12)
    for far in (1e-6, 1e6):
        with pytest.raises(SceneError, match="lie on a line"):
            up_from_points(far * np.array([(0, 0, 0), (1, 1, 1), (2, 2, 2)]), (0, 0, 1))
    with pytest.raises(SceneError, match="coincide"):
        meters_per_unit((1, 2, 3), (1, 2, 3), 1.0)


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_the_floor_is_found_among_walls_and_clutter(unit: float) -> None:
    """Noise of half a spacing, a wall with more surfels than the floor, and a table."""
    rng = np.random.default_rng(2)
    turn = Rotation.from_euler("xy", (9.0, -6.0), degrees=True).as_matrix()

    def patch(count: int, normal: tuple[float, ...], middle: tuple[float, ...], size: float) -> tuple:
        normal = np.array(normal)
        a = np.cross(normal, (0.3, 0.5, 0.8))
        a /= np.linalg.norm(a)
        b = np.cross(normal, a)
        uv = rng.uniform(-size, size, (count, 2))
        points = np.array(middle) + uv[:, :1] * a + uv[:, 1:] * b + rng.normal(0, 0.005, (count, 1)) * normal
        normals = normal + rng.normal(0, 0.15, (count, 3))
        return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)

    parts = [
        patch(5000, (0, 0, 1), (0, 0, 0), 1.0),
        patch(9000, (1, 0, 0), (-1, 0, 1), 1.0),
        patch(1500, (0, 0, 1), (0.3, 0.2, 0.7), 0.3),
    ]
    ball = rng.normal(size=(4000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    parts.append((0.3 * ball + (0.5, -0.4, 0.3), ball))
    points, normals = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    order = rng.permutation(len(points))
    plane = dominant_plane(unit * points[order] @ turn.T, normals[order] @ turn.T, (0, 0, 1), 0.01 * unit)
    assert plane is not None
    assert np.degrees(np.arccos(plane.normal @ (turn @ (0, 0, 1)))) < 0.3
    assert plane.share == pytest.approx(5000 / len(points), abs=0.06)


def test_a_ball_has_no_floor() -> None:
    ball = np.random.default_rng(0).normal(size=(5000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    assert dominant_plane(ball, ball, (0, 0, 1), 0.01) is None
    assert dominant_plane(ball[:0], ball[:0], (0, 0, 1), 0.01) is None


def test_the_command_keeps_the_alignment_in_the_folder(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = tmp_path / "scene"
    ball_scene().save(folder)
    assert "none; up is that of the cameras" in printed(capsys, "align", folder)
    before = (folder / "scene.json").read_bytes()
    said = printed(capsys, "align", folder, "--distance", "0,0,0", "0,0,2", "0.5", "--up", "0.1,0,1")
    assert "0.25 m per unit" in said
    scene = Scene.open(folder)
    assert scene.alignment.meters_per_unit == 0.25
    np.testing.assert_allclose(scene.up, np.array([0.1, 0.0, 1.0]) / np.sqrt(1.01))
    printed(capsys, "align", folder, "--meters-per-unit", "2", "--up", "0,0,0", "1,0,0", "0,1,0.1")
    scene = Scene.open(folder)
    assert scene.alignment.meters_per_unit == 2.0
    np.testing.assert_allclose(scene.up, np.array([0.0, -0.1, 1.0]) / np.sqrt(1.01))
    assert "2 m per unit" in printed(capsys, "info", folder)
    scene.with_edits(EditStack()).save(tmp_path / "copy")
    assert Scene.open(tmp_path / "copy").alignment.meters_per_unit == 2.0
    printed(capsys, "align", folder, "--reset")
    assert (folder / "scene.json").read_bytes() == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--up", "1,2"), '"1,2" is no point'),
        (("--up", "0,0,1", "0,0,2"), "--up has 2 points"),
        (("--distance", "0,0,0", "0,0,0", "1"), "coincide"),
        (("--distance", "0,0,0", "0,0,1", "-1"), "must be above 0"),
        (("--distance", "0,0,0", "0,0,1", "1", "--meters-per-unit", "1"), "leave one out"),
        (("--reset", "--meters-per-unit", "1"), "leave out the other options"),
        (("--up", "floor"), "no plane is nearly level"),
    ],
)
def test_impossible_options_leave_the_scene_as_it_is(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    folder = tmp_path / "scene"
    ball_scene().save(folder)
    before = (folder / "scene.json").read_bytes()
    assert message in refused(capsys, "align", folder, *options)
    assert (folder / "scene.json").read_bytes() == before


def test_a_damaged_alignment_is_named(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "scene")
    file = tmp_path / "scene" / "scene.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "alignment": {"up": "above"}}))
    with pytest.raises(SceneError, match=r"scene\.json: up is 'above'.*correct or remove the entry"):
        Scene.open(tmp_path / "scene")


def test_splats_are_exported_in_meters_and_level(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    scene = dataclasses.replace(splat_scene(), alignment=Alignment(0.2, TILTED))
    scene.save(tmp_path / "scene")
    matrix = scene.alignment.matrix[:3, :3]
    said = printed(capsys, "export", tmp_path / "scene", "-o", tmp_path / "a.ply")
    assert "in meters (0.2 m per unit of the scene), leveled" in said
    plain = dataclasses.replace(scene, alignment=Alignment())
    plain.save(tmp_path / "plain")
    printed(capsys, "export", tmp_path / "plain", "-o", tmp_path / "b.ply", "--up", "z-up")
    found, other = read_splats(tmp_path / "a.ply"), read_splats(tmp_path / "b.ply")
    # The file's axes are turned from z up to -y; the alignment comes before that.
    file_turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    np.testing.assert_allclose(found.means, other.means @ (file_turn @ matrix @ file_turn.T).T, atol=1e-5)
    np.testing.assert_allclose(found.scales, 0.2 * other.scales, rtol=1e-4)
    axes = rotation_matrices(found.quaternions.astype(float))
    expected = file_turn @ (matrix / 0.2) @ file_turn.T @ rotation_matrices(other.quaternions.astype(float))
    np.testing.assert_allclose(np.abs(np.einsum("nij,nij->nj", axes, expected)), 1.0, atol=1e-4)
    # --up says what is up in place of the scene; meters stay.
    printed(capsys, "export", tmp_path / "scene", "-o", tmp_path / "c.ply", "--up", "z-up")
    np.testing.assert_allclose(read_splats(tmp_path / "c.ply").means, 0.2 * other.means, atol=1e-5)


def test_points_and_meshes_are_exported_in_meters(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    scene = ball_scene().with_edits(EditStack())
    for name, alignment in (("plain", Alignment()), ("metric", Alignment(3.0, TILTED))):
        dataclasses.replace(scene, alignment=alignment).save(tmp_path / name)
        printed(capsys, "export", tmp_path / name, "-o", tmp_path / f"{name}.ply", "--as", "mesh")
    vertices = {}
    for name in ("plain", "metric"):
        element = read_ply(tmp_path / f"{name}.ply").elements["vertex"]
        vertices[name] = np.stack([element[axis] for axis in "xyz"], axis=1).astype(float)
    expected = vertices["plain"] @ Alignment(3.0, TILTED).matrix[:3, :3].T
    np.testing.assert_allclose(vertices["metric"], expected, atol=1e-5)


def test_a_stage_has_its_cameras_where_its_splats_are() -> None:
    scene = dataclasses.replace(splat_scene(), alignment=Alignment(0.2, TILTED))
    one = StageScene("scene", scene, nearest_axis(scene.up))
    camera = (
        scene.cameras["train"][0] if scene.cameras.get("train") else next(iter(scene.cameras.values()))[0]
    )
    pose = camera_pose(camera, one.to_stage)
    np.testing.assert_allclose(pose.matrix[:3, :3] @ pose.matrix[:3, :3].T, np.eye(3), atol=1e-12)
    splats = edited_parts(scene)[""]
    depth = (splats.means - camera.origin) @ camera.c2w[:3, 2]
    moved = splats.means @ one.to_stage.T
    np.testing.assert_allclose((moved - pose.matrix[:3, 3]) @ pose.matrix[:3, 2], 0.2 * depth, atol=1e-5)


def test_splats_without_alignment_are_themselves() -> None:
    scene = dataclasses.replace(splat_scene(), alignment=Alignment(2.0))
    assert scene.with_edits(EditStack()).alignment.meters_per_unit == 2.0
    splats = scene.field
    np.testing.assert_allclose(aligned_splats(splats, scene).means, 2.0 * splats.means, rtol=1e-6)
    far = dataclasses.replace(splats, offset=(10.0, 0.0, -4.0))
    assert aligned_splats(far, scene).offset == (20.0, 0.0, -8.0)
    assert aligned_splats(splats, dataclasses.replace(scene, alignment=Alignment())) is splats


def test_an_aligned_source_is_pasted_upright(tmp_path: Path) -> None:
    scene = dataclasses.replace(splat_scene(), edits=EditStack())
    scene.save(tmp_path / "scene")
    dataclasses.replace(scene, alignment=Alignment(up=TILTED)).save(tmp_path / "other")
    paste = Scene.open(tmp_path / "scene").paste("../other")
    edges = paste.deformed.corners - paste.deformed.corners[0]
    before = paste.inner.corners - paste.inner.corners[0]
    turn = np.linalg.lstsq(before, edges, rcond=None)[0].T
    np.testing.assert_allclose(turn @ TILTED, scene.up, atol=1e-6)
