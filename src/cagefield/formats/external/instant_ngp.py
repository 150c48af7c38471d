"""Instant-NGP snapshots, .ingp and .msgpack: a network config in MessagePack with the key "snapshot".

    {"encoding": {...}, "network": {...}, "rgb_network": {...}, "dir_encoding": {...},
     "snapshot": {"n_params", "params_type": "__half" | "float", "params_binary", "density_grid_size": 128,
                  "density_grid_binary": float16, "nerf": {"aabb_scale", "dataset": {...}}, "render_aabb",
                  "render_aabb_to_local", "background_color", ...}}

.ingp is the same, compressed with gzip or zlib. Parameters are flat: density network, color network, hash
grid. Densities of the occupancy grid lie in Morton order, cascade after cascade; a cell is occupied above
min(0.01, mean of the first cascade), or where one of the 8 cells of the finer cascade in it is.

No file that Instant-NGP wrote was at hand: the reader follows the published source.
Source: github.com/NVlabs/instant-ngp, src/testbed.cu (save_snapshot), json_binding.h, nerf_network.h.
"""

from __future__ import annotations

import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.errors import CameraError, FieldError
from cagefield.fields.external.external_field import frozen_array, number, whole_number
from cagefield.fields.external.hash_grid import HashGrid, expected_entries
from cagefield.fields.external.hash_network import HashNetwork, Layers
from cagefield.fields.external.instant_ngp import InstantNgpField
from cagefield.fields.external.instant_ngp_parameters import CASCADE_BYTES, DIRECTION_TERMS, GRID_CELLS
from cagefield.files import msgpack
from cagefield.files.memory import memory_shortage
from cagefield.files.safe_open import UnreadableError, check_regular, open_regular
from cagefield.formats.external.checkpoint import ExternalCheckpoint, format_names
from cagefield.formats.external.tcnn_parameters import FlatParameters, padded

SUFFIXES = (".ingp", ".msgpack")

MAX_BYTES = 4 << 30
MAX_RATIO = 256
"""Maximum ratio of unpacked to packed bytes beyond the first MIN_BYTES; trained parameters hardly shrink."""
MIN_BYTES = 64 << 20

OCCUPIED_DENSITY = 0.01
DENSITY_OUTPUTS = 16
_COMPRESSED = (b"\x1f\x8b", b"\x78\x01", b"\x78\x5e", b"\x78\x9c", b"\x78\xda")
_ALIGNMENTS = {"fullyfusedmlp": 16, "megakernelmlp": 16, "cutlassmlp": 8}


def is_instant_ngp(path: Path) -> bool:
    """Whether a file's name, or its beginning, is that of a snapshot."""
    if path.suffix.lower() in SUFFIXES:
        return True
    try:
        with open_regular(path) as file:
            start = file.read(8)
    except OSError:
        return False
    # a map whose first key is a short text
    key = {0xDE: 3, 0xDF: 5}.get(start[0], 1 if 0x80 < start[0] <= 0x8F else 8) if start else 8
    return len(start) > key + 1 and 0xA1 <= start[key] <= 0xBF and start[key + 1 :].isascii()


def read_instant_ngp(path: Path) -> ExternalCheckpoint:
    """Field and training cameras of a snapshot.

    Raises:
        FieldError: missing or damaged file, other networks or encodings than those of NeRFs, parameters that
            do not fit the config.
    """
    config = _mapping("the snapshot", _unpacked(path))
    if "snapshot" not in config:
        raise FieldError(f"it holds {format_names(config)}, no snapshot; save one in Instant-NGP")
    snapshot = _mapping("snapshot", config["snapshot"])
    mode = str(snapshot.get("mode", "nerf")).lower()
    if mode != "nerf" or "nerf" not in snapshot:
        raise FieldError(
            f"a snapshot of Instant-NGP in mode {mode:.20}; only NeRFs are read, save a snapshot of one"
        )
    if whole_number("version", snapshot.get("version", 0), 0, 1 << 30) < 1:
        raise FieldError("a snapshot of an old version of Instant-NGP; save it again with a newer one")
    nerf = _mapping("nerf", snapshot["nerf"])
    dataset = _mapping("dataset", nerf.get("dataset", {}))
    aabb_scale = whole_number("aabb_scale", nerf.get("aabb_scale", dataset.get("aabb_scale", 1)), 1, 128)
    notes = ["Instant-NGP: read by its published layout; no file that it wrote was at hand to compare with"]
    extra = whole_number("n_extra_learnable_dims", dataset.get("n_extra_learnable_dims", 0), 0, 1 << 10)
    if extra:
        notes.append(f"left out: {extra} learnt values of each photo, taken as 0")
    base, head = _networks(config, snapshot, aabb_scale, extra)
    crop, axes = _crop(snapshot, aabb_scale)
    hdr = bool(dataset.get("is_hdr", False))
    if hdr:
        notes.append("trained on photos of high dynamic range: colors are clamped to 1 and encoded as sRGB")
    field = InstantNgpField(
        base,
        head,
        crop,
        axes,
        _occupancy(snapshot, aabb_scale),
        aabb_scale=aabb_scale,
        scale=number("scale", dataset.get("scale", 0.33), 1e-9, 1e9),
        offset=tuple(frozen_array("offset", dataset.get("offset", [0.5] * 3), np.float64, (3,)).tolist()),
        cycled=not dataset.get("from_mitsuba", False),
        hdr=hdr,
    )
    cameras = _cameras(dataset, field, notes)
    color = frozen_array("background_color", snapshot.get("background_color", [0.0] * 4), np.float64, (None,))
    return ExternalCheckpoint(
        field,
        field.describe(),
        notes=tuple(notes),
        background=tuple(color[:3].clip(0.0, 1.0).tolist()) if len(color) >= 3 else (0.0, 0.0, 0.0),
        cameras=cameras,
    )


def _unpacked(path: Path) -> Any:
    """The value of the file, unpacked in bounded memory."""
    try:
        size = check_regular(path, MAX_BYTES)
        if (lacking := memory_shortage(2 * size)) is not None:
            raise FieldError(lacking)
        with open_regular(path) as file:
            content = file.read(size)
    except UnreadableError as error:
        raise FieldError(f"{error}") from None
    except OSError as error:
        raise FieldError(f"cannot be read ({error.strerror or error})") from None
    try:
        if content.startswith(_COMPRESSED):
            limit = min(MAX_BYTES, MIN_BYTES + MAX_RATIO * len(content))
            unpacker = zlib.decompressobj(wbits=zlib.MAX_WBITS | 32)
            content = _inflated(unpacker, content, limit)
        return msgpack.loads(content)
    except (ValueError, zlib.error) as error:
        raise FieldError(f"not a readable snapshot of Instant-NGP ({error!s:.120}); copy it again") from None


def _inflated(unpacker: Any, content: bytes, limit: int) -> bytes:
    """All unpacked bytes, at most `limit`; memory is checked while they grow."""
    parts, total = [], 0
    while not unpacker.eof:
        part = unpacker.decompress(content, 64 << 20)
        content = unpacker.unconsumed_tail
        total += len(part)
        if total > limit:
            raise ValueError(f"it unpacks to more than {limit} bytes")
        if (lacking := memory_shortage(2 * total)) is not None:
            raise ValueError(lacking)
        if not part and not content and not unpacker.eof:
            raise ValueError("it is cut off")
        parts.append(part)
    return b"".join(parts)


def _networks(
    config: dict[str, Any], snapshot: dict[str, Any], aabb_scale: int, extra: int
) -> tuple[HashNetwork, Layers]:
    """(density network over its hash grid, color network) of the flat parameters."""
    encoding = _mapping("encoding", config.get("encoding"))
    if _name(encoding, "otype") not in ("hashgrid", "grid") or _name(encoding, "type", "hash") != "hash":
        raise FieldError(
            f"encoding is {_name(encoding, 'otype')!r:.40}; only HashGrid is read, train with base.json"
        )
    if _name(encoding, "interpolation", "linear") != "linear":
        raise FieldError(f"interpolation is {_name(encoding, 'interpolation')!r:.40}; only Linear is read")
    if _name(encoding, "hash", "coherentprime") != "coherentprime":
        raise FieldError(f"hash is {_name(encoding, 'hash')!r:.40}; only CoherentPrime is read")
    features = whole_number("n_features_per_level", encoding.get("n_features_per_level", 2), 1, 8)
    levels = whole_number("n_levels", encoding.get("n_levels", 16), 1, 128)
    if encoding.get("n_features"):
        levels = whole_number("n_features", encoding["n_features"], features, 1 << 10) // features
    log2_size = whole_number("log2_hashmap_size", encoding.get("log2_hashmap_size", 15), 1, 30)
    base = encoding.get("base_resolution") or 1 << (log2_size // 3)
    base = whole_number("base_resolution", base, 1, 1 << 16)
    growth = number("per_level_scale", encoding.get("per_level_scale", 0.0), 0.0, 1e4)
    if growth <= 0.0:
        growth = math.exp(math.log(2048.0 * aabb_scale / base) / max(1, levels - 1))
    _check_directions(_mapping("dir_encoding", config.get("dir_encoding")))
    density, color = (_mapping(name, config.get(name)) for name in ("network", "rgb_network"))
    flat = FlatParameters(_parameters(snapshot), "params_binary")
    outputs = whole_number("n_output_dims", density.get("n_output_dims", DENSITY_OUTPUTS), 1, 1 << 10)
    layers = _layers(flat, density, levels * features, levels * features, outputs, 0.0)
    # Outputs are padded, and all of them are inputs of the color network.
    alignment = _alignment(density)
    if outputs % alignment:
        raise FieldError(f"n_output_dims of network is {outputs}; it must be a multiple of {alignment}")
    inputs = outputs + DIRECTION_TERMS + extra
    head = _layers(flat, color, inputs, inputs, 3, 1.0)
    (weight, bias), *more = head
    # Learnt values of photos are 0: their columns add nothing.
    head = ((np.ascontiguousarray(weight[:, : outputs + DIRECTION_TERMS]), bias), *more)
    entries = expected_entries("tcnn", levels, base, growth, log2_size)
    table = flat.matrix(entries, features)
    flat.check_end()
    return HashNetwork(HashGrid(table, "tcnn", levels, base, growth, log2_size), layers), head


def _layers(
    flat: FlatParameters, network: dict[str, Any], stored: int, inputs: int, outputs: int, padding: float
) -> Layers:
    alignment = _alignment(network)
    if (
        _name(network, "activation", "relu") != "relu"
        or _name(network, "output_activation", "none") != "none"
    ):
        raise FieldError("networks of Instant-NGP are read with the activations ReLU and None, got others")
    width = whole_number("n_neurons", network.get("n_neurons", 128), 1, 1 << 12)
    hidden = whole_number("n_hidden_layers", network.get("n_hidden_layers", 2), 0, 32)
    return flat.layers(padded(stored, alignment), inputs, width, hidden, outputs, alignment, padding)


def _alignment(network: dict[str, Any]) -> int:
    name = _name(network, "otype")
    if name not in _ALIGNMENTS:
        raise FieldError(f"otype of a network is {name!r:.40}; FullyFusedMLP and CutlassMLP are read")
    return _ALIGNMENTS[name]


def _check_directions(encoding: dict[str, Any]) -> None:
    """Raises FieldError for anything but spherical harmonics of degree 4 (16 terms), alone or first."""
    nested = encoding.get("nested", [encoding])
    first = nested[0] if isinstance(nested, list) and nested else None
    if (
        not isinstance(first, dict)
        or _name(first, "otype") != "sphericalharmonics"
        or first.get("degree", 4) != 4
        or any(not isinstance(more, dict) or _name(more, "otype") != "identity" for more in nested[1:])
    ):
        raise FieldError(
            "dir_encoding must be SphericalHarmonics of degree 4, with Identity after it or alone"
        )


def _parameters(snapshot: dict[str, Any]) -> NDArray[Any]:
    kind = snapshot.get("params_type", "__half")
    dtypes = {"__half": "<f2", "float": "<f4"}
    if kind not in dtypes:
        raise FieldError(f"params_type is {kind!r:.40}; expected __half or float")
    values = _array("params_binary", snapshot.get("params_binary"), dtypes[kind])
    count = whole_number("n_params", snapshot.get("n_params", len(values)), 0, 1 << 40)
    if count != len(values):
        raise FieldError(f"params_binary has {len(values)} values, n_params is {count}; copy the file again")
    return values


def _occupancy(snapshot: dict[str, Any], aabb_scale: int) -> NDArray[np.uint8] | None:
    """Packed bits [C, 128^3/8] of cells in x, y, z order; None for a grid that was never filled."""
    if snapshot.get("density_grid_size", GRID_CELLS) != GRID_CELLS:
        raise FieldError(f"density_grid_size must be {GRID_CELLS}, got {snapshot['density_grid_size']!r:.20}")
    values = _array("density_grid_binary", snapshot.get("density_grid_binary", b""), "<f2")
    if not len(values):
        return None
    cells, cascades = GRID_CELLS**3, aabb_scale.bit_length()
    if len(values) != cells * cascades:
        raise FieldError(
            f"density_grid_binary has {len(values)} cells; aabb_scale {aabb_scale} takes {cascades} "
            f"cascades of {cells}"
        )
    order = _morton_order()
    densities = values.reshape(cascades, cells)
    mean = float(np.maximum(densities[0].astype(np.float32), 0.0).mean(dtype=np.float64))
    packed = np.empty((cascades, CASCADE_BYTES), np.uint8)
    finer: NDArray[np.bool_] | None = None
    half, quarter = GRID_CELLS // 2, GRID_CELLS // 4
    for cascade in range(cascades):
        bits = (densities[cascade][order] > min(OCCUPIED_DENSITY, mean)).reshape((GRID_CELLS,) * 3)
        if finer is not None:
            pooled = finer.reshape(half, 2, half, 2, half, 2).any(axis=(1, 3, 5))
            middle = slice(quarter, quarter + half)
            bits[middle, middle, middle] |= pooled
        packed[cascade] = np.packbits(bits, bitorder="little")
        finer = bits
    return packed


def _morton_order() -> NDArray[np.int64]:
    """Morton index of each cell in x, y, z order; the bits of x are the lowest."""
    spread = np.zeros(GRID_CELLS, np.int64)
    cell = np.arange(GRID_CELLS)
    for bit in range(7):
        spread |= (cell >> bit & 1) << (3 * bit)
    return (spread[:, None, None] | spread[:, None] << 1 | spread << 2).reshape(-1)


def _crop(snapshot: dict[str, Any], aabb_scale: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(crop box [2,3], rotation to its axes [3,3]) of the picture in NGP's space."""
    cube = np.array([[0.5 - 0.5 * aabb_scale] * 3, [0.5 + 0.5 * aabb_scale] * 3])
    axes = frozen_array(
        "render_aabb_to_local", snapshot.get("render_aabb_to_local", np.eye(3)), float, (3, 3)
    )
    box = snapshot.get("render_aabb")
    if box is None:
        return cube, axes
    box = _mapping("render_aabb", box)
    corners = frozen_array("render_aabb", [box.get("min"), box.get("max")], np.float64, (2, 3))
    return (corners if (corners[0] < corners[1]).all() else cube), axes


def _cameras(dataset: dict[str, Any], field: InstantNgpField, notes: list[str]) -> tuple[Camera, ...]:
    """The training cameras in the field's world; a note tells of lenses that are not read."""
    poses, lenses = dataset.get("xforms", []), dataset.get("metadata", [])
    if not isinstance(poses, list) or not isinstance(lenses, list) or len(poses) != len(lenses):
        notes.append("left out: the training cameras, whose poses and lenses differ in number")
        return ()
    cameras, skipped = [], 0
    for pose, lens in zip(poses, lenses, strict=True):
        try:
            cameras.append(_camera(_mapping("xforms", pose), _mapping("metadata", lens), field))
        except (CameraError, FieldError, KeyError, TypeError):
            skipped += 1
    if skipped:
        notes.append(f"left out: {skipped} of {len(poses)} training cameras, whose lens or pose is not read")
    return tuple(cameras)


def _camera(pose: dict[str, Any], lens: dict[str, Any], field: InstantNgpField) -> Camera:
    matrix = frozen_array("xforms", pose["start"], np.float64, (3, 4))
    size = frozen_array("resolution", lens["resolution"], np.float64, (2,))
    focal = frozen_array("focal_length", lens["focal_length"], np.float64, (2,))
    center = frozen_array("principal_point", lens["principal_point"], np.float64, (2,)) * size
    c2w = np.eye(4)
    c2w[:3, 3] = field.to_world(matrix[:, 3])
    if field.cycled:
        c2w[:3, :3] = matrix[[2, 0, 1], :3] * np.array([1.0, -1.0, -1.0])
    else:  # the axes x and z of Mitsuba's cameras are turned around besides
        c2w[:3, :3] = matrix[:, :3] * np.array([-1.0, -1.0, 1.0])
    model, coefficients = _lens(_mapping("lens", lens.get("lens") or {}))
    width, height = (int(edge) for edge in size)
    (fx, fy), (cx, cy) = focal.tolist(), center.tolist()
    return Camera(c2w, width, height, fx, fy, cx, cy, model=model, distortion=coefficients)


def _lens(lens: dict[str, Any]) -> tuple[Any, tuple[float, ...]]:
    if not lens:
        return "pinhole", ()
    if "k1" not in lens:
        raise CameraError("lens is not read")
    names = ("k1", "k2", "k3", "k4") if lens.get("is_fisheye") else ("k1", "k2", "p1", "p2")
    model = "opencv_fisheye" if lens.get("is_fisheye") else "opencv"
    return model, tuple(number(name, lens[name], -1e3, 1e3) for name in names)


def _array(name: str, value: Any, dtype: str) -> NDArray[Any]:
    if isinstance(value, dict) and isinstance(value.get("bytes"), list):
        try:
            value = bytes(value["bytes"])  # a binary that went through JSON
        except (TypeError, ValueError):
            raise FieldError(f'{name}: "bytes" must be numbers from 0 to 255') from None
    if not isinstance(value, (bytes, memoryview)):
        raise FieldError(f"{name} must be a binary, got {type(value).__name__}")
    if len(value) % np.dtype(dtype).itemsize:
        raise FieldError(f"{name} has {len(value)} bytes, which are no whole number of values")
    return np.frombuffer(value, dtype)


def _mapping(name: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise FieldError(
            f"{name} must be a mapping, got {type(value).__name__}; is it a snapshot of Instant-NGP?"
        )
    return value


def _name(values: dict[str, Any], key: str, default: str = "") -> str:
    """Name of a kind in lower case, as Instant-NGP compares names."""
    return str(values.get(key, default)).lower()
