"""Instant-NGP snapshots by an independent writer against scalar loops; MessagePack; the ray lattice."""

from __future__ import annotations

import gzip
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

import torch

import ngp_files as files
from cagefield.cameras.camera import Camera
from cagefield.errors import FieldError
from cagefield.fields.external.external_file import load_external, save_external
from cagefield.fields.external.instant_ngp import InstantNgpField
from cagefield.fields.external.instant_ngp_parameters import STEP
from cagefield.files import msgpack
from cagefield.formats.external.checkpoint import ExternalCheckpoint
from cagefield.formats.external.read_external import read_external
from cagefield.rendering.external.external_renderer import ExternalRenderer
from hash_oracle import PHASE, harmonics, perceptron, sigmoid, tcnn_features, tcnn_levels

Array = np.ndarray[Any, Any]

# float32 sums of a few hundred products of size 1
TOLERANCE = 2e-5

# world positions whose NGP coordinates (y, z, x) / 2 + (.25, .5, .5) lie in the unit cube
POSITIONS = np.array([[0.3, 0.2, -0.5], [-0.9, 1.4, 0.8], [0.01, -0.4, 0.2]], np.float32)
DIRECTIONS = np.array([[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.48, 0.6, 0.64]], np.float32)


def read(path: Path) -> ExternalCheckpoint:
    found = read_external(path)
    assert found is not None and isinstance(found.field, InstantNgpField)
    return found


def oracle(p: Array, d: Array, aabb_scale: int = 1) -> tuple[float, Array]:
    """(sigma per world unit, raw color outputs) of the writer's parameters."""
    values = files.arrays()
    x, y, z = (0.5 * float(a) + o for a, o in zip(p, (0.5, 0.25, 0.5), strict=True))
    unit = (np.array([y, z, x]) - 0.5) / aabb_scale + 0.5
    levels = tcnn_levels(files.LEVELS, files.BASE, files.GROWTH, files.LOG2)
    hidden = perceptron(tcnn_features(unit, values["table"], levels), values["density"])
    basis = PHASE * harmonics(d[[1, 2, 0]])
    return 0.5 * math.exp(hidden[0]), perceptron(np.concatenate([hidden, basis]), values["rgb"])


@pytest.mark.parametrize("half", [True, False])
@pytest.mark.parametrize("name", ["a.ingp", "a.msgpack", "a.bin"])
def test_density_and_color_are_those_of_scalar_loops(tmp_path: Path, name: str, half: bool) -> None:
    found = read(files.write(tmp_path / name, files.snapshot(half=half)))
    sigma, rgb = found.field(POSITIONS, DIRECTIONS)
    for row, (p, d) in enumerate(zip(POSITIONS, DIRECTIONS, strict=True)):
        expected, color = oracle(p, d)
        assert sigma[row] == pytest.approx(expected, rel=20 * TOLERANCE)
        assert rgb[row] == pytest.approx(sigmoid(color), abs=TOLERANCE)
    assert any("no file that it wrote" in note for note in found.notes)


def test_zlib_is_read_too(tmp_path: Path) -> None:
    found = read(files.zipped(tmp_path / "a.ingp", files.snapshot()))
    assert found.field(POSITIONS, DIRECTIONS)[0][0] == pytest.approx(oracle(POSITIONS[0], DIRECTIONS[0])[0])


def test_learnt_values_of_photos_are_zero_and_padding_is_one(tmp_path: Path) -> None:
    found = read(files.write(tmp_path / "a.ingp", files.snapshot(extra=5)))
    plain = sigmoid(oracle(POSITIONS[0], DIRECTIONS[0])[1])
    assert found.field(POSITIONS, DIRECTIONS)[1][0] == pytest.approx(plain, abs=TOLERANCE)
    assert any("5 learnt values" in note for note in found.notes)


def test_colors_of_high_dynamic_range_are_encoded(tmp_path: Path) -> None:
    found = read(files.write(tmp_path / "a.ingp", files.snapshot(hdr=True)))
    linear = np.minimum(np.exp(oracle(POSITIONS[1], DIRECTIONS[1])[1]), 1.0)
    srgb = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert found.field(POSITIONS, DIRECTIONS)[1][1] == pytest.approx(srgb, abs=TOLERANCE)


def test_a_larger_cube_is_mapped_to_the_unit_cube(tmp_path: Path) -> None:
    found = read(files.write(tmp_path / "a.ingp", files.snapshot(aabb_scale=4)))
    p = np.array([[3.0, -2.0, 1.5]], np.float32)
    assert found.field(p, DIRECTIONS[:1])[0][0] == pytest.approx(
        oracle(p[0], DIRECTIONS[0], 4)[0], rel=20 * TOLERANCE
    )
    assert found.field.bounds[0] == pytest.approx([-4.0, -3.5, -4.0])
    assert found.field.bounds[1] == pytest.approx([4.0, 4.5, 4.0])


def test_occupancy_is_read_in_morton_order_and_pooled(tmp_path: Path) -> None:
    grid = np.zeros((2, files.CELLS**3), np.float32)
    full, coarse = (10, 20, 30), (3, 100, 64)
    grid[0, files.morton(*full)] = 1e4  # its mean is far above .01
    grid[1, files.morton(*coarse)] = 0.02
    found = read(files.write(tmp_path / "a.ingp", files.snapshot(aabb_scale=2, grid=grid)))
    assert isinstance(found.field, InstantNgpField)
    bits = np.unpackbits(found.field.occupancy, axis=1, bitorder="little").reshape(2, 128, 128, 128)
    cells = [tuple(int(i) for i in cell) for cell in np.argwhere(bits)]
    # cell (10, 20, 30) of the inner cube lies in cell 32 + (10, 20, 30) // 2 of the outer one
    assert cells == [(0, *full), (1, *coarse), (1, 37, 42, 47)]
    inner = (np.array(full) + 0.5) / 128
    outer = ((np.array(coarse) + 0.5) / 128 - 0.5) * 2 + 0.5
    beside = inner + np.array([1 / 128, 0, 0])
    world = found.field.to_world(np.stack([inner, outer, beside]))
    sigma = found.field(world, DIRECTIONS)[0]
    assert sigma[0] > 0.0 and sigma[1] > 0.0 and sigma[2] == 0.0


def test_the_crop_box_ends_the_field(tmp_path: Path) -> None:
    content = files.snapshot()
    content["snapshot"]["render_aabb"] = {"min": [0.25, 0.0, 0.0], "max": [0.75, 1.0, 1.0]}
    found = read(files.write(tmp_path / "a.ingp", content))
    assert isinstance(found.field, InstantNgpField)
    world = found.field.to_world(np.array([[0.26, 0.5, 0.5], [0.24, 0.5, 0.5], [0.5, 0.1, 0.9]]))
    sigma = found.field(world, DIRECTIONS)[0]
    assert sigma[0] > 0.0 and sigma[1] == 0.0 and sigma[2] > 0.0
    # NGP's x is the world's y
    assert found.field.bounds[:, 1] == pytest.approx([0.0, 1.0])


def test_training_cameras_are_in_the_worlds_coordinates(tmp_path: Path) -> None:
    found = read(files.write(tmp_path / "a.ingp", files.snapshot()))
    (camera,) = found.cameras
    assert camera.c2w == pytest.approx(np.array([[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1.0]]))
    assert (camera.width, camera.height, camera.fx, camera.fy) == (8, 6, 7.0, 7.5)
    assert (camera.cx, camera.cy) == (4.0, 1.5)
    assert found.background == (0.25, 0.5, 1.0)


@pytest.mark.parametrize("aabb_scale", [1, 16])
def test_samples_follow_the_recurrence_of_the_steps(tmp_path: Path, aabb_scale: int) -> None:
    found = read(files.write(tmp_path / "a.ingp", files.snapshot(aabb_scale=aabb_scale)))
    assert isinstance(found.field, InstantNgpField)
    origin, along = torch.tensor([[0.0, 0.3, 0.1]]), torch.tensor([[0.0, 0.0, -1.0]])
    samples = found.field.torch.ray_samples(origin, along, None, lambda _, t: torch.zeros_like(t))
    t, delta = (0.5 * values[0].double().numpy() for values in samples)  # NGP's units
    assert t[0] == pytest.approx(0.05, abs=2e-6)
    cone = 0.0 if aabb_scale == 1 else 1.0 / 256.0
    # Between STEP / log(1 + c) and its last, a step is c t; below, STEP
    expected = np.maximum(STEP, cone * t)
    below, above = (
        (t < 0.99 * STEP / math.log1p(1 / 256), t > 1.01 * STEP / math.log1p(1 / 256))
        if cone
        else (t >= 0, t < 0)
    )
    assert delta[below] == pytest.approx(expected[below], rel=1e-5)
    if cone:
        assert above.any()
        assert delta[above] == pytest.approx(expected[above], rel=1e-5)
    # the ray leaves the cube half an edge behind its middle
    leave = 0.5 * 0.1 + 0.5 * aabb_scale
    assert t[-1] <= leave + 2 * delta[-1] and t[-1] + delta[-1] >= leave


def test_a_field_file_keeps_everything(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    grid = (rng.random((1, files.CELLS**3)) < 0.5).astype(np.float32)
    field = read(files.write(tmp_path / "a.ingp", files.snapshot(grid=grid))).field
    assert isinstance(field, InstantNgpField)
    save_external(field, tmp_path / "field.safetensors")
    loaded = load_external(tmp_path / "field.safetensors", InstantNgpField.KIND)
    pose = np.eye(4)
    pose[2, 3] = 3.0
    camera = Camera.from_fov(pose, 4, 3, 0.6)
    pictures = [ExternalRenderer(one).render(camera).rgb for one in (field, loaded)]
    assert np.array_equal(*pictures) and pictures[0].std() > 0.01


def test_messagepack_values() -> None:
    value = {"a": [1, -5, 300, -70000, 1.5, 0.1, None, True, "é"], "b": {"c": b"xyz"}, "d": list(range(40))}
    found = msgpack.loads(files.packed(value))
    assert bytes(found["b"].pop("c")) == b"xyz"
    assert found == {**value, "b": {}}
    raws = (b"\xff", b"\xd0\x80", b"\xcd\x01\x00", b"\xcb" + struct.pack(">d", 2))
    assert [msgpack.loads(raw) for raw in raws] == [-1, -128, 256, 2.0]


@pytest.mark.parametrize(
    ("raw", "message"),
    [
        (b"\xdf\xff\xff\xff\xff", "amid a map"),
        (b"\xdd\x7f\xff\xff\xff", "amid a list"),
        (b"\xc6\x7f\xff\xff\xff", "ends at byte"),
        (b"\x91" * 200 + b"\x00", "nested too deeply"),
        (b"\x81\x00\x00", "a key is a int"),
        (b"\x00\x00", "1 bytes follow"),
        (b"\xc1", "begins no value"),
        (b"\xa2\xff\xfe", "utf-8"),
    ],
)
def test_hostile_messagepack_is_refused(raw: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        msgpack.loads(raw)


def test_a_bomb_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from cagefield.formats.external import instant_ngp

    monkeypatch.setattr(instant_ngp, "MIN_BYTES", 1 << 20)
    (tmp_path / "a.ingp").write_bytes(gzip.compress(bytes(200 << 20)))
    with pytest.raises(FieldError, match="unpacks to more than"):
        read_external(tmp_path / "a.ingp")


def test_a_truncated_file_is_named(tmp_path: Path) -> None:
    path = files.write(tmp_path / "a.ingp", files.snapshot())
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(FieldError, match="cut off"):
        read_external(path)


@pytest.mark.parametrize(
    ("where", "value", "message"),
    [
        ("encoding.otype", "Frequency", "only HashGrid"),
        ("encoding.n_levels", 5, "fewer than its options"),
        ("encoding.n_levels", 3, "expected|more than its options|has"),
        ("encoding.per_level_scale", 1e300, "per_level_scale"),
        ("encoding.log2_hashmap_size", 40, "log2_hashmap_size"),
        ("network.activation", "Sine", "activations"),
        ("network.otype", "Other", "FullyFusedMLP"),
        ("rgb_network.n_neurons", 1 << 20, "n_neurons"),
        ("dir_encoding.otype", "OneBlob", None),
        ("dir_encoding.nested", [], "dir_encoding"),
        ("snapshot.mode", "sdf", "mode sdf"),
        ("snapshot.version", 0, "old version"),
        ("snapshot.params_type", "double", "params_type"),
        ("snapshot.params_binary", b"abc", "whole number of values"),
        ("snapshot.n_params", 7, "n_params is 7"),
        ("snapshot.density_grid_binary", b"abcd", "2 cells"),
        ("snapshot.density_grid_size", 64, "density_grid_size"),
        ("snapshot.nerf.aabb_scale", 3, "power of two"),
        ("snapshot.nerf.aabb_scale", -1, "aabb_scale"),
        ("snapshot.nerf.dataset.scale", 0.0, "scale"),
        ("snapshot.nerf.dataset.offset", [1.0], "offset"),
        ("snapshot.render_aabb_to_local", [[2.0, 0, 0], [0, 1, 0], [0, 0, 1]], "rotation"),
        ("snapshot", 5, "snapshot must be a mapping"),
    ],
)
def test_values_that_do_not_fit_are_named(
    tmp_path: Path, where: str, value: Any, message: str | None
) -> None:
    content = files.snapshot()
    part = content
    *path, name = where.split(".")
    for key in path:
        part = part[key]
    part[name] = value
    file = files.write(tmp_path / "a.ingp", content)
    if message is None:
        read(file)
        return
    with pytest.raises(FieldError, match=message) as caught:
        read_external(file)
    assert "\n" not in str(caught.value) and str(caught.value).startswith(str(file))
