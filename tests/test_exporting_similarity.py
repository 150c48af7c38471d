"""Exports in the reconstruction's coordinates: the similarity that made the scene's is undone."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.datasets import load_dataset
from cagefield.errors import CagefieldError, SceneError
from cagefield.exporting.similarity import transform_field, transform_mesh, transform_points
from cagefield.fields.meshing import Mesh
from cagefield.fields.sh import sh_basis
from cagefield.fields.splat_field import SplatField
from cagefield.files.ply import read_ply
from cagefield.formats.splats.splat_files import read_splats
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.scene.scene import Scene
from commands import printed, refused
from posed_photos import ring, save
from scenes import ball_scene
from splat_scenes import random_splats, splat_scene

TURN = Rotation.from_rotvec((0.4, -0.7, 1.1)).as_matrix()
SCALE, SHIFT = 0.25, np.array([3.0, -4.0, 5.0])


def similarity(turn=TURN, scale=SCALE, shift=SHIFT):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scale * turn, shift
    return matrix


def covariances(field):
    axes = rotation_matrices(field.quaternions.astype(float)) * np.exp(
        field.log_scales[:, None].astype(float)
    )
    return axes @ np.swapaxes(axes, 1, 2)


def colors(field, directions):
    basis = sh_basis(directions, field.sh_degree)
    return np.einsum("dk,nkc->ndc", basis, field.sh.astype(float))


@pytest.mark.parametrize("mirror", [np.eye(3), np.diag([1.0, 1.0, -1.0])])
def test_splats_are_those_of_the_reconstruction(mirror):
    """x = M^-1 (x' - t); covariances M^-1 C M^-T; a color seen along d is seen along P^-1 d."""
    field = random_splats(40, degree=3)
    turn = TURN @ mirror
    found = transform_field(field, np.linalg.inv(similarity(turn)))
    np.testing.assert_allclose(found.means, (field.means - SHIFT) @ turn / SCALE, atol=1e-4)
    expected = turn.T @ covariances(field) @ turn / SCALE**2
    np.testing.assert_allclose(covariances(found), expected, rtol=1e-4, atol=1e-5 * expected.max())
    directions = np.random.default_rng(1).normal(size=(30, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    np.testing.assert_allclose(colors(found, directions @ turn), colors(field, directions), atol=1e-5)
    np.testing.assert_array_equal(found.opacities, field.opacities)
    assert found.offset == (0.0, 0.0, 0.0)


def test_far_reconstructions_get_an_offset():
    field = random_splats(40)
    far = np.array([500123.25, 5412345.5, 312.0])
    found = transform_field(field, similarity(TURN, 2.0, far))
    places = 2.0 * field.means.astype(float) @ TURN.T + far
    np.testing.assert_allclose(found.means.astype(float) + found.offset, places, atol=1e-5)
    assert np.abs(found.means).max() < 30


@pytest.mark.parametrize("mirror", [np.eye(3), np.diag([1.0, 1.0, -1.0])])
def test_meshes_and_points_too(mirror):
    from cagefield.training.splats.fit_splats import SurfacePoints

    back = similarity(TURN @ mirror, 3.0)
    rgb = np.full((3, 3), 0.5, np.float32)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (3, 1))
    mesh, offset = transform_mesh(Mesh(corners, normals, rgb, np.array([[0, 1, 2]], np.int32)), back)
    assert not any(offset)
    moved = 3.0 * corners @ (TURN @ mirror).T + SHIFT
    np.testing.assert_allclose(mesh.positions, moved, atol=1e-5)
    a, b, c = mesh.positions[mesh.faces[0]].astype(float)
    # Faces stay counter-clockwise seen from where normals point to.
    np.testing.assert_allclose(np.cross(b - a, c - a) / 9.0, mesh.normals[0], atol=1e-5)
    np.testing.assert_allclose(mesh.normals[0], TURN @ mirror @ (0, 0, 1), atol=1e-6)
    points, _ = transform_points(SurfacePoints(corners.astype(float), normals, rgb), back)
    np.testing.assert_allclose(points.positions, moved, atol=1e-12)
    np.testing.assert_allclose(points.normals[0], TURN @ mirror @ (0, 0, 1), atol=1e-6)


def trained_scene(folder: Path, field: SplatField) -> Scene:
    """The scene of a capture whose file says applied_transform and applied_scale."""
    frames = []
    for i, pose in enumerate(ring(9)):
        save(folder / f"images/{i}.png", np.full((16, 24, 3), 20 * i, np.uint8))
        frames.append({"file_path": f"images/{i}.png", "transform_matrix": pose.tolist()})
    applied = [[0, 0, 1, 3], [1, 0, 0, 4], [0, 1, 0, 5]]
    values = {"fl_x": 30.0, "applied_transform": applied, "applied_scale": 0.25, "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(values))
    data = load_dataset(folder)
    return Scene.trained(SimpleNamespace(field=field, gains=np.ones((len(data.train), 3), np.float32)), data)


def test_the_command_undoes_applied_transform_and_scale(tmp_path, capsys):
    field = random_splats(50, degree=1)
    trained_scene(tmp_path / "data", field).save(tmp_path / "scene")
    assert "mirrored" not in printed(capsys, "info", tmp_path / "scene")
    text = printed(capsys, "info", tmp_path / "scene")
    assert (
        "world       the reconstruction's, turned, scaled by 0.25, moved by (0.75, 1, 1.25); export" in text
    )
    said = printed(capsys, "export", tmp_path / "scene", "-o", tmp_path / "a.ply", "--source-coordinates")
    assert "in the coordinates of the reconstruction" in said
    found = read_splats(tmp_path / "a.ply")
    # x' = 0.25 (z + 3), y' = 0.25 (x + 4), z' = 0.25 (y + 5)
    x, y, z = field.means.T
    np.testing.assert_allclose(found.means, np.stack([4 * y - 4, 4 * z - 5, 4 * x - 3], axis=1), atol=1e-4)
    np.testing.assert_allclose(found.log_scales, field.log_scales + np.log(4), atol=1e-5)
    said = refused(
        capsys, "export", tmp_path / "scene", "-o", tmp_path / "b.ply", "--source-coordinates", "--up", "z-up"
    )
    assert "--source-coordinates turns nothing upright; leave out --up" in said
    said = refused(capsys, "export", tmp_path / "scene", "-o", tmp_path / "b.html", "--source-coordinates")
    assert "leave out --source-coordinates" in said


def test_points_of_voxels_by_the_command(tmp_path, capsys):
    """A ball of radius .5 around the origin is one of radius 2 around 4 R^T (-t)."""
    scene = dataclasses.replace(ball_scene(), source_to_world=similarity())
    scene.save(tmp_path / "scene")
    out = tmp_path / "a.ply"
    printed(
        capsys,
        "export",
        tmp_path / "scene",
        "-o",
        out,
        "--as",
        "points",
        "--splats",
        500,
        "--source-coordinates",
    )
    vertex = read_ply(out).elements["vertex"]
    places = np.stack([vertex[axis] for axis in "xyz"], axis=1).astype(float)
    radii = np.linalg.norm(places + SHIFT @ TURN / SCALE, axis=1)
    assert np.median(radii) == pytest.approx(2.0, abs=0.2)


def test_scenes_keep_the_similarity_and_older_ones_have_none(tmp_path):
    scene = dataclasses.replace(splat_scene(), source_to_world=similarity())
    scene.save(tmp_path / "scene")
    opened = Scene.open(tmp_path / "scene")
    np.testing.assert_array_equal(opened.source_to_world, similarity())
    np.testing.assert_array_equal(opened.with_edits(opened.edits).source_to_world, similarity())
    splat_scene().save(tmp_path / "plain")
    assert "source_to_world" not in json.loads((tmp_path / "plain/scene.json").read_text())
    np.testing.assert_array_equal(Scene.open(tmp_path / "plain").source_to_world, np.eye(4))


@pytest.mark.parametrize(
    "value",
    [
        [[1, 2], [3, 4]],
        "a",
        7,
        [[0] * 4] * 4,
        np.diag([1, 1, 1, 2]).tolist(),
        [["x"] * 4] * 4,
        [[1e-200] * 4] * 4,
    ],
)
def test_damaged_similarities_are_refused(tmp_path, value):
    splat_scene().save(tmp_path / "scene")
    file = tmp_path / "scene/scene.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"source_to_world": value}))
    with pytest.raises(SceneError, match=r"scene\.json: source_to_world must be 4 rows of 4 finite numbers"):
        Scene.open(tmp_path / "scene")


def test_a_map_that_is_no_similarity_is_refused():
    from cagefield.exporting.similarity import world_to_source

    scene = dataclasses.replace(splat_scene(), source_to_world=np.diag([1.0, 2.0, 3.0, 1.0]))
    with pytest.raises(CagefieldError, match="scales axes by 3 to 1"):
        world_to_source(scene)
