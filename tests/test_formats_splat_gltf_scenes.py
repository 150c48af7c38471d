"""Scenes of glTF with splats: all that the default scene shows, where its nodes put it."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.errors import FieldError
from cagefield.fields.sh import C0, sh_basis
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import convert_splats, read_splats, write_splats
from cagefield.formats.splats.splat_table import FieldTable
from cagefield.formats.splats.spz_writer import write_spz
from cagefield.geometry.quaternions import rotation_matrices
from gltf_assets import EXTENSION, Asset, scene_of
from splat_damage import old_spz
from splat_scenes import assert_same_splats, random_splats


def read(path: Path) -> SplatField:
    """The splats in the file's own coordinates; a warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        return read_splats(path, axes="rdf")


def covariances(field: SplatField) -> np.ndarray:
    axes = (
        rotation_matrices(field.quaternions.astype(float)) * np.exp(field.log_scales.astype(float))[:, None]
    )
    return axes @ axes.transpose(0, 2, 1)


def colors(field: SplatField, directions: np.ndarray) -> np.ndarray:
    return 0.5 + np.einsum("dk,nkc->ndc", sh_basis(directions, field.sh_degree), field.sh.astype(float))


def unit_directions(count: int = 30) -> np.ndarray:
    d = np.random.default_rng(1).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def joined(*fields: SplatField) -> SplatField:
    names = ("means", "log_scales", "quaternions", "opacities", "sh")
    return SplatField(*(np.concatenate([getattr(field, name) for field in fields]) for name in names))


def test_all_primitives_of_all_meshes_are_read(tmp_path: Path) -> None:
    red, green, blue = (random_splats(40, degree=1, seed=seed) for seed in range(3))
    asset = Asset()
    both = asset.mesh(asset.splats(red), asset.splats(green))
    asset.scene(asset.node(mesh=both), asset.node(mesh=asset.mesh(asset.splats(blue)), translation=[0, 2, 0]))
    expected = joined(red, green, replace(blue, means=blue.means + np.float32([0, 2, 0])))
    assert_same_splats(read(asset.write(tmp_path / "a.glb")), expected, atol=1e-6)


def test_each_instance_of_a_mesh_is_read(tmp_path: Path) -> None:
    field = random_splats(40)
    asset = Asset()
    mesh = asset.mesh(asset.splats(field))
    asset.scene(asset.node(mesh=mesh), asset.node(mesh=mesh, translation=[2, 0, 0]))
    found = read(asset.write(tmp_path / "a.glb"))
    assert len(found) == 80
    np.testing.assert_allclose(found.means[40:], found.means[:40] + np.float32([2, 0, 0]), atol=1e-6)


def test_gpu_instances_are_read(tmp_path: Path) -> None:
    field = random_splats(10, degree=1)
    asset = Asset()
    shifts, turns = np.eye(3), Rotation.random(3, random_state=0)
    attributes = {
        "TRANSLATION": asset.accessor(shifts),
        "ROTATION": asset.accessor(turns.as_quat()),
        "SCALE": asset.accessor(np.array([[1, 1, 1], [2, 2, 2], [3, 3, 3]])),
    }
    node = asset.node(mesh=asset.mesh(asset.splats(field)), translation=[0, 0, 7])
    asset.json["nodes"][node]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    asset.scene(node)
    found = read(asset.write(tmp_path / "a.glb"))
    assert len(found) == 30
    for number in range(3):
        part = found.take(np.arange(10 * number, 10 * number + 10))
        expected = (number + 1) * turns[number].apply(field.means) + shifts[number] + [0, 0, 7]
        np.testing.assert_allclose(part.means, expected, atol=1e-5)


def test_parents_turn_scale_and_move(tmp_path: Path) -> None:
    """A root that turns z up to y up, scale 2 and shift, above a node that is moved."""
    field = random_splats(40, degree=2)
    half = np.sqrt(0.5)
    asset = Asset()
    child = asset.node(mesh=asset.mesh(asset.splats(field)), translation=[0, 0, 1])
    root = asset.node(children=[child], rotation=[-half, 0, 0, half], translation=[0, 0, 5], scale=[2, 2, 2])
    asset.scene(root)
    R = Rotation.from_euler("x", -90, degrees=True).as_matrix()
    found = read(asset.write(tmp_path / "a.glb"))
    local = field.means + np.array([0, 0, 1])
    np.testing.assert_allclose(found.means, [0, 0, 5] + 2 * local @ R.T, atol=1e-5)
    np.testing.assert_allclose(found.log_scales, field.log_scales + np.log(2.0), atol=1e-5)
    np.testing.assert_allclose(covariances(found), 4 * R @ covariances(field) @ R.T, atol=1e-6)
    d = unit_directions()
    np.testing.assert_allclose(colors(found, d @ R.T), colors(field, d), atol=1e-5)


MATRICES = {
    "stretched": np.diag([2.0, 0.5, 1.0]),
    "turned and stretched": Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix() @ np.diag([3.0, 1.0, 0.2]),
    "sheared": np.array([[1.0, 0.7, 0.0], [0.0, 1.0, -0.4], [0.2, 0.0, 1.0]]),
    "mirrored": np.diag([-1.0, 1.0, 1.0]),
    "inverted": -1.5 * np.eye(3),
    "mirrored and turned": Rotation.from_rotvec([1.0, 0.2, 0.0]).as_matrix() @ np.diag([1.0, -2.0, 1.0]),
}


@pytest.mark.parametrize("name", MATRICES)
def test_any_matrix_maps_covariances(tmp_path: Path, name: str) -> None:
    M, shift = MATRICES[name], np.array([1.0, -2.0, 0.5])
    field = random_splats(40, degree=3)
    asset = scene_of(field)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = M, shift
    asset.json["nodes"][0]["matrix"] = matrix.T.ravel().tolist()
    found = read(asset.write(tmp_path / "a.glb"))
    np.testing.assert_allclose(found.means, field.means @ M.T + shift, atol=1e-5)
    np.testing.assert_allclose(covariances(found), M @ covariances(field) @ M.T, rtol=2e-4, atol=1e-6)
    # Colors turn by the orthogonal part of M: exactly those of M where it is a similarity.
    u, stretch, vt = np.linalg.svd(M)
    d = unit_directions()
    np.testing.assert_allclose(colors(found, d @ (u @ vt).T), colors(field, d), atol=2e-5)
    if np.allclose(stretch, stretch[0]):
        turned = d @ M.T / stretch[0]
        np.testing.assert_allclose(colors(found, turned), colors(field, d), atol=2e-5)


@pytest.mark.parametrize("uri", [None, "data.bin", "buffers/my%20data.bin"])
def test_gltf_with_its_buffer_within_or_beside(tmp_path: Path, uri: str | None) -> None:
    field = random_splats(20)
    assert_same_splats(read(scene_of(field).write(tmp_path / "a.gltf", uri)), field, atol=1e-6)


@pytest.mark.parametrize(
    ("uri", "message"),
    [
        ("../secret.bin", "a buffer lies outside of its folder"),
        ("/etc/passwd", "a buffer lies outside of its folder"),
        ("file:///etc/passwd", "a buffer lies outside of its folder"),
        ("https://example.org/a.bin", "a buffer lies outside of its folder"),
        ("%2e%2e/secret.bin", "a buffer lies outside of its folder"),
        ("gone.bin", "it lacks gone.bin"),
        ("data:application/octet-stream;base64,@@@", "buffer 0 is no base64"),
    ],
)
def test_buffers_elsewhere_are_refused(tmp_path: Path, uri: str, message: str) -> None:
    (tmp_path / "secret.bin").write_bytes(bytes(1 << 16))
    (tmp_path / "in").mkdir()
    path = scene_of(random_splats(20)).write(tmp_path / "in" / "a.gltf")
    text = re.sub(r'"uri": "[^"]*"', f'"uri": "{uri}"', path.read_text())
    path.write_text(text)
    with pytest.raises(FieldError, match=rf"a\.gltf: .*{message}") as caught:
        read_splats(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("version", [2, 3, 4])
@pytest.mark.parametrize(
    "name",
    [
        "KHR_gaussian_splatting_compression_spz_2",
        "KHR_gaussian_splatting_compression_spz",
        "KHR_spz_gaussian_splats_compression",
    ],
)
def test_spz_within_gltf(tmp_path: Path, name: str, version: int) -> None:
    field = random_splats(30, degree=1)
    if version == 2:
        content = old_spz(2, 30)
    else:
        write_spz(tmp_path / "a.spz", FieldTable(field), version=version)  # type: ignore[arg-type]
        content = (tmp_path / "a.spz").read_bytes()
    (tmp_path / "a.spz").write_bytes(content)
    asset = Asset()
    compressed = {name: {"bufferView": asset.view(content)}}
    inner = name.startswith(EXTENSION)
    said = {EXTENSION: {"extensions": compressed}} if inner else compressed
    # Placeholders: they name no bufferView.
    asset.json["accessors"] = [{"componentType": 5126, "count": 30, "type": "VEC3"}]
    asset.scene(asset.node(mesh=asset.mesh({"mode": 0, "attributes": {"POSITION": 0}, "extensions": said})))
    assert_same_splats(read_splats(asset.write(tmp_path / "a.glb")), read_splats(tmp_path / "a.spz"))


def early(asset: Asset, scales: np.ndarray, color_type: str = "u1") -> dict[str, Any]:
    """A primitive of an early draft: five splats on a diagonal."""
    codes = np.array(
        [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 51], [255, 255, 0, 255], [0, 0, 0, 255]]
    )
    share = {"u1": 1, "u2": 257, "f4": 1 / 255}[color_type]
    attributes = {
        "POSITION": asset.accessor(np.linspace(-2, 2, 5)[:, None] * np.ones(3)),
        "COLOR_0": asset.accessor(codes * share, color_type, normalized=color_type != "f4"),
        "_SCALE": asset.accessor(scales),
        "_ROTATION": asset.accessor(np.tile([0, 0, 0, 1.0], (5, 1))),
    }
    return {"mode": 0, "attributes": attributes, "extensions": {EXTENSION: {}}}


@pytest.mark.parametrize(("scale", "is_log"), [(-3.0, True), (0.05, False)])
@pytest.mark.parametrize("color_type", ["u1", "u2", "f4"])
def test_attributes_of_early_drafts(tmp_path: Path, scale: float, is_log: bool, color_type: str) -> None:
    asset = Asset()
    asset.scene(asset.node(mesh=asset.mesh(early(asset, np.full((5, 3), scale), color_type))))
    path = asset.write(tmp_path / "a.glb")
    with pytest.warns(
        UserWarning, match="early draft; its scales are taken as " + ["lengths", "logarithms"][is_log]
    ):
        found = read_splats(path, axes="rdf")
    np.testing.assert_allclose(found.log_scales, scale if is_log else np.log(scale), atol=1e-6)
    np.testing.assert_allclose(found.opacities, [1, 1, 0.2, 1, 1], atol=1e-6)
    rgb = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 0, 0]]
    np.testing.assert_allclose(0.5 + C0 * found.sh[:, 0], rgb, atol=1e-6)
    np.testing.assert_allclose(found.means[:, 0], [-2, -1, 0, 1, 2])


def test_quantized_and_sparse_attributes(tmp_path: Path) -> None:
    field = random_splats(10, degree=0)
    asset = scene_of(field)
    attributes = asset.json["meshes"][0]["primitives"][0]["attributes"]
    codes = np.random.default_rng(0).integers(-32767, 32768, (10, 3))
    # Rows of 8 bytes: attributes begin at multiples of 4.
    padded = np.concatenate([codes, np.zeros((10, 1), int)], axis=1).astype("<i2").tobytes()
    view = asset.view(padded)
    asset.json["bufferViews"][view]["byteStride"] = 8
    position = {"bufferView": view, "componentType": 5122, "normalized": True, "count": 10, "type": "VEC3"}
    opacity = asset.json["accessors"][attributes[f"{EXTENSION}:OPACITY"]]
    opacity["sparse"] = {
        "count": 2,
        "indices": {"bufferView": asset.view(np.array([1, 7], "<u2").tobytes()), "componentType": 5123},
        "values": {"bufferView": asset.view(np.array([0.25, 0.75], "<f4").tobytes())},
    }
    asset.json["accessors"][attributes["POSITION"]] = position
    found = read(asset.write(tmp_path / "a.glb"))
    np.testing.assert_allclose(found.means, codes / 32767.0, atol=1e-6)
    expected = field.opacities.copy()
    expected[[1, 7]] = 0.25, 0.75
    np.testing.assert_allclose(found.opacities, expected, atol=1e-6)


def test_what_else_a_file_holds_is_named(tmp_path: Path) -> None:
    field = random_splats(5, degree=0)
    asset = Asset()
    splats = asset.splats(field)
    splats["attributes"]["_CONFIDENCE"] = asset.accessor(np.ones(5))
    triangles = {"attributes": {"POSITION": asset.accessor(np.eye(3))}}
    shown = asset.node(mesh=asset.mesh(splats, triangles))
    other = asset.node(mesh=asset.mesh(asset.splats(field)))
    asset.mesh(asset.splats(field))
    asset.scene(shown)
    asset.scene(other)
    asset.json["animations"], asset.json["cameras"] = [{}], [{}, {}]
    path = asset.write(tmp_path / "a.glb")
    with pytest.warns(UserWarning) as caught:
        assert len(read_splats(path)) == 5
    (line,) = {str(warning.message) for warning in caught}
    for part in (
        "1 attributes _CONFIDENCE",
        "1 primitives of lines or triangles",
        "1 animations",
        "2 cameras",
        "1 meshes of nodes that the default scene does not show",
        "1 meshes that no node shows",
    ):
        assert part in line


def test_meshes_and_point_clouds_say_what_can_be_done(tmp_path: Path) -> None:
    for mode, message in (
        (4, "a mesh of triangles, no field"),
        (0, "a point cloud, no splats: .*ply_file_path"),
    ):
        asset = Asset()
        primitive = {"mode": mode, "attributes": {"POSITION": asset.accessor(np.eye(3))}}
        asset.scene(asset.node(mesh=asset.mesh(primitive)))
        with pytest.raises(FieldError, match=message):
            read_splats(asset.write(tmp_path / "a.glb"))


@pytest.mark.nightly
def test_nodes_in_a_circle_are_refused_and_deep_ones_read(tmp_path: Path) -> None:
    field = random_splats(3)
    asset = scene_of(field)
    asset.json["nodes"][0]["children"] = [0]
    with pytest.raises(FieldError, match="node 0 has two parents, or is its own"):
        read_splats(asset.write(tmp_path / "a.glb"))
    asset = scene_of(field)
    top = 0
    for _ in range(5000):
        top = asset.node(children=[top], translation=[0.001, 0, 0])
    asset.json["scenes"] = [{"nodes": [top]}]
    found = read(asset.write(tmp_path / "b.glb"))
    np.testing.assert_allclose(found.means, field.means + np.float32([5, 0, 0]), atol=1e-5)


def test_few_bytes_cannot_ask_for_splats_without_end(tmp_path: Path) -> None:
    asset = scene_of(random_splats(3000, degree=0))
    count = 1 << 20
    attributes = {"TRANSLATION": asset.accessor(np.zeros((count, 3)))}
    asset.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    path = asset.write(tmp_path / "a.glb")
    with pytest.raises(FieldError, match="its instances are 3145728000 splats, at most"):
        convert_splats(path, tmp_path / "b.ply")
    assert not (tmp_path / "b.ply").exists()
    asset = scene_of(random_splats(3))
    for accessor in asset.json["accessors"]:
        accessor.pop("bufferView")
        accessor["count"] = 1 << 40
    with pytest.raises(FieldError, match="an attribute has no values"):
        read_splats(asset.write(tmp_path / "c.glb"))


def test_a_far_node_keeps_its_place(tmp_path: Path) -> None:
    """A tile on the ellipsoid: small coordinates below a node 6,000 km away."""
    field = random_splats(30, degree=0)
    asset = scene_of(field)
    far = [1215012.25, -4736313.5, 4081605.75]
    asset.json["nodes"][0]["translation"] = far
    path = asset.write(tmp_path / "a.glb")
    with pytest.warns(UserWarning, match="far from the origin"):
        found = read_splats(path, axes="rdf")
    np.testing.assert_allclose(
        found.means.astype(float) + found.offset, field.means + np.array(far), atol=1e-6
    )
    write_splats(found, tmp_path / "b.glb", axes="rdf")
    with pytest.warns(UserWarning, match="far from the origin"):
        again = read_splats(tmp_path / "b.glb", axes="rdf")
    assert again.offset == found.offset
    np.testing.assert_allclose(again.means, found.means, atol=1e-6)
