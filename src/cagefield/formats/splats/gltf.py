"""Gaussian splats of glTF files (.glb, .gltf): all splats of the default scene.

Point primitives with KHR_gaussian_splatting have the attributes POSITION, KHR_gaussian_splatting:ROTATION
(x y z w), :SCALE (linear), :OPACITY (in [0, 1]) and :SH_DEGREE_l_COEF_n (n = 0 .. 2l). Exporters of
early drafts write COLOR_0 (color of degree 0 and opacity, in [0, 1]) for the last two,
and _ROTATION, _SCALE (linear, or logarithms where any value is negative) and _SH_DEGREE_l_COEF_n.
An extension for SPZ (KHR_gaussian_splatting_compression_spz_2 and earlier names) has the content of a
.spz file in a bufferView, whose splats are in the primitive's coordinates.

Axes are glTF's, y up ("rub"). Nodes and instances may transform splats by any matrix (`gltf_nodes`,
`splat_transform`). Colors are sRGB values or, where `colorSpace` says so, linear light, which is converted.

Source: KhronosGroup/glTF, extensions/2.0/Khronos/KHR_gaussian_splatting and
KHR_gaussian_splatting_compression_spz_2, and their drafts.
"""

from __future__ import annotations

import struct
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.formats.splats.axes import Axes
from cagefield.formats.splats.color_space import convert_harmonics_to_srgb
from cagefield.formats.splats.gltf_buffers import Accessor, GltfAsset
from cagefield.formats.splats.gltf_nodes import INSTANCING, MeshInstances, scene_meshes
from cagefield.formats.splats.splat_ply import MESH, POINT_CLOUD_CURE
from cagefield.formats.splats.splat_table import BATCH_SPLATS, SplatBatch, SplatSource
from cagefield.formats.splats.spz import open_spz_stream
from cagefield.formats.splats.transform import transform_splats
from cagefield.typing import Array

GLTF_AXES: Axes = "rub"
EXTENSION = "KHR_gaussian_splatting"
QUANTIZATION = "KHR_mesh_quantization"
SRGB, LINEAR = "srgb_rec709_display", "lin_rec709_display"
MAX_SPLATS = 1 << 31
"""Maximum number of splats over all instances; a few bytes can claim any number."""

_COPY_BYTES = 1 << 20
_POINTS, _TRIANGLES = 0, 4


@dataclass(frozen=True, eq=False)
class _Part:
    """Splats of a primitive in its own coordinates, and the matrices [I,4,4] of its instances."""

    splats: SplatSource
    matrices: Array


def open_splat_gltf(path: Path) -> SplatSource:
    """Open glTF file; a warning counts its ignored content.

    Raises:
        FieldError: no glTF, no splats, a damaged file, or a missing buffer.
    """
    try:
        return _source(path, GltfAsset(path))
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
        np.linalg.LinAlgError,
    ) as error:
        raise _damaged(path, " ".join(str(error).split())[:160] or type(error).__name__) from None


def harmonic_names(degree: int, prefix: str = f"{EXTENSION}:") -> list[str]:
    """Attribute names of the harmonics up to a degree."""
    return [f"{prefix}SH_DEGREE_{of}_COEF_{n}" for of in range(degree + 1) for n in range(2 * of + 1)]


def _source(path: Path, asset: GltfAsset) -> SplatSource:
    meshes, hidden = scene_meshes(asset)
    if not asset.items("nodes"):
        meshes = [MeshInstances(number, np.eye(4)[None]) for number in range(len(asset.items("meshes")))]
    opened = dict[tuple[int, int], SplatSource]()
    ignored = dict[str, int]()
    parts = list[_Part]()
    for shown in meshes:
        for number, primitive in enumerate(asset.item("meshes", shown.mesh)["primitives"]):
            if not _has_splats(primitive):
                _add_count(ignored, _primitive_kind(primitive), len(shown.matrices))
                continue
            if (shown.mesh, number) not in opened:
                opened[shown.mesh, number] = _open_primitive(path, asset, primitive, ignored)
            parts.append(_Part(opened[shown.mesh, number], shown.matrices))
    if not parts:
        raise FieldError(f"{path}: {_without_splats(ignored, hidden)}")
    for name in ("animations", "skins", "cameras"):
        _add_count(ignored, name, len(asset.items(name)))
    _add_count(ignored, "meshes of nodes that the default scene does not show", hidden)
    if asset.items("nodes"):
        named = {node.get("mesh") for node in asset.items("nodes")}
        _add_count(ignored, "meshes that no node shows", len(set(range(len(asset.items("meshes")))) - named))
    for name in asset.json.get("extensionsRequired", []):
        if name not in (EXTENSION, INSTANCING, QUANTIZATION) and "spz" not in name.lower():
            _add_count(ignored, f"required extension {name:.60}", 1)
    if ignored:
        said = ", ".join(f"{count} {name}" for name, count in ignored.items())
        warnings.warn(f"{path}: left out: {said:.300}", stacklevel=2)
    return _concatenate_parts(path, parts, asset.end)


def _concatenate_parts(path: Path, parts: list[_Part], end: int) -> SplatSource:
    """Splats of all instances of all primitives."""
    count = sum(part.splats.count * len(part.matrices) for part in parts)
    if count > MAX_SPLATS:
        raise ValueError(f"its instances are {count} splats, at most {MAX_SPLATS} are read")
    degree = max(part.splats.sh_degree for part in parts)

    def batches() -> Iterator[SplatBatch]:
        for part in parts:
            for matrix in part.matrices:
                for batch in part.splats.batches():
                    yield transform_splats(batch, matrix).pad_harmonics(degree)

    antialiased = all(part.splats.antialiased for part in parts)
    return SplatSource(path, count, degree, GLTF_AXES, batches, antialiased, end=end, is_double=True)


def _has_splats(primitive: dict[str, Any]) -> bool:
    names = set(primitive.get("attributes", {}))
    return (
        EXTENSION in primitive.get("extensions", {})
        or _spz_view(primitive) is not None
        or any(name.startswith(EXTENSION) for name in names)
        or {"_SCALE", "_ROTATION"} <= names
    )


def _spz_view(primitive: dict[str, Any]) -> Any:
    """Index of the bufferView with the content of a .spz file; None without."""
    extensions = primitive.get("extensions", {})
    for found in (extensions, extensions.get(EXTENSION, {}).get("extensions", {})):
        for name, said in found.items():
            if "spz" in name.lower():
                return said["bufferView"]
    return None


def _open_primitive(
    path: Path, asset: GltfAsset, primitive: dict[str, Any], ignored: dict[str, int]
) -> SplatSource:
    """Splats of a primitive; ignored attributes are counted in `ignored`."""
    linear = _is_linear(path, primitive)
    view = _spz_view(primitive)
    found = _attributes(path, asset, primitive, ignored) if view is None else _compressed(path, asset, view)
    if not linear:
        return found

    def batches() -> Iterator[SplatBatch]:
        return (replace(batch, sh=convert_harmonics_to_srgb(batch.sh)) for batch in found.batches())

    return replace(found, batches=batches)


def _compressed(path: Path, asset: GltfAsset, view: Any) -> SplatSource:
    """Splats of a .spz file's content in a bufferView."""
    buffer, begin, size, _ = asset.view(view)
    with tempfile.SpooledTemporaryFile(max_size=1 << 22) as content:
        for at in range(0, size, _COPY_BYTES):
            content.write(buffer.read(begin + at, min(_COPY_BYTES, size - at)))
        content.seek(0)
        return open_spz_stream(path, cast(BinaryIO, content), size)


def _attributes(
    path: Path, asset: GltfAsset, primitive: dict[str, Any], ignored: dict[str, int]
) -> SplatSource:
    """Splats of a primitive's attributes, by their final names or those of drafts."""
    numbers = dict(primitive["attributes"])

    def column(name: str, width: int | tuple[int, ...]) -> Accessor:
        for prefix in (f"{EXTENSION}:", "_", ""):
            if prefix + name in numbers:
                return asset.accessor(numbers.pop(prefix + name), width)
        raise KeyError(f"{EXTENSION}:{name}")

    mean, rotation, scale = column("POSITION", 3), column("ROTATION", 4), column("SCALE", 3)
    prefix = next((p for p in (f"{EXTENSION}:", "_") if f"{p}SH_DEGREE_1_COEF_0" in numbers), f"{EXTENSION}:")
    degree = 0
    while degree < 4 and f"{prefix}SH_DEGREE_{degree + 1}_COEF_0" in numbers:
        degree += 1
    names = [name.removeprefix(prefix) for name in harmonic_names(degree, prefix)]
    early = f"{EXTENSION}:{names[0]}" not in numbers and f"_{names[0]}" not in numbers
    color = column("COLOR_0", (3, 4)) if early else None
    numbers.pop("COLOR_0", None)  # in final files COLOR_0 serves programs without splats
    sh = [column(name, 3) for name in names[int(early) :]]
    has_opacity = any(p + "OPACITY" in numbers for p in (f"{EXTENSION}:", "_"))
    opacity = column("OPACITY", 1) if has_opacity or color is None or color.width == 3 else None
    parts = [part for part in (mean, rotation, scale, color, opacity, *sh) if part is not None]
    if any(part.count != mean.count for part in parts):
        raise ValueError("its attributes are of different lengths")
    if not all(part.is_stored for part in (mean, rotation, scale)):
        raise ValueError("an attribute has no values")
    for name in numbers:
        _add_count(ignored, f"attributes {name:.60}", 1)
    is_log = early and scale.min_value < 0.0
    if early:
        taken = "logarithms, as some are negative" if is_log else "lengths, as none is negative"
        warnings.warn(f"{path}: attributes of an early draft; its scales are taken as {taken}", stacklevel=2)

    def rows(first: int, last: int) -> SplatBatch:
        log_scales = scale.rows(first, last)
        if not is_log:
            with np.errstate(divide="ignore", invalid="ignore"):
                log_scales = np.log(log_scales)
        values = [part.rows(first, last) for part in sh]
        alpha = None if opacity is None else opacity.rows(first, last)[:, 0]
        if color is not None:
            rgba = color.rows(first, last)
            rgba = color.normalize(rgba) if color.is_integer else rgba
            values.insert(0, (rgba[:, :3] - 0.5) / spherical_harmonics.C0)
            alpha = rgba[:, 3] if alpha is None else alpha
        assert alpha is not None  # of one or the other
        quaternions = rotation.rows(first, last)[:, [3, 0, 1, 2]]
        return SplatBatch(mean.rows(first, last), log_scales, quaternions, alpha, np.stack(values, axis=1))

    def batches() -> Iterator[SplatBatch]:
        return (
            rows(first, min(first + BATCH_SPLATS, mean.count)) for first in range(0, mean.count, BATCH_SPLATS)
        )

    return SplatSource(path, mean.count, degree, GLTF_AXES, batches)


def _is_linear(path: Path, primitive: dict[str, Any]) -> bool:
    """Whether the colors are linear light; warns about linear light and unknown color spaces."""
    space = primitive.get("extensions", {}).get(EXTENSION, {}).get("colorSpace", SRGB)
    if space == LINEAR:
        warnings.warn(
            f"{path}: its colors are linear light; they become sRGB splat by splat, and are blended as sRGB",
            stacklevel=2,
        )
    elif space != SRGB:
        warnings.warn(f"{path}: its color space {space!r:.60} is not known and taken as {SRGB}", stacklevel=2)
    return bool(space == LINEAR)


def _primitive_kind(primitive: dict[str, Any]) -> str:
    mode = primitive.get("mode", _TRIANGLES)
    return "primitives of points" if mode == _POINTS else "primitives of lines or triangles"


def _add_count(counts: dict[str, int], name: str, count: int) -> None:
    if count:
        counts[name] = counts.get(name, 0) + count


def _without_splats(found: dict[str, int], hidden: int) -> str:
    """Error message for a file whose scene has no splats."""
    if "primitives of lines or triangles" in found:
        return MESH
    if "primitives of points" in found:
        return f"a point cloud, no splats: no primitive has {EXTENSION}; {POINT_CLOUD_CURE}"
    if hidden:
        return f"its default scene shows no splats, {hidden} nodes with meshes lie outside; export it again"
    return f"no primitive has {EXTENSION}; export it again"


def _damaged(path: Path, why: str) -> FieldError:
    return FieldError(f"{path}: no glTF of splats that can be read: {why}; copy or export it again")
