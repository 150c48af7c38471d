"""Meshes of fields and their files, against closed forms and another program's reader."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields.meshing import SURFACE_OPTICAL_DEPTH, Mesh, extract_mesh
from cagefield.fields.voxel_field import VoxelField
from cagefield.files.ply import read_ply
from cagefield.formats.mesh_files import srgb_to_linear, write_mesh, write_points
from scenes import SH_C0

trimesh = pytest.importorskip("trimesh", reason="needs trimesh")
RADIUS, CENTER = 0.6, np.array([0.2, -0.1, 0.3])


def ball(n: int = 48, radius: float = RADIUS) -> VoxelField:
    """A ball whose density falls linearly with the radius; red where x is high, else blue."""
    low, high = np.full(3, -1.0), np.full(3, 1.2)
    axes = [np.linspace(low[k], high[k], n) for k in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    edge = (high[0] - low[0]) / (n - 1)
    density = (SURFACE_OPTICAL_DEPTH + (radius - np.linalg.norm(points - CENTER, axis=1)) / edge) / edge
    rgb = np.where(points[:, :1] > CENTER[0], (0.8, 0.1, 0.1), (0.1, 0.2, 0.9))
    return VoxelField(
        bounds=np.stack([low, high]),
        resolution=(n, n, n),
        vertices=np.arange(n**3),
        density=density.astype(np.float32),
        sh=((rgb - 0.5) / SH_C0)[:, None].astype(np.float32),
    )


def test_a_balls_mesh_is_the_ball() -> None:
    mesh = extract_mesh(ball())
    offset = np.linalg.norm(mesh.positions - CENTER, axis=1) - RADIUS
    # A chord of one edge is h^2 / (8 r) = 4.6e-4 from its arc.
    assert np.abs(offset).max() < 5e-4
    outwards = (mesh.positions - CENTER) / RADIUS
    assert np.einsum("vi,vi->v", mesh.normals, outwards).min() > 0.999
    solid = trimesh.Trimesh(mesh.positions, mesh.faces, process=False)
    assert solid.is_watertight and solid.is_winding_consistent
    # Positive: faces are counter-clockwise from outside. Faces lie inside the ball by their sagitta, about
    # h^2 / (4 r) = 9e-4 of .6 at most, which is three times as much of the volume.
    assert solid.volume == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=4.5e-3)
    far = np.abs(mesh.positions[:, 0] - CENTER[0]) > 0.1
    expected = np.where(mesh.positions[:, :1] > CENTER[0], (0.8, 0.1, 0.1), (0.1, 0.2, 0.9))
    np.testing.assert_allclose(mesh.rgb[far], expected[far], atol=1e-5)


def test_finer_voxels_bring_the_mesh_nearer_by_their_square() -> None:
    errors = [
        np.abs(np.linalg.norm(extract_mesh(ball(n)).positions - CENTER, axis=1) - RADIUS).mean()
        for n in (24, 47, 93)  # edges halve
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 1.7).all(), orders


def test_what_the_grid_cuts_is_closed() -> None:
    mesh = extract_mesh(ball(32, radius=3.0), level=1e-3)
    solid = trimesh.Trimesh(mesh.positions, mesh.faces, process=False)
    assert solid.is_watertight
    # The grid's box, and an edge around it at most.
    assert 2.2**3 <= solid.volume <= (2.2 + 2 * 2.2 / 31) ** 3


def test_kept_faces_have_all_their_vertices() -> None:
    mesh = extract_mesh(ball())
    half = mesh.select_vertices(mesh.positions[:, 2] > CENTER[2])
    assert 0.45 < len(half.faces) / len(mesh.faces) < 0.5
    assert half.faces.max() == len(half.positions) - 1 and half.positions[:, 2].min() > CENTER[2]
    triangles = half.positions[half.faces]
    whole = {tuple(t.reshape(-1)) for t in mesh.positions[mesh.faces]}
    assert all(tuple(t.reshape(-1)) in whole for t in triangles)


def test_an_empty_field_has_no_surface() -> None:
    with pytest.raises(FieldError, match="has no surface: its density is"):
        extract_mesh(ball(), level=1e9)


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return extract_mesh(ball(16))


def test_another_program_reads_the_ply(mesh: Mesh, tmp_path: Path) -> None:
    write_mesh(tmp_path / "ball.ply", mesh)
    read = trimesh.load(tmp_path / "ball.ply", process=False)
    np.testing.assert_array_equal(read.vertices, mesh.positions)
    np.testing.assert_array_equal(read.faces, mesh.faces)
    np.testing.assert_allclose(read.visual.vertex_colors[:, :3] / 255.0, mesh.rgb, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(read.vertex_normals, mesh.normals, atol=1e-6)


@pytest.mark.parametrize("up", [(0, 0, 1), (0, -1, 0), (0, 1, 0), (1, 1, 0)])
def test_another_program_reads_the_glb_with_y_up(mesh: Mesh, tmp_path: Path, up: tuple[float, ...]) -> None:
    write_mesh(tmp_path / "ball.glb", mesh, up)
    scene = trimesh.load(tmp_path / "ball.glb", process=False)
    (read,) = scene.geometry.values()
    np.testing.assert_allclose(read.vertices, mesh.positions, atol=1e-6)
    np.testing.assert_array_equal(read.faces, mesh.faces)
    turn = scene.graph.get(scene.graph.nodes_geometry[0])[0][:3, :3]
    np.testing.assert_allclose(turn @ np.array(up) / np.linalg.norm(up), (0, 1, 0), atol=1e-6)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_allclose(read.vertex_normals, mesh.normals, atol=1e-5)
    content = (tmp_path / "ball.glb").read_bytes()
    length = int.from_bytes(content[12:16], "little")
    document = json.loads(content[20 : 20 + length])
    view = document["bufferViews"][document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]
    start = 28 + length + view["byteOffset"]
    colors = np.frombuffer(content[start : start + view["byteLength"]], "<u2").reshape(-1, 4) / 65535.0
    np.testing.assert_allclose(colors[:, :3], srgb_to_linear(mesh.rgb), atol=0.5 / 65535 + 1e-6)
    assert (colors[:, 3] == 1.0).all() and len(content) % 4 == 0


def test_linear_light_is_srgbs() -> None:
    np.testing.assert_allclose(
        srgb_to_linear(np.array([0.0, 0.04045, 0.5, 1.0])), [0, 0.0031308, 0.2140411, 1], atol=1e-7
    )


def test_points_are_read_again(tmp_path: Path) -> None:
    chance = np.random.default_rng(0)
    positions, rgb = chance.normal(size=(50, 3)), chance.random((50, 3))
    write_points(tmp_path / "points.ply", positions, rgb)
    vertex = read_ply(tmp_path / "points.ply").elements["vertex"]
    assert list(vertex) == ["x", "y", "z", "red", "green", "blue"]
    np.testing.assert_array_equal(np.stack([vertex[c] for c in "xyz"], axis=1), positions.astype(np.float32))
    np.testing.assert_array_equal(
        np.stack([vertex[c] for c in ("red", "green", "blue")], axis=1), np.floor(255 * rgb + 0.5)
    )


def test_another_suffix_is_refused(mesh: Mesh, tmp_path: Path) -> None:
    with pytest.raises(FieldError, match=r"x\.obj: a mesh is written as \.ply or \.glb"):
        write_mesh(tmp_path / "x.obj", mesh)
