"""Small Instant-NGP snapshots by an independent writer of the published layout."""

from __future__ import annotations

import gzip
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from hash_oracle import tcnn_levels
from nerfacto_files import flat

Array = np.ndarray[Any, Any]

LEVELS, FEATURES, LOG2, BASE, GROWTH = 4, 4, 9, 4, 2.0
HIDDEN = 16
CELLS = 128


def packed(value: Any) -> bytes:
    """MessagePack of plain values, as nlohmann::json writes it (maps in order of their keys)."""
    if value is None:
        return b"\xc0"
    if isinstance(value, bool):
        return b"\xc3" if value else b"\xc2"
    if isinstance(value, int):
        if 0 <= value < 128:
            return bytes([value])
        return struct.pack(">BQ", 0xCF, value) if value >= 0 else struct.pack(">Bq", 0xD3, value)
    if isinstance(value, float):
        single = abs(value) < 1e38 and struct.unpack(">f", struct.pack(">f", value))[0] == value
        return struct.pack(">Bf", 0xCA, value) if single else struct.pack(">Bd", 0xCB, value)
    if isinstance(value, str):
        raw = value.encode()
        return (bytes([0xA0 | len(raw)]) if len(raw) < 32 else struct.pack(">BH", 0xDA, len(raw))) + raw
    if isinstance(value, bytes):
        return struct.pack(">BI", 0xC6, len(value)) + value
    if isinstance(value, list):
        head = bytes([0x90 | len(value)]) if len(value) < 16 else struct.pack(">BH", 0xDC, len(value))
        return head + b"".join(map(packed, value))
    head = bytes([0x80 | len(value)]) if len(value) < 16 else struct.pack(">BH", 0xDE, len(value))
    return head + b"".join(packed(key) + packed(value[key]) for key in sorted(value))


def arrays(seed: int = 0) -> dict[str, Any]:
    """Matrices and table, float16 values."""
    rng = np.random.default_rng(seed)

    def dense(*shape: int) -> Array:
        return (rng.normal(size=shape) / np.sqrt(shape[-1])).astype(np.float16).astype(np.float32)

    entries = sum(level[2] for level in tcnn_levels(LEVELS, BASE, GROWTH, LOG2))
    return {
        "density": [dense(HIDDEN, LEVELS * FEATURES), dense(16, HIDDEN)],
        "rgb": [dense(HIDDEN, 32), dense(HIDDEN, HIDDEN), dense(3, HIDDEN)],
        "table": rng.normal(size=(entries, FEATURES)).astype(np.float16).astype(np.float32),
    }


def morton(i: int, j: int, k: int) -> int:
    """Index of a cell: bits of i, j, k in turn, i lowest."""
    return sum(
        (value >> bit & 1) << (3 * bit + axis) for axis, value in enumerate((i, j, k)) for bit in range(7)
    )


def snapshot(
    *,
    seed: int = 0,
    aabb_scale: int = 1,
    half: bool = True,
    grid: Array | None = None,
    hdr: bool = False,
    extra: int = 0,
) -> dict[str, Any]:
    """Content of a snapshot; `grid` [C, 128^3] holds the occupancy grid's densities in Morton order."""
    values = arrays(seed)
    networks = [flat(values["density"], 9.0), flat(values["rgb"], 9.0)]
    if extra:  # 32 inputs, learnt values, padding with ones
        first = np.full((HIDDEN, 48), 0.0, np.float32)
        first[:, :32] = values["rgb"][0]
        first[:, 32 : 32 + extra] = 7.0
        networks[1] = flat([first, *values["rgb"][1:]], 9.0)
    params = np.concatenate([*networks, values["table"].reshape(-1)])
    box = {"min": [0.5 - 0.5 * aabb_scale] * 3, "max": [0.5 + 0.5 * aabb_scale] * 3}
    network = {
        "otype": "FullyFusedMLP",
        "activation": "ReLU",
        "output_activation": "None",
        "n_neurons": HIDDEN,
    }
    directions = [{"otype": "SphericalHarmonics", "degree": 4, "n_dims_to_encode": 3}, {"otype": "Identity"}]
    return {
        "encoding": {
            "otype": "HashGrid", "n_levels": LEVELS, "n_features_per_level": FEATURES,
            "log2_hashmap_size": LOG2, "base_resolution": BASE, "per_level_scale": GROWTH, "n_pos_dims": 3,
        },
        "network": {**network, "n_hidden_layers": 1},
        "rgb_network": {**network, "n_hidden_layers": 2},
        "dir_encoding": {"otype": "Composite", "nested": directions},
        "loss": {"otype": "L2"},
        "snapshot": {
            "version": 1,
            "mode": "nerf",
            "n_params": len(params),
            "params_type": "__half" if half else "float",
            "params_binary": params.astype("<f2" if half else "<f4").tobytes(),
            "density_grid_size": CELLS,
            "density_grid_binary": b"" if grid is None else grid.astype("<f2").tobytes(),
            "background_color": [0.25, 0.5, 1.0, 1.0],
            "render_aabb": box,
            "render_aabb_to_local": np.eye(3).tolist(),
            "training_step": 100,
            "nerf": {
                "aabb_scale": aabb_scale,
                "dataset": {
                    "n_images": 1, "scale": 0.5, "offset": [0.5, 0.25, 0.5], "aabb_scale": aabb_scale,
                    "from_mitsuba": False, "is_hdr": hdr, "n_extra_learnable_dims": extra,
                    "xforms": [{"start": POSE, "end": POSE}],
                    "metadata": [{
                        "resolution": [8, 6], "focal_length": [7.0, 7.5], "principal_point": [0.5, 0.25],
                        "rolling_shutter": [0.0] * 4, "lens": None,
                    }],
                },
            },
        },
    }  # fmt: skip


POSE = [[0.0, -1.0, 0.0, 0.75], [0.0, 0.0, -1.0, 0.5], [1.0, 0.0, 0.0, 1.0]]
"""Camera [3,4] in NGP's space: that of the world's pose with the identity as rotation, at (1, 1, 0)."""


def write(path: Path, content: Any) -> Path:
    """A snapshot; .ingp is compressed."""
    data = packed(content)
    path.write_bytes(gzip.compress(data, 1) if path.suffix == ".ingp" else data)
    return path


def zipped(path: Path, content: Any) -> Path:
    """A snapshot compressed with zlib instead of gzip."""
    path.write_bytes(zlib.compress(packed(content), 1))
    return path
