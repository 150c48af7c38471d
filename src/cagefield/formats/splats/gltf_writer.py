"""Writer of splats as glTF (.glb) with the extension KHR_gaussian_splatting; see `gltf`."""

from __future__ import annotations

import json
import struct
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.files.atomic import replaced_file
from cagefield.formats.splats.gltf import EXTENSION, SRGB, harmonic_names
from cagefield.formats.splats.gltf_buffers import BIN_CHUNK, JSON_CHUNK, MAGIC
from cagefield.formats.splats.splat_table import OnProgress, SplatTable


def write_splat_gltf(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Write splats in glTF's axes as one .glb file, complete or not at all.

    The table's offset becomes the translation of the splats' node.
    """
    count = table.count
    attributes = [("POSITION", 3), (f"{EXTENSION}:ROTATION", 4), (f"{EXTENSION}:SCALE", 3)]
    attributes += [(f"{EXTENSION}:OPACITY", 1)]
    attributes += ((name, 3) for name in harmonic_names(table.sh_degree))
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    with ExitStack() as stack:
        files = [stack.enter_context(tempfile.TemporaryFile()) for _ in attributes]
        done = 0
        for batch in table.batches():
            values = [batch.means, batch.quaternions[:, [1, 2, 3, 0]], np.exp(batch.log_scales)]
            values += [batch.opacities[:, None], *np.moveaxis(batch.sh, 1, 0)]
            for file, part in zip(files, values, strict=True):
                file.write(np.ascontiguousarray(part, "<f4").tobytes())
            means = batch.means.astype(np.float32)
            low, high = np.minimum(low, means.min(axis=0)), np.maximum(high, means.max(axis=0))
            done += len(batch)
            on_progress(0.6 * done / count)
        views, accessors, at = [], [], 0
        for number, (_, width) in enumerate(attributes):
            size = 4 * width * count
            views.append({"buffer": 0, "byteOffset": at, "byteLength": size, "target": 34962})
            kind = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[width]
            accessors.append({"bufferView": number, "componentType": 5126, "count": count, "type": kind})
            at += size
        accessors[0] |= {"min": low.tolist(), "max": high.tolist()}
        node: dict[str, Any] = {"mesh": 0}
        if any(table.offset):  # JSON holds it in double precision, attributes are float32
            node["translation"] = list(table.offset)
        gltf = {
            "asset": {"version": "2.0", "generator": "cagefield"},
            "extensionsUsed": [EXTENSION],
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [node],
            "meshes": [
                {
                    "primitives": [
                        {
                            "mode": 0,
                            "attributes": {name: number for number, (name, _) in enumerate(attributes)},
                            "extensions": {EXTENSION: {"kernel": "ellipse", "colorSpace": SRGB}},
                        }
                    ]
                }
            ],
            "buffers": [{"byteLength": at}],
            "bufferViews": views,
            "accessors": accessors,
        }
        text = json.dumps(gltf, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        with replaced_file(path) as temporary, temporary.open("wb") as out:
            out.write(struct.pack("<IIIII", MAGIC, 2, 28 + len(text) + at, len(text), JSON_CHUNK) + text)
            out.write(struct.pack("<II", at, BIN_CHUNK))
            for number, file in enumerate(files):
                file.seek(0)
                while part_of := file.read(1 << 22):
                    out.write(part_of)
                on_progress(0.6 + 0.4 * (number + 1) / len(files))
