"""Mesh and point cloud files with vertex colors: PLY for both, binary glTF for meshes.

PLY: x y z, nx ny nz (float), red green blue (uchar, sRGB), and faces as vertex lists. glTF is y up with
linear
colors: the node's rotation takes the scene's up direction to y, positions stay unchanged; COLOR_0 is linear,
16 bits.

Sources: Turk, "The PLY Polygon File Format" (1994); Khronos, "glTF 2.0 Specification", sections 3.7.2.1 and
4.4; IEC 61966-2-1 (sRGB).
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from cagefield.errors import FieldError
from cagefield.fields.meshing import Mesh
from cagefield.fields.splat_field import NO_OFFSET, Offset
from cagefield.files.atomic import replaced_file
from cagefield.images.render_result import to_uint8

MESH_SUFFIXES = (".ply", ".glb")
_PLY_TYPES = {"u1": "uchar", "<f4": "float", "<f8": "double"}
_FLOAT, _UINT, _USHORT = 5126, 5125, 5123
_ARRAY, _ELEMENTS = 34962, 34963


def write_points(
    path: str | Path,
    positions: NDArray[Any],
    rgb: NDArray[Any],
    normals: NDArray[Any] | None = None,
    *,
    offset: Offset = NO_OFFSET,
) -> None:
    """Write positions [M,3], colors [M,3] in [0,1] and normals [M,3] as a PLY, complete or not at all.

    A nonzero `offset` is added to the positions, which are then written as doubles.
    """
    _write_ply(Path(path), positions, normals, rgb, None, offset)


def write_mesh(
    path: str | Path, mesh: Mesh, up: ArrayLike = (0.0, 0.0, 1.0), *, offset: Offset = NO_OFFSET
) -> None:
    """Write a mesh as .ply or .glb, complete or not at all; `up` [3] is the scene's up direction, for glTF.

    A nonzero `offset` is added to a .ply's positions, as doubles, and to the translation of a .glb's node.

    Raises:
        FieldError: another suffix.
    """
    path = Path(path)
    if path.suffix.lower() == ".ply":
        _write_ply(path, mesh.positions, mesh.normals, mesh.rgb, mesh.faces, offset)
    elif path.suffix.lower() == ".glb":
        _write_glb(path, mesh, np.asarray(up, np.float64), np.array(offset))
    else:
        raise FieldError(f"{path}: a mesh is written as {' or '.join(MESH_SUFFIXES)}; give such a name")


def _write_ply(
    path: Path,
    positions: NDArray[Any],
    normals: NDArray[Any] | None,
    rgb: NDArray[Any],
    faces: NDArray[np.int32] | None,
    offset: Offset,
) -> None:
    columns = [(name, "<f8" if any(offset) else "<f4") for name in ("x", "y", "z")]
    columns += [(name, "<f4") for name in ("nx", "ny", "nz")] if normals is not None else []
    columns += [(name, "u1") for name in ("red", "green", "blue")]
    table = np.empty(len(positions), columns)
    coordinates = positions.astype(np.float64) + offset if any(offset) else positions
    parts = [coordinates, *([] if normals is None else [normals]), to_uint8(np.asarray(rgb))]
    for name, values in zip(table.dtype.names or (), np.concatenate(parts, axis=1).T, strict=True):
        table[name] = values
    header = ["ply", "format binary_little_endian 1.0", "comment written by cagefield"]
    header += [f"element vertex {len(table)}"]
    header += [f"property {_PLY_TYPES[kind]} {name}" for name, kind in columns]
    if faces is not None:
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    with replaced_file(path) as temporary, temporary.open("wb") as file:
        file.write("\n".join([*header, "end_header", ""]).encode())
        file.write(table.tobytes())
        if faces is not None:
            rows = np.empty(len(faces), [("count", "u1"), ("vertices", "<i4", (3,))])
            rows["count"], rows["vertices"] = 3, faces
            file.write(rows.tobytes())


def _write_glb(path: Path, mesh: Mesh, up: NDArray[np.float64], shift: NDArray[np.float64]) -> None:
    turn = _rotation_to_y(up)
    node: dict[str, Any] = {"mesh": 0, "rotation": turn.as_quat().tolist()}
    if shift.any():
        node["translation"] = turn.apply(shift).tolist()
    colors = np.full((len(mesh.rgb), 4), 65535, "<u2")
    colors[:, :3] = np.rint(65535.0 * srgb_to_linear(mesh.rgb))
    parts: list[tuple[NDArray[Any], int, str, int]] = [
        (mesh.positions.astype("<f4"), _FLOAT, "VEC3", _ARRAY),
        (mesh.normals.astype("<f4"), _FLOAT, "VEC3", _ARRAY),
        (colors, _USHORT, "VEC4", _ARRAY),
        (mesh.faces.astype("<u4").reshape(-1), _UINT, "SCALAR", _ELEMENTS),
    ]
    views, accessors, offset = list[dict[str, Any]](), list[dict[str, Any]](), 0
    for values, component, kind, target in parts:
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": values.nbytes, "target": target})
        accessors.append(
            {"bufferView": len(accessors), "componentType": component, "count": len(values), "type": kind}
        )
        offset += values.nbytes
    accessors[0] |= {"min": mesh.positions.min(axis=0).tolist(), "max": mesh.positions.max(axis=0).tolist()}
    accessors[2]["normalized"] = True
    document = {
        "asset": {"version": "2.0", "generator": "cagefield"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}, "indices": 3, "material": 0}
                ]
            }
        ],
        "materials": [
            {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}, "doubleSided": True}
        ],
        "buffers": [{"byteLength": offset}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(document, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    with replaced_file(path) as temporary, temporary.open("wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + offset))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", offset, b"BIN\0"))
        for values, *_ in parts:
            file.write(values.tobytes())


def srgb_to_linear(rgb: NDArray[Any]) -> NDArray[np.float64]:
    """Linear light [N,3] of sRGB colors [N,3], both in [0,1]."""
    c = np.clip(np.asarray(rgb, np.float64), 0.0, 1.0)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def _rotation_to_y(up: NDArray[np.float64]) -> Rotation:
    """Rotation that takes `up` [3] to y."""
    rotation, _ = Rotation.align_vectors([[0.0, 1.0, 0.0]], [up / np.linalg.norm(up)])
    return rotation
