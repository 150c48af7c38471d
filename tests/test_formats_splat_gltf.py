"""Properties of a .glb beside its splats: color spaces, a node's rotation, whole numbers."""

from __future__ import annotations

import json
import struct
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.fields.sh import C0, MAX_DEGREE, sh_basis
from cagefield.formats.splats.color_space import convert_harmonics_to_srgb, encode_srgb
from cagefield.formats.splats.splat_files import read_splats, write_splats
from cagefield.geometry.quaternions import rotation_matrices
from splat_scenes import assert_same_splats, random_splats

EXTENSION = "KHR_gaussian_splatting"


def changed(path: Path, change: Callable[[dict[str, Any]], Any], extra: bytes = b"") -> Path:
    """The file, its JSON changed, with more bytes at the end of its binary part."""
    content = path.read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    gltf, binary = json.loads(content[20 : 20 + length]), content[28 + length :] + extra
    gltf["buffers"][0]["byteLength"] = len(binary)
    change(gltf)
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<IIIII", 0x46546C67, 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A)
    path.write_bytes(head + text + struct.pack("<II", len(binary), 0x004E4942) + binary)
    return path


def in_space(path: Path, space: str | None) -> Path:
    """The file with another color space, or with none."""

    def change(gltf: dict[str, Any]) -> None:
        extension = gltf["meshes"][0]["primitives"][0]["extensions"][EXTENSION]
        extension.pop("colorSpace") if space is None else extension.update(colorSpace=space)

    return changed(path, change)


def colors(sh: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Colors [N,D,3] along directions [D,3]."""
    degree = int(np.sqrt(sh.shape[1])) - 1
    return 0.5 + np.einsum("dk,nkc->ndc", sh_basis(directions, degree), np.asarray(sh, np.float64))


def directions(count: int = 30) -> np.ndarray:
    d = np.random.default_rng(1).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def test_srgb_is_as_its_standard_says() -> None:
    # Of 8 bits: 0, 1, 10, 11, 118, 188, 255, of tables of the standard; beyond 1 the curve goes on.
    linear = [-0.1, 0.0, 0.000303527, 0.003035270, 0.003346536, 0.181164244, 0.502886458, 1.0, 2.0]
    expected = [0.0, 0.0, *(np.array([1, 10, 11, 118, 188, 255]) / 255.0), 1.055 * 2.0 ** (1 / 2.4) - 0.055]
    np.testing.assert_allclose(encode_srgb(np.array(linear)), expected, atol=1e-7)


def test_linear_light_becomes_srgb(tmp_path: Path) -> None:
    field = random_splats(50, degree=0)
    write_splats(field, tmp_path / "a.glb")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert_same_splats(read_splats(tmp_path / "a.glb"), field, atol=1e-6)
        assert_same_splats(read_splats(in_space(tmp_path / "a.glb", None)), field, atol=1e-6)
    with pytest.warns(UserWarning, match="its colors are linear light; they become sRGB splat by splat"):
        read = read_splats(in_space(tmp_path / "a.glb", "lin_rec709_display"))
    linear = np.maximum(0.5 + C0 * field.sh[:, 0].astype(float), 0.0)
    np.testing.assert_allclose(0.5 + C0 * read.sh[:, 0], encode_srgb(linear), atol=1e-6)
    assert_same_splats(replace(read, sh=field.sh), field, atol=1e-6)
    with pytest.warns(UserWarning, match="its color space 'acescg' is not known and taken as srgb_rec709"):
        assert_same_splats(read_splats(in_space(tmp_path / "a.glb", "acescg")), field, atol=1e-6)


@pytest.mark.parametrize("degree", range(1, MAX_DEGREE + 1))
def test_harmonics_of_linear_light_become_those_of_srgb(degree: int) -> None:
    chance = np.random.default_rng(0)
    sh = chance.normal(size=(20, (degree + 1) ** 2, 3))
    sh[:, 0] = chance.uniform(-1.0, 1.0, (20, 3))
    # What varies little is encoded as by its tangent: the error falls with the square of the variation.
    errors = []
    for size in (0.02, 0.01, 0.005):
        small = np.concatenate([sh[:, :1], size * sh[:, 1:]], axis=1)
        exact = encode_srgb(colors(small, directions()))
        errors.append(np.abs(colors(convert_harmonics_to_srgb(small), directions()) - exact).max())
    assert errors[0] < 0.02
    assert 3.5 < errors[0] / errors[1] < 4.6 and 3.5 < errors[1] / errors[2] < 4.6
    # No other harmonics are nearer over all directions: small changes of any one add to the squared error.
    d = Rotation.random(4000, random_state=2).as_matrix()[:, 0]
    exact = encode_srgb(colors(0.1 * sh, d))
    best = convert_harmonics_to_srgb(0.1 * sh)
    least = np.square(colors(best, d) - exact).mean(axis=(1, 2))
    for _ in range(20):
        other = best + 0.05 * chance.normal(size=best.shape)
        assert (np.square(colors(other, d) - exact).mean(axis=(1, 2)) > least).all()


def test_a_node_turns_splats_and_their_harmonics(tmp_path: Path) -> None:
    field = random_splats(40, degree=min(3, MAX_DEGREE))
    write_splats(field, tmp_path / "a.glb", axes="rdf")
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    node = {"rotation": turn.as_quat().tolist(), "translation": [1, 2, 3], "scale": [2, 2, 2]}
    read = read_splats(changed(tmp_path / "a.glb", lambda gltf: gltf["nodes"][0].update(node)), axes="rdf")
    R = turn.as_matrix()
    np.testing.assert_allclose(read.means, 2.0 * field.means @ R.T + [1, 2, 3], atol=1e-5)
    np.testing.assert_allclose(
        rotation_matrices(read.quaternions.astype(float)),
        R @ rotation_matrices(field.quaternions.astype(float)),
        atol=1e-5,
    )
    seen = colors(field.sh, directions())
    np.testing.assert_allclose(colors(read.sh, directions() @ R.T), seen, atol=1e-5)


@pytest.mark.parametrize(("normalized", "factor"), [(True, 1.0 / 255.0), (False, 1.0)])
def test_scales_may_be_whole_numbers_or_shares(tmp_path: Path, normalized: bool, factor: float) -> None:
    field = random_splats(10, degree=0)
    write_splats(field, tmp_path / "a.glb")
    codes = np.random.default_rng(0).integers(1, 256, (10, 3)).astype(np.uint8)
    extra = np.concatenate([codes, np.zeros((10, 1), np.uint8)], axis=1).tobytes()

    def change(gltf: dict[str, Any]) -> None:
        begin = gltf["buffers"][0]["byteLength"] - len(extra)
        number = gltf["meshes"][0]["primitives"][0]["attributes"][f"{EXTENSION}:SCALE"]
        view = {"buffer": 0, "byteOffset": begin, "byteLength": len(extra), "byteStride": 4}
        gltf["bufferViews"][gltf["accessors"][number]["bufferView"]] = view
        gltf["accessors"][number] |= {"componentType": 5121, "normalized": normalized}

    read = read_splats(changed(tmp_path / "a.glb", change, extra))
    np.testing.assert_allclose(np.exp(read.log_scales), codes * factor, rtol=1e-5)
