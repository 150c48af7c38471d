"""glTF with the extension KHR_gaussian_splatting, as one .glb file.

A primitive of points with the attributes POSITION, KHR_gaussian_splatting:ROTATION (x y z w), :SCALE (not
logarithms), :OPACITY (in [0, 1]) and :SH_DEGREE_l_COEF_n (n = 0 .. 2l); floats, or integers, normalised or
not. Axes are glTF's, y up ("rub"). Of a node's transformation the translation, rotation and uniform scale are
applied. Colours are sRGB values or, where `colorSpace` says so, linear light, which is converted.

Source: KhronosGroup/glTF, extensions/2.0/Khronos/KHR_gaussian_splatting; glTF 2.0, "GLB File Format".
"""

from __future__ import annotations

import json
import struct
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield import json_text
from cagefield.atomic_files import replaced_file
from cagefield.errors import FieldError
from cagefield.formats.splat_axes import Axes
from cagefield.formats.splat_colour_space import srgb_harmonics
from cagefield.formats.splat_table import BATCH, OnProgress, SplatBatch, SplatSource, SplatTable
from cagefield.regular_files import MOST_TEXT, open_regular, read_array
from cagefield.sh_rotation import turned_sh
from cagefield.typing import AnyArray

GLTF_AXES: Axes = "rub"
EXTENSION = "KHR_gaussian_splatting"
SRGB, LINEAR = "srgb_rec709_display", "lin_rec709_display"

_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def open_splat_gltf(path: Path) -> SplatSource:
    """The splats of the first primitive of a .glb file that holds any.

    Raises:
        FieldError: no .glb, none with splats, a file that is damaged or leans on other files.
    """
    try:
        gltf, binary = _chunks(path)
        primitive, node = _primitive(gltf)
        return _source(path, gltf, binary, primitive, node)
    except FieldError:
        raise
    except KeyError as error:
        raise _damaged(path, f"it has no {error.args[0]!s:.60}") from None
    except (
        ValueError,
        TypeError,
        IndexError,
        AttributeError,
        OverflowError,
        struct.error,
        RecursionError,
    ) as error:
        raise _damaged(path, " ".join(str(error).split())[:120] or type(error).__name__) from None


def _chunks(path: Path) -> tuple[dict[str, Any], tuple[int, int]]:
    """(the JSON of a file, the first byte and the size of its binary part)."""
    size = path.stat().st_size
    with open_regular(path) as file:
        magic, version, _ = struct.unpack("<III", file.read(12))
        if magic != _MAGIC or version != 2:
            raise ValueError("it does not begin as GLB 2 does")
        length, kind = struct.unpack("<II", file.read(8))
        if kind != _JSON or 20 + length > size:
            raise ValueError("its JSON is cut off")
        if length > MOST_TEXT:
            raise ValueError(f"its JSON has {length} bytes, at most {MOST_TEXT} are read")
        gltf = json_text.loads(file.read(length))
        if not isinstance(gltf, dict):
            raise ValueError("its JSON is no object")
        length, kind = struct.unpack("<II", file.read(8))
        if kind != _BIN or file.tell() + length > size:
            raise ValueError("its binary part is cut off")
        return gltf, (file.tell(), length)


def _primitive(gltf: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """(the first primitive of splats, the node that shows it)."""
    for number, mesh in enumerate(gltf["meshes"]):
        for primitive in mesh["primitives"]:
            if EXTENSION in primitive.get("extensions", {}) or any(
                name.startswith(EXTENSION) for name in primitive["attributes"]
            ):
                nodes = [node for node in gltf.get("nodes", []) if node.get("mesh") == number]
                return primitive, nodes[0] if nodes else {}
    raise ValueError(f"no primitive has {EXTENSION}")


def _source(
    path: Path, gltf: dict[str, Any], binary: tuple[int, int], primitive: dict[str, Any], node: dict[str, Any]
) -> SplatSource:
    names = primitive["attributes"]

    def column(name: str, width: int) -> _Column:
        return _Column.of(path, gltf, binary, names[name], width)

    mean = column("POSITION", 3)
    rotation, scale = column(f"{EXTENSION}:ROTATION", 4), column(f"{EXTENSION}:SCALE", 3)
    opacity = column(f"{EXTENSION}:OPACITY", 1)
    degree = 0
    while degree < 4 and f"{EXTENSION}:SH_DEGREE_{degree + 1}_COEF_0" in names:
        degree += 1
    sh = [column(name, 3) for name, _ in _harmonics(degree)]
    if any(part.count != mean.count for part in (rotation, scale, opacity, *sh)):
        raise ValueError("its attributes are of different lengths")
    shift, turn, factor = _transformation(node)
    matrix = Rotation.from_quat(turn).as_matrix()
    still = np.allclose(matrix, np.eye(3), atol=1e-6)
    linear = _is_linear(path, primitive)

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, mean.count, BATCH):
            last = min(first + BATCH, mean.count)
            with np.errstate(divide="ignore", invalid="ignore"):
                log_scales = np.log(scale.rows(first, last) * factor)
            quaternions = rotation.rows(first, last)
            if not still:
                lengths = np.linalg.norm(quaternions, axis=1, keepdims=True)
                quaternions = np.where(lengths > 0.0, quaternions, (0.0, 0.0, 0.0, 1.0))
                quaternions = (Rotation.from_quat(turn) * Rotation.from_quat(quaternions)).as_quat()
            colours = np.stack([part.rows(first, last) for part in sh], axis=1)
            if degree and not still:
                colours = turned_sh(colours, matrix)
            yield SplatBatch(
                mean.rows(first, last) @ matrix.T * factor + shift,
                log_scales,
                quaternions[:, [3, 0, 1, 2]],
                opacity.rows(first, last)[:, 0],
                srgb_harmonics(colours) if linear else colours,
            )

    return SplatSource(path, mean.count, degree, GLTF_AXES, batches, end=sum(binary))


def _is_linear(path: Path, primitive: dict[str, Any]) -> bool:
    """Whether the colours are linear light; warns of that, and of a space that is not known."""
    space = primitive.get("extensions", {}).get(EXTENSION, {}).get("colorSpace", SRGB)
    if space == LINEAR:
        warnings.warn(
            f"{path}: its colours are linear light; they become sRGB splat by splat, and are blended as sRGB",
            stacklevel=2,
        )
    elif space != SRGB:
        warnings.warn(
            f"{path}: its colour space {space!r:.60} is not known and taken as {SRGB}", stacklevel=2
        )
    return bool(space == LINEAR)


def _harmonics(degree: int) -> list[tuple[str, int]]:
    """(names, widths) of the attributes of harmonics."""
    return [
        (f"{EXTENSION}:SH_DEGREE_{of}_COEF_{n}", 3) for of in range(degree + 1) for n in range(2 * of + 1)
    ]


def _transformation(node: dict[str, Any]) -> tuple[AnyArray, AnyArray, float]:
    """(translation [3], rotation (x y z w), scale) of a node."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], np.float64).reshape(4, 4).T
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        turn = Rotation.from_matrix(matrix[:3, :3] / scale).as_quat()
        shift = matrix[:3, 3]
    else:
        scale = np.array(node.get("scale", [1.0, 1.0, 1.0]), np.float64).reshape(3)
        turn = np.array(node.get("rotation", [0.0, 0.0, 0.0, 1.0]), np.float64).reshape(4)
        shift = np.array(node.get("translation", [0.0, 0.0, 0.0]), np.float64).reshape(3)
    if not np.allclose(scale, scale[0], rtol=1e-5) or not scale[0] > 0.0:
        raise ValueError("its node scales the axes differently; apply its transformation")
    return shift, turn, float(scale[0])


class _Column:
    """An accessor: numbers [count,width] at places of the file."""

    def __init__(
        self, path: Path, dtype: np.dtype[Any], begin: int, stride: int, count: int, whole: bool
    ) -> None:
        self._path, self._dtype, self._begin, self._stride = path, dtype, begin, stride
        self.count, self._whole = count, whole

    @classmethod
    def of(
        cls, path: Path, gltf: dict[str, Any], binary: tuple[int, int], number: int, width: int
    ) -> _Column:
        accessor = gltf["accessors"][number]
        view = gltf["bufferViews"][accessor["bufferView"]]
        if view.get("buffer", 0) != 0 or "uri" in gltf["buffers"][0] or "sparse" in accessor:
            raise ValueError("its values lie in other files, or are sparse")
        if _WIDTHS[accessor["type"]] != width:
            raise ValueError(f"an attribute is {accessor['type']}")
        base = np.dtype(_TYPES[accessor["componentType"]])
        dtype = np.dtype((base, (width,)))
        stride = int(view.get("byteStride", dtype.itemsize))
        begin = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
        count = int(accessor["count"])
        end = begin + stride * max(count - 1, 0) + dtype.itemsize
        if count < 1 or begin < 0 or stride < dtype.itemsize or end > binary[1]:
            raise ValueError("an attribute ends after the file")
        return cls(path, dtype, binary[0] + begin, stride, count, not accessor.get("normalized", False))

    def rows(self, first: int, last: int) -> AnyArray:
        size = (last - first - 1) * self._stride + self._dtype.itemsize
        raw = read_array(self._path, np.uint8, size, offset=self._begin + first * self._stride)
        raw = np.concatenate([raw, np.zeros(self._stride - self._dtype.itemsize, np.uint8)])
        raw = raw.reshape(last - first, self._stride)[:, : self._dtype.itemsize]
        base, _ = self._dtype.subdtype or (self._dtype, ())
        values = np.ascontiguousarray(raw).view(base)
        if base.kind == "f" or self._whole:
            return values.astype(np.float64)
        return np.maximum(values / float(np.iinfo(base).max), -1.0)


def write_splat_gltf(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Writes the splats, whose axes are glTF's, as one .glb file, complete or not at all."""
    count = table.count
    attributes = [("POSITION", 3), (f"{EXTENSION}:ROTATION", 4), (f"{EXTENSION}:SCALE", 3)]
    attributes += [(f"{EXTENSION}:OPACITY", 1)]
    attributes += _harmonics(table.sh_degree)
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
        gltf = {
            "asset": {"version": "2.0", "generator": "cagefield"},
            "extensionsUsed": [EXTENSION],
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
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
            out.write(struct.pack("<IIIII", _MAGIC, 2, 28 + len(text) + at, len(text), _JSON) + text)
            out.write(struct.pack("<II", at, _BIN))
            for number, file in enumerate(files):
                file.seek(0)
                while part_of := file.read(1 << 22):
                    out.write(part_of)
                on_progress(0.6 + 0.4 * (number + 1) / len(files))


def _damaged(path: Path, why: str) -> FieldError:
    return FieldError(f"{path}: no .glb of splats that can be read: {why}; copy or export it again")
