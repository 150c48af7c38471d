"""glTF files of splats as other programs write them, piece by piece."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.fields.splat_field import SplatField

EXTENSION = "KHR_gaussian_splatting"
_CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


class Asset:
    """A glTF asset to which meshes and nodes are added; written as .glb, or as .gltf in two ways."""

    def __init__(self) -> None:
        self.binary = b""
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "extensionsUsed": [EXTENSION], "meshes": []}
        self.json |= {"nodes": [], "accessors": [], "bufferViews": []}

    def view(self, content: bytes) -> int:
        """The number of a new bufferView with a content."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content)}
        )
        self.binary += content
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: np.ndarray, dtype: str = "f4", **more: Any) -> int:
        """The number of a new accessor with values [n] or [n,k]."""
        values = np.asarray(values)
        values = values.reshape(len(values), -1)
        said = {"bufferView": self.view(np.ascontiguousarray(values, f"<{dtype}").tobytes())}
        said |= {"componentType": _CODES[dtype], "count": len(values), "type": _KINDS[values.shape[1]]}
        self.json["accessors"].append(said | more)
        return len(self.json["accessors"]) - 1

    def splats(self, field: SplatField) -> dict[str, Any]:
        """A primitive of splats."""
        names = [f"{EXTENSION}:SH_DEGREE_{l}_COEF_{n}" for l in range(4) for n in range(2 * l + 1)]  # noqa: E741
        attributes = {
            "POSITION": self.accessor(field.means),
            f"{EXTENSION}:ROTATION": self.accessor(field.quaternions[:, [1, 2, 3, 0]]),
            f"{EXTENSION}:SCALE": self.accessor(np.exp(field.log_scales)),
            f"{EXTENSION}:OPACITY": self.accessor(field.opacities),
        }
        for name, part in zip(names, np.moveaxis(field.sh, 1, 0), strict=False):
            attributes[name] = self.accessor(part)
        said = {EXTENSION: {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}}
        return {"mode": 0, "attributes": attributes, "extensions": said}

    def mesh(self, *primitives: dict[str, Any]) -> int:
        """The number of a new mesh."""
        self.json["meshes"].append({"primitives": list(primitives)})
        return len(self.json["meshes"]) - 1

    def node(self, **said: Any) -> int:
        """The number of a new node."""
        self.json["nodes"].append(said)
        return len(self.json["nodes"]) - 1

    def scene(self, *roots: int) -> None:
        """A new scene; the first is the default one."""
        self.json.setdefault("scenes", []).append({"nodes": list(roots)})
        self.json["scene"] = 0

    def write(self, path: Path, uri: str | None = None) -> Path:
        """A .glb; a .gltf with its buffer at `uri`, or within where there is none."""
        buffer: dict[str, Any] = {"byteLength": len(self.binary)}
        self.json["buffers"] = [buffer]
        if path.suffix == ".glb":
            text = json.dumps(self.json).encode()
            text += b" " * (-len(text) % 4)
            binary = self.binary + b"\0" * (-len(self.binary) % 4)
            head = struct.pack("<IIIII", 0x46546C67, 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A)
            path.write_bytes(head + text + struct.pack("<II", len(binary), 0x004E4942) + binary)
            return path
        if uri is None:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()
        else:
            (path.parent / uri.replace("%20", " ")).parent.mkdir(parents=True, exist_ok=True)
            (path.parent / uri.replace("%20", " ")).write_bytes(self.binary)
        buffer["uri"] = uri
        path.write_text(json.dumps(self.json))
        return path


def scene_of(*fields: SplatField) -> Asset:
    """Each field as a mesh of its own, all in one scene."""
    asset = Asset()
    asset.scene(*(asset.node(mesh=asset.mesh(asset.splats(field))) for field in fields))
    return asset
